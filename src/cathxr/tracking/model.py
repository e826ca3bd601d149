"""The `model` method: two measured midlines in, one catheter in space out."""

import math
from copy import copy

import numpy as np

from cathxr.core import Detection, FloatArray, Observation, Rig, Status, Track
from cathxr.geometry import CameraModel, resampled, tip_pose
from cathxr.geometry.calibration_error import camera_errors, point_covariance
from cathxr.geometry.roll import tip_roll_rad
from cathxr.tracking.continuity import Continuity, missing_reason
from cathxr.tracking.fit import ALIGNED, HIDDEN_MM, CurveFit, camera_table
from cathxr.tracking.judge import RESOLVED_MM
from cathxr.tracking.prediction import Prediction
from cathxr.tracking.solve import Solution, solved

_DENSE = 240
_PASSING = ("no catheter", "more than one thing looks like a catheter")
"""Reasons of one view that pass: the other says that the catheter is still there."""
_SAME_CALIBRATION_MM = 3.0
_LONGEST_FOLD_MM = 5.0


class ModelTracker:
    """Matches the two views' midlines, triangulates, fits one spline to both, and says how sure it is."""

    def __init__(self, rig: Rig, *, points: int = 50) -> None:
        if not 2 <= points <= 200:
            raise ValueError(f"points: expected 2 to 200, got {points}")
        self._names = ("top", "front")
        self._cameras = [CameraModel.of(rig.cameras[name]) for name in self._names]
        self._table = camera_table(self._cameras)
        errors = camera_errors(rig)
        self._errors = [errors[name] for name in self._names]
        self._radius = 0.5 * rig.catheter.diameter_mm
        self._zero, self._roll = rig.zero_direction, rig.roll
        self._points = points
        self._continuity = Continuity()
        self._prediction = Prediction()
        self._calibrated: tuple[FloatArray, float] | None = None

    def reset(self) -> None:
        """Forget what came before."""
        self._continuity.reset()
        self._prediction.reset()
        self._calibrated = None

    def update(self, observation: Observation) -> Track:
        """Return the Track of one observation."""
        before = copy(self._continuity), copy(self._prediction), self._calibrated
        track = self._updated(observation)
        if observation.predicted and track.status is not Status.TRACKED:
            # what lies near the prediction is no catheter: the pair will be read whole
            self._continuity, self._prediction, self._calibrated = before
        return track

    def _updated(self, observation: Observation) -> Track:
        missing = missing_reason(observation)
        if missing is not None:
            return self._continuity.coasting(observation, missing)
        found = [observation.detection(name) for name in self._names]
        detections = [each for each in found if each is not None]
        if len(detections) < len(self._names):
            return self._continuity.lost(observation, "no picture from one camera")
        failed = [each for each in detections if each.reason is not None]
        if failed:
            reason = f"{failed[0].reason} ({failed[0].camera})"
            # one view may lose a catheter that touches itself; where neither sees one there is none
            if len(failed) < len(detections) and failed[0].reason in _PASSING:
                return self._continuity.coasting(observation, reason)
            return self._continuity.lost(observation, reason)
        result = self._solved(observation.t_ns, detections)
        if isinstance(result, str):
            # both pictures show something: the next pair is looked for where the last good one says
            return self._continuity.coasting(observation, result)
        solution, shape = result
        roll = observation.roll_rad
        turn = tip_roll_rad(self._roll, shape_box=shape, roll_rad=roll)
        reason = ""
        if solution.sigma_mm > RESOLVED_MM:
            reason = "the tip is not resolved in both views"
        elif solution.doubtful is not None and not self._continuity.near(observation.t_ns, shape[0]):
            reason = f"something may lie at the tip ({solution.doubtful})"
        track = Track(
            seq=observation.seq,
            t_ns=observation.t_ns,
            status=Status.COASTING if reason else Status.TRACKED,
            reason=reason,
            shape_box=resampled(shape, self._points),
            box_from_tip=tip_pose(shape, zero_direction=self._zero, roll_rad=turn),
            roll_rad=roll,
            roll_predicted=observation.roll_predicted,
            sigma_mm=math.hypot(solution.sigma_mm, self._calibration_mm(shape[0])),
        )
        return track if reason else self._continuity.tracked(track)

    def _calibration_mm(self, tip_box: FloatArray) -> float:
        """Return the calibration's part of a tip's sigma; it changes so slowly over the box that it is kept."""
        if self._calibrated is None or math.dist(self._calibrated[0], tip_box) > _SAME_CALIBRATION_MM:
            self._calibrated = (tip_box, float(np.sqrt(np.trace(point_covariance(self._errors, tip_box)))))
        return self._calibrated[1]

    def _solved(self, t_ns: int, detections: list[Detection]) -> tuple[Solution, FloatArray] | str:
        """Return the fit and its centreline (N, 3) mm, tip first, or why there is none."""
        predicted = self._prediction.guess(t_ns, self._cameras, detections)
        solution = solved(self._cameras, self._table, detections, radius_mm=self._radius, predicted=predicted)
        if isinstance(solution, str):
            return solution
        fit = solution.fit
        shape = self._shape(fit)
        if isinstance(shape, str):
            return shape
        self._prediction.learn(t_ns, shape[1:])
        return solution, shape

    def _shape(self, fit: CurveFit) -> FloatArray | str:
        """Return the curve (N, 3) mm from the tip (one radius beyond the cap's centre) to the entry at x = 0."""
        curve = fit.points(np.linspace(0.0, 1.0, _DENSE))
        outwards = curve[0] - curve[1]
        tip = curve[0] + self._radius * outwards / np.linalg.norm(outwards)
        dense = np.vstack([tip, curve])
        behind = np.flatnonzero((dense[:-1, 0] > 0.0) & (dense[1:, 0] <= 0.0))
        if behind.size:
            last = int(behind[-1])
            share = dense[last, 0] / (dense[last, 0] - dense[last + 1, 0])
            entry = dense[last] + share * (dense[last + 1] - dense[last])
            dense = np.vstack([dense[: last + 1], entry])
        else:
            dense = _unfolded(dense)
            direction = _mean_direction(dense)
            if dense[-1, 0] > HIDDEN_MM or direction[0] > -ALIGNED:
                return "the catheter's beginning at the inlet is not seen"
            if dense[-1, 0] > 1e-9:
                dense = np.vstack([dense, dense[-1] - dense[-1, 0] / direction[0] * direction])
        dense[-1, 0] = 0.0
        if len(dense) < 3 or np.linalg.norm(np.diff(dense, axis=0), axis=1).sum() < self._radius:
            return "the catheter is not inserted"
        distinct = np.concatenate([[True], np.linalg.norm(np.diff(dense, axis=0), axis=1) > 1e-6])
        distinct[-1] = True
        if np.linalg.norm(dense[-1] - dense[-2]) <= 1e-6:
            distinct[-2] = False
        return np.asarray(dense[distinct], dtype=np.float64)


def _unfolded(dense: FloatArray) -> FloatArray:
    """Return the curve (M, 3) without what turns back at its beginning, where the two views see it begin elsewhere.

    Such a fold is short and moves nothing else, but a frame carried around it would arrive upside down. As much again
    before it goes too: that is the way into the fold.
    """
    steps = np.diff(dense, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    forwards = steps[:, 0] < -ALIGNED * lengths
    for last in range(len(steps), max(2, len(dense) // 2), -1):
        if forwards[last - 1]:
            folded_mm = float(lengths[last:].sum())
            if not 0.0 < folded_mm < _LONGEST_FOLD_MM:
                return dense
            before_mm = np.cumsum(lengths[:last][::-1])
            return dense[: max(3, last + 1 - int(np.searchsorted(before_mm, folded_mm)))]
    return dense


def _mean_direction(dense: FloatArray) -> FloatArray:
    """Return the unit direction of the curve's last five millimetres, towards the entry."""
    behind = np.linalg.norm(dense - dense[-1], axis=1)
    near = int(np.argmax(behind < 5.0))
    chord = dense[-1] - dense[min(near, len(dense) - 2)]
    return np.asarray(chord / np.linalg.norm(chord), dtype=np.float64)
