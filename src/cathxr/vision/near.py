"""Measuring a catheter where the last Tracks say it is: only pixels near the predicted curve are read."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray, PixelArray, Rig, Status, Track
from cathxr.geometry import CameraModel
from cathxr.vision.midline import Midline, midline_of
from cathxr.vision.near_kernels import end_near, sections_near
from cathxr.vision.profiles import RawSource, light_gain
from cathxr.vision.segmentation import MatteArray

_OLDEST_NS = 250_000_000
"""A catheter is not looked for where it was longer ago than this."""
_STEADY_NS = 100_000_000
"""Two Tracks no farther apart than this give a velocity."""
_FARTHEST_MM = 8.0
_LEAST_SHARE = 0.75
"""So much of what should be seen must be: else the picture shows something else, and all of it is looked at."""
_LEAST_SECTIONS = 5
_ROUND_SHARE = 0.12
_ROUND_PX = 0.3
"""An end whose outline is off a circle by more than these, share of the radius and px, is looked at in full."""
_HIDDEN_RADII = 2.2
"""Nearer than this to another part of the catheter the end's outline is not the end's alone."""
_UNSEEN_PX = 1e3
"""The sigma of an end that is not seen: it has no part in anything."""
_GAIN = (0.6, 1.6)


@dataclass(frozen=True, eq=False)
class Look:
    """How the catheter looked last: matte level on it, and its apparent width over the expected one."""

    plateau: float
    ratio: float


class NearDetector:
    """Follows one catheter in one camera's pictures."""

    def __init__(self, rig: Rig, model: CameraModel) -> None:
        self._model = model
        self._radius_mm = 0.5 * rig.catheter.diameter_mm
        self._tracks: tuple[Track | None, Track | None] = (None, None)
        self._look: Look | None = None

    def reset(self) -> None:
        """Forget what came before."""
        self._tracks = (None, None)
        self._look = None

    def learn(self, line: Midline) -> None:
        """Take over how a catheter that was found in the whole picture looks."""
        self._look = Look(line.plateau, 1.0)

    def found(self, source: RawSource | MatteArray, t_ns: int, predicted: Track) -> tuple[Midline, bool] | None:
        """Return what is measured near the predicted curve and whether it is beyond doubt, None where there is little.

        predicted: the last Track; its motion is carried on from the one before to `t_ns`.
        """
        shape = self._moved(t_ns, predicted)
        if shape is None or self._look is None:
            return None
        line = _from_cap_centre(shape, self._radius_mm)
        try:
            points, jacobian = self._model.project_with_jacobian(np.vstack([shape[:1], line]))
        except ValueError:
            return None
        scale = np.linalg.norm(jacobian[1:], axis=(1, 2)) / np.sqrt(2.0)
        tip, path = points[0], np.ascontiguousarray(points[1:])
        look = self._look
        widths = 2.0 * self._radius_mm * look.ratio * scale
        if not bool(self._model.inside(tip, margin_px=0.7 * widths[0])):
            return None
        if isinstance(source, tuple):
            normals = _normals(path)
            gain = light_gain(source, path, normals, 1.6 * float(widths[0]), np.empty(2 * len(path)))
            if not _GAIN[0] < gain < _GAIN[1]:
                return None
            source = (source[0], source[1], source[2], gain)
        measured, normal, sections, state = sections_near(source, path, widths, look.plateau)
        good = state == 2
        count = int(np.count_nonzero(good))
        if count < _LEAST_SECTIONS:
            return None
        seen = int(np.flatnonzero(good)[-1]) + 1  # the inlet hides the rest
        if count < _LEAST_SHARE * np.count_nonzero(state[:seen]):
            return None
        return self._with_end(source, tip, path, widths, (measured, normal, sections, good))

    def _with_end(
        self,
        source: RawSource | MatteArray,
        tip: FloatArray,
        path: FloatArray,
        widths: FloatArray,
        found: tuple[FloatArray, FloatArray, FloatArray, np.ndarray[tuple[int], np.dtype[np.bool_]]],
    ) -> tuple[Midline, bool] | None:
        measured, normal, sections, good = found
        first = int(np.flatnonzero(good)[0])
        radius = 0.5 * float(np.median(sections[good, 1][:12]))
        plateau = float(np.median(sections[good, 2]))
        blur = float(np.clip(plateau / max(np.median(sections[good, 3]), 1e-6) / np.sqrt(2.0 * np.pi), 0.3, 0.5 * radius))
        ahead = tip - path[0]
        length = float(np.hypot(*ahead))
        if length < 0.2 * radius:  # it points at the camera: any direction does, best away from the tube
            ahead = path[0] - path[min(3, len(path) - 1)]
            length = float(np.hypot(*ahead))
        direction = ahead / max(length, 1e-9)
        behind = np.arange(len(path)) > 3.0 * len(path) * 2.0 * radius / max(_length(path), 1e-9)
        near = np.linalg.norm(path - path[0], axis=1) < _HIDDEN_RADII * radius
        alone = not bool((behind & near).any())
        start = path[0] + (measured[first] - _nearest(path, measured[first])) if first < 8 else path[0]
        centre, outline, rms = end_near(source, start, direction, radius, plateau, blur)
        round_ = 0.0 <= rms < _ROUND_PX + _ROUND_SHARE * radius
        good = good & (np.linalg.norm(measured - centre, axis=1) > 0.25 * radius)
        good &= ((measured - centre) @ direction < 0.0) | (np.arange(len(good)) * len(path) > 4 * len(good))
        if np.count_nonzero(good) < _LEAST_SECTIONS:
            return None
        seen = rms >= 0.0
        line = midline_of(
            measured[good], normal[good], sections[good], centre, direction, radius, outline if seen else outline[:0]
        )
        if not seen or len(outline) < 7:
            line = line.without_end(_UNSEEN_PX)
        expected = float(np.median(widths))
        self._look = Look(plateau, float(np.clip(self._look_ratio() * np.median(sections[good, 1]) / expected, 0.7, 1.4)))
        return line, round_ or not alone

    def _look_ratio(self) -> float:
        return 1.0 if self._look is None else self._look.ratio

    def _moved(self, t_ns: int, predicted: Track) -> FloatArray | None:
        """Return the shape (K, 3) mm expected at an instant, tip first, None where the last Track is too old."""
        if self._tracks[1] is not predicted:
            self._tracks = (self._tracks[1], predicted)
        before = self._tracks[0]
        age_ns = t_ns - predicted.t_ns
        if predicted.status is Status.LOST or predicted.shape_box is None or not 0 <= age_ns <= _OLDEST_NS:
            return None
        if before is None or before.shape_box is None or before.shape_box.shape != predicted.shape_box.shape:
            return predicted.shape_box
        apart_ns = predicted.t_ns - before.t_ns
        if not 0 < apart_ns <= _STEADY_NS:
            return predicted.shape_box
        motion = (predicted.shape_box - before.shape_box) * (age_ns / apart_ns)
        farthest = float(np.linalg.norm(motion, axis=1).max())
        return predicted.shape_box + motion * min(1.0, _FARTHEST_MM / max(farthest, 1e-9))


