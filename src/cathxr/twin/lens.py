"""What one lens does to rays: the table of every pixel's viewing direction, and the projection inside the hot loops."""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from cathxr.core import FloatArray
from cathxr.geometry import CameraModel

_GRID_PX = 16.0


def ray_table(model: CameraModel) -> NDArray[np.float32]:
    """Return (H, W, 2): the ideal normalised coordinates (x/z, y/z) of every pixel's centre.

    Undistorted exactly on a grid of about 16 px and spline-interpolated between: lens distortion is so smooth that this
    costs less than a thousandth of a pixel, at a hundredth of the work.
    """
    width, height = model.size_px
    u = np.linspace(0.0, width - 1.0, int(np.ceil(width / _GRID_PX)) + 1)
    v = np.linspace(0.0, height - 1.0, int(np.ceil(height / _GRID_PX)) + 1)
    exact = model.undistort(np.stack(np.meshgrid(u, v), axis=-1))
    table = np.empty((height, width, 2), dtype=np.float32)
    for axis in range(2):
        table[..., axis] = RectBivariateSpline(v, u, exact[..., axis])(np.arange(height), np.arange(width))
    return table


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
