"""The `model` method: two measured midlines in, one catheter in space out."""

import numpy as np

from cathxr.core import Detection, FloatArray, Observation, Rig, Status, Track
from cathxr.geometry import CameraModel, nearest_to_rays, resampled, tip_pose
from cathxr.geometry.calibration_error import camera_errors, point_covariance
from cathxr.geometry.roll import tip_roll_rad
from cathxr.tracking.continuity import Continuity, missing_reason
from cathxr.tracking.fit import CurveFit, camera_table, fit_curve
from cathxr.tracking.matching import match, ray_distances

_DENSE = 240
_HIDDEN_MM = 25.0
"""How much of the catheter's beginning may be hidden by the inlet before the entry is a guess too far."""
_ALIGNED = 0.25
"""Least cosine between the beginning's direction and the insertion axis for extrapolating the entry."""
_LONGEST_FOLD_MM = 5.0
_MATCH_SIGMA_MM = 0.25
_CORRELATION = 1.1
"""Neighbouring profiles share pixels and blur, so they are not quite independent: a factor on the pictures' part of
sigma. With it, and no calibration error, error / sigma is about 0.8 on the twin's smooth, noisy and faint scenes."""


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

    def reset(self) -> None:
        """Forget what came before."""
        self._continuity.reset()

    def update(self, observation: Observation) -> Track:
        """Return the Track of one observation."""
        missing = missing_reason(observation)
        if missing is not None:
            return self._continuity.coasting(observation, missing)
        found = [observation.detection(name) for name in self._names]
        detections = [each for each in found if each is not None]
        if len(detections) < len(self._names):
            return self._continuity.lost(observation, "no picture from one camera")
        for each in detections:
            if each.reason is not None:
                return self._continuity.lost(observation, f"{each.reason} ({each.camera})")
        result = self._solved(detections)
        if isinstance(result, str):
            return self._continuity.lost(observation, result)
        shape, sigma = result
        roll = observation.roll_rad
        turn = tip_roll_rad(self._roll, shape_box=shape, roll_rad=roll)
        pose = tip_pose(shape, zero_direction=self._zero, roll_rad=turn)
        return self._continuity.tracked(
            Track(
                seq=observation.seq,
                t_ns=observation.t_ns,
                status=Status.TRACKED,
                shape_box=resampled(shape, self._points),
                box_from_tip=pose,
                roll_rad=roll,
                roll_predicted=observation.roll_predicted,
                sigma_mm=sigma,
            )
        )

    def _solved(self, detections: list[Detection]) -> tuple[FloatArray, float] | str:
        """Return the centreline (N, 3) mm, tip first, with sigma_mm, or why there is none."""
        try:
            rays = [camera.ray(each.curve_px) for camera, each in zip(self._cameras, detections, strict=True)]
        except ValueError:
            return "the catheter lies where the lens model does not hold"
        origins = [camera.centre_box for camera in self._cameras]
        distance = ray_distances(origins[0], rays[0], origins[1], rays[1])
        matching = match(distance, _MATCH_SIGMA_MM)
        pairs = matching.pairs
        if len(pairs) < 4:
            return "too little of the catheter is seen"
        start = nearest_to_rays(np.stack(origins), np.stack([rays[0][pairs[:, 0]], rays[1][pairs[:, 1]]]))
        if not self._in_front(start):
            return "the two views disagree"
        start, fraction = _thinned(start)
        starts_at = [_parameters(pairs[:, view], fraction, len(each.curve_px)) for view, each in enumerate(detections)]
        fit = fit_curve(self._table, detections, start, starts_at)
        width = 2.0 * min(float(np.median(each.half_width_px)) for each in detections)
        if (
            not np.isfinite(fit.control).all()
            or fit.rms_px > max(2.0, 0.3 * width)
            or fit.tip_gap_px > max(4.0, 0.6 * width)
        ):
            return f"the two views disagree by {min(max(fit.rms_px, fit.tip_gap_px), 9999.0):.1f} px"
        shape = self._shape(fit)
        if isinstance(shape, str):
            return shape
        return shape, self._sigma_mm(fit)

    def _in_front(self, points: FloatArray) -> bool:
        return all(bool((camera.to_camera(points)[:, 2] > 1.0).all()) for camera in self._cameras)

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
            if dense[-1, 0] > _HIDDEN_MM or direction[0] > -_ALIGNED:
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

    def _sigma_mm(self, fit: CurveFit) -> float:
        """Return the root of the trace of the tip's covariance: pictures, prior and calibration."""
        zero = np.zeros(1)
        value, slope = fit.basis.values(zero)[0], fit.basis.slopes(zero)[0]
        velocity = slope @ fit.control
        speed = float(np.linalg.norm(velocity))
        tangent = velocity / speed
        turn = -(self._radius / speed) * (np.eye(3) - np.outer(tangent, tangent))
        gain = np.kron(value, np.eye(3)) + np.kron(slope, turn)
        pictures = fit.covariance_of(gain) * _CORRELATION**2
        calibration = point_covariance(self._errors, value @ fit.control)
        return float(np.sqrt(np.trace(pictures) + np.trace(calibration)))


def _thinned(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (points without coincident neighbours, arc fraction of every given point), smoothed over neighbours.

    A matching on a pixel grid zigzags by a sample; a mean over five removes that before lengths are measured.
    """
    kernel = np.ones(5) / 5.0
    padded = np.vstack([2 * points[0] - points[2:0:-1], points, 2 * points[-1] - points[-2:-4:-1]])
    smooth = np.stack([np.convolve(padded[:, axis], kernel, mode="valid") for axis in range(3)], axis=1)
    steps = np.maximum(np.linalg.norm(np.diff(smooth, axis=0), axis=1), 1e-6)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    keep = np.concatenate([[True], steps > 1e-3])
    return smooth[keep], along / along[-1]


def _parameters(indices: np.ndarray[tuple[int], np.dtype[np.int64]], fraction: FloatArray, count: int) -> FloatArray:
    """Return the mean arc fraction (count,) of each measured point of a view, -1 where the matching leaves it out."""
    total = np.bincount(indices, weights=fraction, minlength=count)
    times = np.bincount(indices, minlength=count)
    return np.where(times > 0, total / np.maximum(times, 1), -1.0)


def _unfolded(dense: FloatArray) -> FloatArray:
    """Return the curve (M, 3) without what turns back at its beginning, where the two views see it begin elsewhere.

    Such a fold is short and moves nothing else, but a frame carried around it would arrive upside down. As much again
    before it goes too: that is the way into the fold.
    """
    steps = np.diff(dense, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    forwards = steps[:, 0] < -_ALIGNED * lengths
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