def _from_cap_centre(shape: FloatArray, radius_mm: float) -> FloatArray:
    """Return the curve (M, 3) from the rounded end's centre on, one radius behind the tip."""
    behind = np.linalg.norm(shape - shape[0], axis=1)
    after = int(np.argmax(behind > radius_mm)) if behind[-1] > radius_mm else len(shape) - 1
    share = (radius_mm - behind[after - 1]) / max(behind[after] - behind[after - 1], 1e-9)
    centre = shape[after - 1] + min(max(share, 0.0), 1.0) * (shape[after] - shape[after - 1])
    rest = shape[after:]
    if np.linalg.norm(rest[0] - centre) < 0.2 and len(rest) > 2:
        rest = rest[1:]
    return np.vstack([centre, rest])


def _normals(path: FloatArray) -> FloatArray:
    along = np.gradient(path, axis=0)
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    return np.stack([-along[:, 1], along[:, 0]], axis=1)


def _length(path: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def _nearest(path: FloatArray, point: FloatArray) -> FloatArray:
    """Return the point (2,) of a polyline nearest to `point`."""
    step = np.diff(path, axis=0)
    share = np.clip(((point - path[:-1]) * step).sum(axis=1) / np.maximum((step * step).sum(axis=1), 1e-12), 0.0, 1.0)
    feet = path[:-1] + share[:, None] * step
    return np.asarray(feet[int(np.argmin(np.linalg.norm(feet - point, axis=1)))], dtype=np.float64)
