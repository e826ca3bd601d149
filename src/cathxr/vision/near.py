"""Measuring a catheter where the last Tracks say it is: only pixels near the predicted curve are read."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray, Rig, Status, Track
from cathxr.geometry import CameraModel
from cathxr.geometry.camera_kernels import project_row
from cathxr.geometry.curve_kernels import carry_on
from cathxr.vision.midline import LEAST_OUTLINE_PX, LEAST_SIGMA_PX, Midline
from cathxr.vision.near_end import FOUND, measure
from cathxr.vision.near_work import MOST_TRACK_POINTS, near_work
from cathxr.vision.raw import RawSource

_OLDEST_NS = 250_000_000
"""A catheter is not looked for where it was longer ago than this."""
_MOST_UNSURE_MM = 4.0
"""Nor where the last pairs were not tracked, and it may have moved by more than this: something else may lie there."""
_STEADY_NS = 100_000_000
"""Two Tracks no farther apart than this give a velocity."""
_FARTHEST_MM = 8.0
_LEAST_OUTLINE = 7
_RATIO = (0.7, 1.4)
_UNSEEN_PX = 1e3
"""The sigma of an end that is not seen: it has no part in anything."""


@dataclass(frozen=True, eq=False)
class Look:
    """How the catheter looked last: matte level on it, and its apparent width over the expected one."""

    plateau: float
    ratio: float


class NearDetector:
    """Follows one catheter in one camera's pictures. Keeps its work arrays: one thread at a time."""

    def __init__(self, rig: Rig, model: CameraModel) -> None:
        self._camera = model.numbers
        self._size = (float(model.size_px[0]), float(model.size_px[1]))
        self._radius_mm = 0.5 * rig.catheter.diameter_mm
        self._tracks: tuple[Track | None, Track | None] = (None, None)
        self._look: Look | None = None
        self._work = near_work()

    def reset(self) -> None:
        """Forget what came before."""
        self._tracks = (None, None)
        self._look = None

    def learn(self, line: Midline) -> None:
        """Take over how a catheter that was found in the whole picture looks."""
        self._look = Look(line.plateau, 1.0)

    def path(self, t_ns: int, predicted: Track) -> FloatArray | None:
        """Return where the predicted curve is seen at an instant, (N, 2) px, None where there is none to follow.

        The array is the next one's.
        """
        count = self._moved(t_ns, predicted)
        if count < 2 or self._look is None:
            return None
        path = self._work.path
        for i in range(count):
            x, y, z = self._work.shape[i]
            path[i, 0], path[i, 1], _, _, depth = project_row(x, y, z, self._camera)
            if depth <= 0.0:
                return None
        return path[:count]

    def found(self, source: RawSource, t_ns: int, predicted: Track) -> tuple[Midline, bool] | None:
        """Return what is measured near the predicted curve and whether it is beyond doubt, None where there is little.

        predicted: the last Track; its motion is carried on from the one before to `t_ns`. The arrays of the Midline are
        those of the next one too.
        """
        count, look = self._moved(t_ns, predicted), self._look
        if count < 2 or look is None:
            return None
        code, points, outlined, sigma, tip_u, tip_v, plateau, ratio, sure = measure(
            source, count, self._radius_mm, look.ratio, look.plateau, self._camera, self._size, self._work
        )
        if code != FOUND:
            return None
        self._look = Look(plateau, min(max(ratio, _RATIO[0]), _RATIO[1]))
        work = self._work
        tip_sigma = LEAST_SIGMA_PX
        if outlined < _LEAST_OUTLINE:
            outlined, tip_sigma = 0, _UNSEEN_PX
            work.curve_sigma[0] = _UNSEEN_PX
        line = Midline(
            curve_px=work.curve[:points],
            normal_px=work.curve_normal[:points],
            sigma_px=work.curve_sigma[:points],
            half_width_px=work.half_width[:points],
            tip_px=np.array([tip_u, tip_v]),
            tip_sigma_px=tip_sigma,
            end_px=work.outline[:outlined],
            end_sigma_px=np.full(outlined, max(LEAST_OUTLINE_PX, 2.0 * sigma)),
            plateau=plateau,
        )
        return line, sure

    def _moved(self, t_ns: int, predicted: Track) -> int:
        """Set the shape expected at an instant, tip first; return its points, 0 where the last Track is too old."""
        if self._tracks[1] is not predicted:
            self._tracks = (self._tracks[1], predicted)
        before, shape = self._tracks[0], predicted.shape_box
        age_ns = t_ns - predicted.t_ns
        if shape is None or predicted.status is Status.LOST or not 0 <= age_ns <= _OLDEST_NS:
            return 0
        if predicted.status is Status.COASTING and not (predicted.sigma_mm or 0.0) < _MOST_UNSURE_MM:
            return 0
        if len(shape) > MOST_TRACK_POINTS:
            return 0
        earlier, ahead = shape, 0.0
        if before is not None and before.shape_box is not None and before.shape_box.shape == shape.shape:
            apart_ns = predicted.t_ns - before.t_ns
            if 0 < apart_ns <= _STEADY_NS:
                earlier, ahead = before.shape_box, age_ns / apart_ns
        carry_on(_readable(shape), _readable(earlier), ahead, _FARTHEST_MM, self._work.shape)
        return len(shape)


def _readable(shape: FloatArray) -> FloatArray:
    """Return a Track's shape as compiled code takes it: it checks no bounds, and rows must be whole."""
    return shape if shape.flags.c_contiguous else np.ascontiguousarray(shape)
