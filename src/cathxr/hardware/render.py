"""Pictures of solids for the manual: parallel projection, one light, drawn edges, names beside. No graphics card."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from cathxr.core import FloatArray, PixelArray
from cathxr.hardware.labels import with_labels

_FINER = 2
_MARGIN = 0.04
_LIGHT = np.array([0.35, 0.55, 0.76])
_PAPER = 255
_CREASE = 0.82
"""The cosine of the angle, 35 degrees, from which two faces meet in an edge."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """One body to draw: triangles (F, 3, 3) mm, its colour, red green blue 0 to 1.

    label: its name beside; several may share one.
    """

    triangles: FloatArray
    colour: tuple[float, float, float]
    label: str = ""


def view_axes(towards: Sequence[float], up: Sequence[float] = (0.0, 0.0, 1.0)) -> FloatArray:
    """Return the picture's axes (3, 3) as rows: right, up, towards the eye. towards: from the thing to the eye."""
    eye = np.array(towards, dtype=np.float64) / np.linalg.norm(towards)
    right = np.cross(up, eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def picture(bodies: Sequence[Drawn], axes: FloatArray, *, width_px: int = 1100, height_px: int = 800) -> PixelArray:
    """Return a picture (H, W, 3) BGR of bodies that fill it."""
    seen = [each.triangles @ axes.T for each in bodies]
    points = np.concatenate([each.reshape(-1, 3) for each in seen])
    low, high = points.min(axis=0), points.max(axis=0)
    wide, tall = width_px * _FINER, height_px * _FINER
    scale = float(((1.0 - 2.0 * _MARGIN) * np.array([wide, tall]) / (high - low)[:2]).min())
    middle = 0.5 * (low + high)
    depth = np.full((tall, wide), -np.inf)
    which = np.full((tall, wide), -1, dtype=np.int32)
    normals = np.zeros((tall, wide, 3), dtype=np.float32)
    for index, triangles in enumerate(seen):
        flat = np.ascontiguousarray((triangles - middle) * scale)
        flat[..., 0] += 0.5 * wide
        flat[..., 1] = 0.5 * tall - flat[..., 1]
        facing = smooth_normals(triangles)
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        kept = normal[:, 2] > 1e-12
        _fill(flat[kept], facing[kept], index, depth, which, normals)
    level = _shaded(bodies, which, normals, depth, scale)
    if not any(each.label for each in bodies):
        return level
    small = which[::_FINER, ::_FINER]
    # Of several with one name, the one of which most is seen bears it.
    seen_px = np.bincount(small[small >= 0], minlength=len(bodies))
    chosen: dict[str, int] = {}
    for index, each in enumerate(bodies):
        if each.label and (each.label not in chosen or seen_px[index] > seen_px[chosen[each.label]]):
            chosen[each.label] = index
    return with_labels(level, {label: small == index for label, index in chosen.items()})


def smooth_normals(triangles: FloatArray) -> FloatArray:
    """Return normals (F, 3, 3) at the corners of triangles: round where neighbours bend little, sharp at edges."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(length, 1e-12)[:, None]
    keys = np.rint(triangles.reshape(-1, 3) * 1e3).astype(np.int64)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(group, kind="stable")
    ends = np.cumsum(np.bincount(group))
    return np.asarray(_smoothed(unit, length, order, ends).reshape(-1, 3, 3), dtype=np.float64)


@njit(cache=True, nogil=True)
def _smoothed(unit, weight, order, ends):  # type: ignore[no-untyped-def]
    """Return the mean normal at every corner, of the faces there that bend by less than the crease."""
    found = np.zeros((order.shape[0], 3))
    start = 0
    for end in ends:
        for i in range(start, end):
            corner = order[i]
            own = corner // 3
            for j in range(start, end):
                other = order[j] // 3
                dot = unit[own, 0] * unit[other, 0] + unit[own, 1] * unit[other, 1] + unit[own, 2] * unit[other, 2]
                if dot > _CREASE:
                    for k in range(3):
                        found[corner, k] += weight[other] * unit[other, k]
            length = np.sqrt((found[corner] ** 2).sum())
            for k in range(3):
                found[corner, k] = found[corner, k] / length if length > 1e-12 else unit[own, k]
        start = end
    return found


@njit(cache=True, nogil=True)
def _fill(triangles, facing, index, depth, which, normals):  # type: ignore[no-untyped-def]
    """Draw triangles (F, 3, 3), px and depth, over what is there; greater depth is nearer."""
    tall, wide = depth.shape
    for f in range(triangles.shape[0]):
        ax, ay, az = triangles[f, 0]
        bx, by, bz = triangles[f, 1]
        cx, cy, cz = triangles[f, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        left, right = max(0, int(min(ax, bx, cx))), min(wide - 1, int(max(ax, bx, cx)) + 1)
        top, bottom = max(0, int(min(ay, by, cy))), min(tall - 1, int(max(ay, by, cy)) + 1)
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                v = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                w = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                if v < 0.0 or w < 0.0 or v + w > 1.0:
                    continue
                z = az + v * (bz - az) + w * (cz - az)
                if z > depth[y, x]:
                    depth[y, x] = z
                    which[y, x] = index
                    for k in range(3):
                        first, second, third = facing[f, 0, k], facing[f, 1, k], facing[f, 2, k]
                        normals[y, x, k] = (1.0 - v - w) * first + v * second + w * third


def _shaded(
    bodies: Sequence[Drawn],
    which: NDArray[np.int32],
    normals: NDArray[np.float32],
    depth: FloatArray,
    scale: float,
) -> PixelArray:
    """Return the picture from its buffers: shades, and dark lines where body, direction or depth change."""
    light = _LIGHT / np.linalg.norm(_LIGHT)
    shade = 0.42 + 0.58 * np.clip(normals @ light.astype(np.float32), 0.0, 1.0)
    # Black things would be a black blot: everything is lifted a little, so that its edges can be seen.
    colours = np.array([[0.22 + 0.76 * part for part in each.colour[::-1]] for each in bodies] + [[1.0, 1.0, 1.0]])
    level = colours[which] * shade[..., None] * 255.0
    level[which < 0] = _PAPER
    edge = np.zeros(which.shape, dtype=bool)
    for axis in (0, 1):
        other = np.roll(which, 1, axis=axis)
        bent = (normals * np.roll(normals, 1, axis=axis)).sum(axis=2) < 0.9
        with np.errstate(invalid="ignore"):
            step = np.abs(depth - np.roll(depth, 1, axis=axis)) > 2.5 * scale
        inside = (which >= 0) & (other >= 0)
        edge |= (which != other) | (inside & (bent | step))
    level[edge] *= 0.25
    small = cv2.resize(level.astype(np.float32), None, fx=1 / _FINER, fy=1 / _FINER, interpolation=cv2.INTER_AREA)
    return np.asarray(np.clip(small, 0.0, 255.0), dtype=np.uint8)
