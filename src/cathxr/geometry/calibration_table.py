"""What the calibration's errors add to a tip's sigma, worked out once over the region of interest."""

import math
from collections.abc import Sequence

import numpy as np
from numba import njit

from cathxr.core import FloatArray, Roi
from cathxr.geometry.calibration_error import CameraError, point_covariance, point_covariances

_STEP_MM = 6.0
_MARGIN_MM = 6.0


class CalibrationTable:
    """The root of the trace of `calibration_error.point_covariance` over a block: so smooth that a grid holds it.

    Between the grid's points, at most 6 mm apart, it is interpolated linearly; beyond the block it is worked out.
    """

    def __init__(self, errors: Sequence[CameraError], roi: Roi) -> None:
        self._errors = list(errors)
        self._low = roi.min_mm - _MARGIN_MM
        spans = np.maximum(1, np.ceil((roi.max_mm + _MARGIN_MM - self._low) / _STEP_MM).astype(int))
        self._step = (roi.max_mm + _MARGIN_MM - self._low) / spans
        axes = [self._low[k] + self._step[k] * np.arange(spans[k] + 1) for k in range(3)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        try:
            traces = np.trace(point_covariances(self._errors, grid), axis1=1, axis2=2)
            self._table: FloatArray = np.sqrt(traces).reshape(*(spans + 1))
        except ValueError:  # a camera inside the block: rare enough to have no table
            self._table = np.zeros((0, 0, 0))

    def sigma_mm(self, point_box: FloatArray) -> float:
        """Return the calibration's part of sigma, mm, at a point (3,) mm."""
        found = _between(self._table, self._low, self._step, point_box) if self._table.size else -1.0
        if found >= 0.0:
            return float(found)
        return math.sqrt(float(np.trace(point_covariance(self._errors, point_box))))


@njit(cache=True, nogil=True)
def _between(table, low, step, point):  # type: ignore[no-untyped-def]
    """Return the table's value at a point by linear interpolation along each axis; -1 beyond it."""
    x, y, z = (point[0] - low[0]) / step[0], (point[1] - low[1]) / step[1], (point[2] - low[2]) / step[2]
    nx, ny, nz = table.shape
    if not (0.0 <= x <= nx - 1.0 and 0.0 <= y <= ny - 1.0 and 0.0 <= z <= nz - 1.0):
        return -1.0
    i, j, k = min(int(x), nx - 2), min(int(y), ny - 2), min(int(z), nz - 2)
    total = 0.0
    for a in range(2):
        for b in range(2):
            for c in range(2):
                weight = (x - i if a else 1.0 - x + i) * (y - j if b else 1.0 - y + j) * (z - k if c else 1.0 - z + k)
                total += weight * table[i + a, j + b, k + c]
    return total
