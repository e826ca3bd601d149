"""The `model` method: two measured midlines in, one catheter in space out."""

import math
from copy import copy
from dataclasses import replace

import numpy as np

from cathxr.core import Detection, FloatArray, Observation, Rig, Status, Track
from cathxr.geometry import CameraModel, resampled, tip_pose
from cathxr.geometry.calibration_error import camera_errors
from cathxr.geometry.calibration_table import CalibrationTable
from cathxr.geometry.roll import tip_roll_rad
from cathxr.tracking.centreline import NOT_INSERTED, NOT_SEEN, centreline, curve_room
from cathxr.tracking.continuity import COAST_SPEED_MM_S, Continuity, missing_reason
from cathxr.tracking.end_shape import other_end_mm
from cathxr.tracking.fit import camera_table
from cathxr.tracking.judge import GUESSED_MM, RESOLVED_MM, UNRESOLVED
from cathxr.tracking.pair_work import PairWork
from cathxr.tracking.prediction import Prediction, Shutter
from cathxr.tracking.silhouette import SilhouetteFit
from cathxr.tracking.skew import SKEW_NS
from cathxr.tracking.solve import Solution, solved

_PASSING = ("no catheter", "more than one thing looks like a catheter")
"""Reasons of one view that pass: the other says that the catheter is still there."""

_Result = tuple[Solution, FloatArray, float] | str
"""A fit, its centreline (N, 3) mm, tip first, and the tip's error by timing, mm; or why there is none."""

_ALIKE_MM = 0.3
"""Two answers to one pair are one if their tips are no farther apart."""

_STAMP_S = 0.2e-3
"""A picture's instant is known to about this: by its stamp, and by which of its rows was open when."""
_CHANGE_SHARE, _STEADY_MM_S = 0.15, 2.0
"""A speed is known to this share of its change from pair to pair, and to what the fits' own noise leaves."""


