"""The curve expected from the last ones, and where on it each measured point is: the fit's start while tracking."""

from collections.abc import Sequence

import numpy as np
from numba import njit

from cathxr.core import Detection, FloatArray
from cathxr.geometry import CameraModel
from cathxr.tracking.fit import Guess, guess_of

_OLDEST_NS = 250_000_000
_STEADY_NS = 100_000_000
_FARTHEST_MM = 8.0
_POINTS = 100
_AHEAD = 30
"""How many points of the curve a measured point may be ahead of the one before: across a stretch that is not seen."""
_NEAR_WIDTHS = 1.5


class Prediction:
    """Remembers the last two fitted curves and carries their motion on."""

    def __init__(self) -> None:
        self._last: tuple[int, FloatArray] | None = None
        self._before: tuple[int, FloatArray] | None = None

    def reset(self) -> None:
        """Forget what came before."""
        self._last = self._before = None

    def learn(self, t_ns: int, curve: FloatArray) -> None:
        """Take over a fitted curve (N, 3) mm, the rounded end's centre first, the entry last."""
        self._before, self._last = self._last, (t_ns, _even(curve))

    def guess(self, t_ns: int, cameras: Sequence[CameraModel], detections: Sequence[Detection]) -> Guess | None:
        """Return the start of the fit at an instant; None where nothing recent is known or it fits nothing."""
        curve = self._curve(t_ns)
        if curve is None:
            return None
        starts_at = []
        for camera, each in zip(cameras, detections, strict=True):
            try:
                line = camera.project_with_jacobian(curve)[0]
            except ValueError:
                return None
            near = _NEAR_WIDTHS * 2.0 * each.half_width_px[0]
            starts_at.append(_places(line, each.curve_px, near))
        end = max(float(each.max(initial=0.0)) for each in starts_at)
        last = int(np.ceil(end * (_POINTS - 1)))
        if last < 3:
            return None
        share = (_POINTS - 1) / last
        return guess_of(curve[: last + 1], [np.where(each < 0.0, -1.0, each * share) for each in starts_at])

    def _curve(self, t_ns: int) -> FloatArray | None:
        if self._last is None or not 0 <= t_ns - self._last[0] <= _OLDEST_NS:
            return None
        then, curve = self._last
        if self._before is None or not 0 < then - self._before[0] <= _STEADY_NS:
            return curve
        motion = (curve - self._before[1]) * ((t_ns - then) / (then - self._before[0]))
        farthest = float(np.sqrt(np.square(motion).sum(axis=1).max()))
        return np.asarray(curve + motion * min(1.0, _FARTHEST_MM / max(farthest, 1e-9)), dtype=np.float64)


@njit(cache=True, nogil=True)
def _even(curve):  # type: ignore[no-untyped-def]
    """Return _POINTS points uniform in arc length along a curve (N, 3)."""
    along = np.zeros(len(curve))
    for i in range(1, len(curve)):
        along[i] = along[i - 1] + np.sqrt(((curve[i] - curve[i - 1]) ** 2).sum())
    result = np.empty((_POINTS, 3))
    j = 0
    for i in range(_POINTS):
        wanted = along[-1] * i / (_POINTS - 1)
        while j < len(curve) - 2 and along[j + 1] < wanted:
            j += 1
        share = min(max((wanted - along[j]) / max(along[j + 1] - along[j], 1e-12), 0.0), 1.0)
        result[i] = curve[j] + share * (curve[j + 1] - curve[j])
    return result


@njit(cache=True, nogil=True)
def _places(line, points, near):  # type: ignore[no-untyped-def]
    """Return where (N,) along a line (M, 2) px each of the points (N, 2) lies, 0 to 1; -1 where farther than `near`.

    The points follow the line: each is looked for from the one before on, so that a crossing misleads none.
    """
    count = len(line)
    result = np.full(len(points), -1.0)
    before = 0
    for i in range(len(points)):
        least = near * near
        for j in range(max(before - 2, 0), min(before + _AHEAD, count - 1)):
            dx, dy = line[j + 1, 0] - line[j, 0], line[j + 1, 1] - line[j, 1]
            px, py = points[i, 0] - line[j, 0], points[i, 1] - line[j, 1]
            share = min(max((px * dx + py * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
            off = (px - share * dx) ** 2 + (py - share * dy) ** 2
            if off < least:
                least = off
                result[i] = (j + share) / (count - 1)
        if result[i] >= 0.0:
            before = int(result[i] * (count - 1))
    return result
