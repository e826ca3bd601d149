"""What one lens does to rays: the table of every pixel's viewing direction, and the projection inside the hot loops."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cathxr.core import FloatArray
from cathxr.geometry import CameraModel

_GRID_PX = 16.0


def ray_table(model: CameraModel) -> NDArray[np.float32]:
    """Return (H, W, 2): the ideal normalised coordinates (x/z, y/z) of every pixel's centre.

    Undistorted exactly on a grid of about 16 px and interpolated by cubics between: lens distortion is so smooth that
    this costs less than a thousandth of a pixel, at a hundredth of the work.
    """
    width, height = model.size_px
    u = np.linspace(0.0, width - 1.0, int(np.ceil(width / _GRID_PX)) + 1)
    v = np.linspace(0.0, height - 1.0, int(np.ceil(height / _GRID_PX)) + 1)
    exact = model.undistort(np.stack(np.meshgrid(u, v), axis=-1))
    table = np.empty((height, width, 2), dtype=np.float32)
    down, across = _cubic_weights(height, len(v)), _cubic_weights(width, len(u))
    for axis in range(2):
        table[..., axis] = down @ exact[..., axis] @ across.T
    return table


def _cubic_weights(count: int, nodes: int) -> FloatArray:
    """Return (count, nodes): what each of `nodes` even values weighs in the cubic through the four nearest.

    The first and last of `count` even places are nodes. Fewer than four nodes: a straight line between two.
    """
    at = np.linspace(0.0, nodes - 1.0, count)
    result = np.zeros((count, nodes))
    rows = np.arange(count)
    if nodes < 4:
        left = np.clip(at.astype(int), 0, nodes - 2)
        result[rows, left], result[rows, left + 1] = 1.0 - (at - left), at - left
        return result
    first = np.clip(at.astype(int) - 1, 0, nodes - 4)
    x = at - first
    for k in range(4):
        others = [j for j in range(4) if j != k]
        result[rows, first + k] = np.prod([(x - j) / (k - j) for j in others], axis=0)
    return result


def lens_numbers(model: CameraModel) -> FloatArray:
    """Return (9,): fx fy cx cy k1 k2 p1 p2 k3, as `project_point` takes them."""
    inner = model.intrinsics
    return np.concatenate([inner.focal_px, inner.centre_px, inner.distortion])


@njit(cache=True, nogil=True)
def project_point(x: float, y: float, z: float, lens: FloatArray) -> tuple[float, float]:
    """Return the raw pixel (u, v) of a point of the camera's frame, z > 0. The equations of `geometry.camera`."""
    a, b = x / z, y / z
    r2 = a * a + b * b
    radial = 1.0 + r2 * (lens[4] + r2 * (lens[5] + r2 * lens[8]))
    da = a * radial + 2.0 * lens[6] * a * b + lens[7] * (r2 + 2.0 * a * a)
    db = b * radial + lens[6] * (r2 + 2.0 * b * b) + 2.0 * lens[7] * a * b
    return lens[0] * da + lens[2], lens[1] * db + lens[3]