class ModelTracker:
    """Matches the two views' midlines, triangulates, fits one spline to both, and says how sure it is."""

    def __init__(self, rig: Rig, *, points: int = 50) -> None:
        if not 2 <= points <= 200:
            raise ValueError(f"points: expected 2 to 200, got {points}")
        self._names = ("top", "front")
        self._cameras = [CameraModel.of(rig.cameras[name]) for name in self._names]
        self._table = camera_table(self._cameras)
        errors = camera_errors(rig)
        self._calibration = CalibrationTable([errors[name] for name in self._names], rig.roi)
        self._radius = 0.5 * rig.catheter.diameter_mm
        self._zero, self._roll = rig.zero_direction, rig.roll
        self._points = points
        self._continuity = Continuity()
        self._shutters = tuple(_shutter(rig, name) for name in self._names)
        self._prediction = Prediction(self._shutters)
        self._work = PairWork()
        self._silhouettes = SilhouetteFit(self._cameras, self._table, radius_mm=self._radius, roi=rig.roi)
        self._curve = curve_room()

    def reset(self) -> None:
        """Forget what came before."""
        self._continuity.reset()
        self._prediction.reset()

    def update(self, observation: Observation) -> Track:
        """Return the Track of one observation."""
        before = copy(self._continuity), copy(self._prediction)
        track = self._updated(observation)
        if observation.predicted and track.status is not Status.TRACKED:
            # what lies near the prediction is no catheter: the pair will be read whole
            self._continuity, self._prediction = before
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
        result: _Result | None = None if failed else self._solved(observation.t_ns, detections)
        if any(len(each.rim_px) for each in detections):
            result = self._with_rims(observation.t_ns, detections, result)
        if result is None and failed:
            reason = f"{failed[0].reason} ({failed[0].camera})"
            # one view may lose a catheter that touches itself; where neither sees one there is none
            if len(failed) < len(detections) and failed[0].reason in _PASSING:
                return self._continuity.coasting(observation, reason)
            return self._continuity.lost(observation, reason)
        assert result is not None
        if isinstance(result, str):
            # both pictures show something: the next pair is looked for where the last good one says
            return self._continuity.coasting(observation, result)
        solution, shape, timing_mm = result
        roll = observation.roll_rad
        end_mm = other_end_mm(
            solution.fit, detections, self._work.arrays.scratch, radius_mm=self._radius, doubtful=solution.doubtful
        )
        turn = tip_roll_rad(self._roll, shape_box=shape, roll_rad=roll)
        reason = ""
        if solution.sigma_mm > RESOLVED_MM:
            reason = f"{UNRESOLVED} in both views"
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
            sigma_mm=math.hypot(solution.sigma_mm, self._calibration.sigma_mm(shape[0]), timing_mm, end_mm),
        )
        if solution.sigma_mm > GUESSED_MM:
            return track
        self._prediction.learn(observation.t_ns, shape[1:], detections)
        return track if reason else self._continuity.tracked(track)

    def _solved(self, t_ns: int, detections: list[Detection]) -> tuple[Solution, FloatArray, float] | str:
        """Return the fit, its centreline (N, 3) mm, tip first, and the tip's error by timing, mm, or why there is none.

        The array is the next one's.
        """
        solution = self._fitted(t_ns, detections, None)
        if isinstance(solution, str):
            return solution
        count = centreline(solution.fit.spans, solution.fit.control, self._radius, self._curve)
        if count > 0 and self._apart_ns(t_ns, detections) > SKEW_NS:
            better = self._fitted(t_ns, detections, self._curve[1:count])
            if not isinstance(better, str):
                solution = better
                count = centreline(solution.fit.spans, solution.fit.control, self._radius, self._curve)
        return self._cut(t_ns, detections, solution, count)

    def _cut(
        self, t_ns: int, detections: list[Detection], solution: Solution, count: int
    ) -> tuple[Solution, FloatArray, float] | str:
        """Return a fit with its centreline of `count` points, see `centreline`, and what it is unsure by its motion."""
        if count == NOT_INSERTED:
            return "the catheter is not inserted"
        if count == NOT_SEEN:
            return "the catheter's beginning at the inlet is not seen"
        shape = self._curve[:count]
        timing_mm = self._timing_mm(t_ns, shape[1], self._apart_ns(t_ns, detections))
        return solution, shape, timing_mm

    def _fitted(self, t_ns: int, detections: list[Detection], curve: FloatArray | None) -> Solution | str:
        """Return a pair's fit or why there is none. curve: of a first fit, by which one view's instant is corrected."""
        self._work.take(detections)
        if curve is None:
            predicted = self._prediction.guess(t_ns, self._table, detections, self._work)
        else:
            predicted = self._prediction.again(t_ns, curve, self._table, detections, self._work)
        return solved(self._cameras, self._table, detections, self._work, radius_mm=self._radius, predicted=predicted)

    def _with_rims(self, t_ns: int, detections: list[Detection], result: _Result | None) -> _Result | None:
        """Return what the midlines gave, or None, where the whole silhouettes agree; else what those say."""
        well = good = possible = False
        if result is not None and not isinstance(result, str):
            solution = result[0]
            well, possible = self._silhouettes.explained(solution.fit, detections, self._work.arrays.balls)
            good = solution.doubtful is None and solution.sigma_mm <= RESOLVED_MM
            if well and good:
                return result
        if any(abs(each.t_ns - t_ns) > SKEW_NS for each in detections):
            return result
        expected = self._prediction.expected(t_ns)
        found = self._silhouettes.found(detections, self._work, expected, search=not (good and possible))
        if found is not None and well and result is not None and not isinstance(result, str):
            # both explain all that is seen: where they differ the tip is no surer than by how much
            off = found.fit.control[0] - result[0].fit.control[0]
            apart = float(np.sqrt(off @ off))
            found = found if apart <= _ALIKE_MM else replace(found, sigma_mm=max(found.sigma_mm, apart))
        if found is not None:
            return self._shaped(t_ns, detections, found)
        if result is None or isinstance(result, str) or possible:
            return result
        return "part of what is seen is not explained"

    def _shaped(
        self, t_ns: int, detections: list[Detection], solution: Solution
    ) -> tuple[Solution, FloatArray, float] | str:
        count = centreline(solution.fit.spans, solution.fit.control, self._radius, self._curve)
        return self._cut(t_ns, detections, solution, count)

    def _apart_ns(self, t_ns: int, detections: list[Detection]) -> int:
        """Return how far from the pair's instant a view's end was seen at most, ns."""
        apart = 0
        for shutter, each in zip(self._shutters, detections, strict=True):
            late_ns = 0 if each.tip_px is None else shutter.late_ns(float(each.tip_px[1]))
            apart = max(apart, abs(each.t_ns + late_ns - t_ns))
        return apart

    def _timing_mm(self, t_ns: int, end_box: FloatArray, skew_ns: int) -> float:
        """Return how unsure the tip is, mm, because it moves: (3,) mm, its rounded end's centre at an instant.

        A stamp is off by a fraction of a millisecond; one view's part in the tip is a half of what its instant's
        correction may be off.
        """
        speed, change = self._prediction.tip_motion(t_ns, end_box)
        skew_mm = 0.0
        if skew_ns > SKEW_NS:
            unsure = COAST_SPEED_MM_S if change is None else _CHANGE_SHARE * change + _STEADY_MM_S
            skew_mm = 0.5e-9 * skew_ns * min(unsure, COAST_SPEED_MM_S)
        return math.hypot(_STAMP_S * speed, skew_mm)


def _shutter(rig: Rig, camera: str) -> Shutter:
    """Return a camera's shutter: the picture's instant is its middle row's."""
    rows = rig.cameras[camera].size_px[1]
    readout_s = rig.timing.top_readout_s if camera == "top" else rig.timing.front_readout_s
    return Shutter(0.5 * (rows - 1), readout_s / max(rows - 1, 1))
