"""Measuring a catheter where the last Tracks say it is: only pixels near the predicted curve are read."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cathxr.core import FloatArray, Rig, Status, Track
from cathxr.geometry import CameraModel
from cathxr.vision.midline import Midline, midline_of
from cathxr.vision.midline_kernels import normals_of
from cathxr.vision.near_kernels import end_near, medians, sections_near
from cathxr.vision.profiles import RawSource, light_gain

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
_PARTS_RADII = 6.0
"""What is farther than this along the tube is another part of it."""
_NEAR_SECTIONS = 8
_LEAST_OUTLINE = 7
_RATIO = (0.7, 1.4)
_UNSEEN_PX = 1e3
"""The sigma of an end that is not seen: it has no part in anything."""
_GAIN = (0.6, 1.6)


@dataclass(frozen=True, eq=False)
class Look:
    """How the catheter looked last: matte level on it, and its apparent width over the expected one."""

    plateau: float
    ratio: float


@dataclass(frozen=True, eq=False)
class _Expected:
    """Where the catheter should be seen: tip (2,), path (K, 2) from the rounded end's centre on, widths (K,), all px.

    shares (K,): see `sections_near`. alone: no other part of the catheter lies at its end.
    """

    tip: FloatArray
    path: FloatArray
    widths: FloatArray
    shares: FloatArray
    alone: bool


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

    def found(self, source: RawSource, t_ns: int, predicted: Track) -> tuple[Midline, bool] | None:
        """Return what is measured near the predicted curve and whether it is beyond doubt, None where there is little.

        predicted: the last Track; its motion is carried on from the one before to `t_ns`.
        """
        shape = self._moved(t_ns, predicted)
        look = self._look
        expected = None if shape is None or look is None else self._expected(shape, look.ratio)
        if expected is None or look is None:
            return None
        gain = light_gain(source, expected.path, normals_of(expected.path), 1.6 * float(expected.widths[0]))
        if not _GAIN[0] < gain < _GAIN[1]:
            return None
        source = (source[0], source[1], source[2], gain)
        measured = sections_near(source, expected.path, expected.widths, expected.shares, look.plateau)
        state = measured[3]
        good = state == 2
        count = int(np.count_nonzero(good))
        if count < _LEAST_SECTIONS:
            return None
        seen = int(np.flatnonzero(good)[-1]) + 1  # the inlet hides the rest
        if count < _LEAST_SHARE * np.count_nonzero(state[:seen]):
            return None
        return self._with_end(source, expected, measured)

    def _expected(self, shape: FloatArray, ratio: float) -> _Expected | None:
        """Return where and how wide a curve (K, 3) mm, tip first, should be seen; None where it leaves the picture."""
        line = _from_cap_centre(shape, self._radius_mm)
        try:
            points, jacobian = self._model.project_with_jacobian(np.vstack([shape[:1], line]))
        except ValueError:
            return None
        tip, path = points[0], np.ascontiguousarray(points[1:])
        scale = np.sqrt(0.5 * np.square(jacobian[1:]).sum(axis=(1, 2)))
        steps_mm = np.sqrt(np.square(np.diff(line, axis=0)).sum(axis=1))
        seen = np.hypot(*np.diff(path, axis=0).T) / np.maximum(steps_mm * 0.5 * (scale[1:] + scale[:-1]), 1e-9)
        shares = np.concatenate([seen[:1], np.minimum(seen[1:], seen[:-1]), seen[-1:]])
        widths = 2.0 * self._radius_mm * ratio * scale
        if not bool(self._model.inside(tip, margin_px=0.7 * widths[0])):
            return None
        apart_mm = np.concatenate([[0.0], np.cumsum(steps_mm)])
        near = np.hypot(*(path - path[0]).T) < 0.5 * _HIDDEN_RADII * widths[0]
        alone = not bool((near & (apart_mm > _PARTS_RADII * self._radius_mm)).any())
        return _Expected(tip, path, widths, shares, alone)

    def _with_end(
        self,
        source: RawSource,
        expected: _Expected,
        found: tuple[FloatArray, FloatArray, FloatArray, NDArray[np.int64]],
    ) -> tuple[Midline, bool] | None:
        """Return the midline with its end, and whether the end is beyond doubt."""
        measured, normal, sections, state = found
        good = np.flatnonzero(state == 2)
        path = expected.path
        middle = medians(sections[good])
        radius = 0.5 * float(medians(sections[good[:12]])[1])
        blur = float(np.clip(middle[2] / max(middle[3], 1e-6) / np.sqrt(2.0 * np.pi), 0.3, 0.5 * radius))
        ahead = expected.tip - path[0]
        if np.hypot(*ahead) < 0.2 * radius:  # it points at the camera: any direction does, best away from the tube
            ahead = path[0] - path[min(3, len(path) - 1)]
        direction = ahead / max(float(np.hypot(*ahead)), 1e-9)
        # the nearest sections say how far the end lies to the side of where it was expected
        start = path[0] + _aside(path, measured[good[0]]) if good[0] < _NEAR_SECTIONS else path[0]
        centre, outline, rms = end_near(source, start, direction, radius, middle[2], blur)
        from_centre = measured[good] - centre
        past = (from_centre @ direction > -0.25 * radius) & (np.hypot(*from_centre.T) < 2.0 * radius)
        good = good[~past]
        if len(good) < _LEAST_SECTIONS:
            return None
        line = midline_of(measured[good], normal[good], sections[good], centre, direction, radius, outline)
        if len(outline) < _LEAST_OUTLINE:
            line = line.without_end(_UNSEEN_PX)
        ratio = self._look.ratio if self._look is not None else 1.0
        ratio *= float(middle[1] / expected.widths[len(expected.widths) // 2])
        self._look = Look(float(middle[2]), min(max(ratio, _RATIO[0]), _RATIO[1]))
        return line, not expected.alone or 0.0 <= rms < _ROUND_PX + _ROUND_SHARE * radius

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


def _aside(path: FloatArray, point: FloatArray) -> FloatArray:
    """Return (2,) how far a point lies off a polyline (N, 2)."""
    step = np.diff(path, axis=0)
    share = np.clip(((point - path[:-1]) * step).sum(axis=1) / np.maximum((step * step).sum(axis=1), 1e-12), 0.0, 1.0)
    off = point - path[:-1] - share[:, None] * step
    return np.asarray(off[int(np.argmin((off * off).sum(axis=1)))], dtype=np.float64)
