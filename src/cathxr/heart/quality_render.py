"""Pictures of surfaces with light and depth, drawn without a graphics card: the same on every machine."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numba import njit

from cathxr.core import FloatArray

_SAMPLES = 2
"""Samples along each side of a pixel."""
_LAYERS = 8
"""How many see-through surfaces behind each other are drawn."""
_BACKGROUND = np.array([0.018, 0.022, 0.03])
_COARSER = 4
"""The broad shade of hollows is found on a picture this many times coarser."""
_NOTHING = np.float32(1e9)
_SAME_MM = 0.05
"""Two surfaces nearer to each other along the view than this are drawn once."""

Single = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Body:
    """What is drawn. vertices_mm, normals (N, 3) in `ct`, triangles (M, 3), colour "#rrggbb", opacity 0 to 1."""

    vertices_mm: FloatArray
    normals: FloatArray
    triangles: npt.NDArray[np.int64]
    colour: str
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection. axes (3, 3): rows are right, up and towards the eye in `ct`. centre_mm (3,), mm_per_px."""

    axes: FloatArray
    centre_mm: FloatArray
    mm_per_px: float
    size_px: tuple[int, int]

    def project(self, points_mm: FloatArray) -> FloatArray:
        """Return x, y in pixels (the picture's first pixel's centre is 0, 0) and the depth in mm, (N, 3)."""
        seen = (points_mm - self.centre_mm) @ self.axes.T
        width, height = self.size_px
        return np.stack(
            [
                (width - 1) / 2.0 + seen[:, 0] / self.mm_per_px,
                (height - 1) / 2.0 - seen[:, 1] / self.mm_per_px,
                -seen[:, 2],
            ],
            axis=1,
        )


VIEWS = {
    "front": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "back": np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]]),
    "left": np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "right": np.array([[0.0, -1, 0], [0, 0, 1], [-1, 0, 0]]),
}
"""Camera axes by the side of the patient that it looks from."""


def framed(view: str, points_mm: FloatArray, size_px: tuple[int, int], *, margin: float = 0.06) -> Camera:
    """Return the camera of a view that shows all points (N, 3)."""
    axes = VIEWS[view]
    seen = points_mm @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = (1.0 - 2.0 * margin) * np.array(size_px)
    return Camera(axes, axes.T @ ((low + high) / 2.0), float(((high - low)[:2] / room).max()), size_px)


def rendered(bodies: Sequence[Body], camera: Camera) -> npt.NDArray[np.uint8]:
    """Return the picture (H, W, 3) RGB of the bodies; what is behind a see-through one shows through it."""
    width, height = (each * _SAMPLES for each in camera.size_px)
    fine = Camera(camera.axes, camera.centre_mm, camera.mm_per_px / _SAMPLES, (width, height))
    scene = _scene(bodies, fine)
    light = np.zeros((height, width, 3), np.float32)
    passing = np.ones((height, width), np.float32)
    behind = np.full((height, width), -_NOTHING, np.float32)
    for layer in range(_LAYERS):
        depth, body, normal = _nearest(*scene, behind)
        hit = body >= 0
        if not hit.any():
            break
        colour = np.array([_linear(each.colour) for each in bodies], np.float32)[body]
        alpha = np.array([each.opacity for each in bodies], np.float32)[body]
        facing = np.abs(normal[..., 2])
        # A wall that is seen edge-on is a longer way through it.
        alpha = np.where(alpha < 0.985, 1.0 - (1.0 - alpha) ** (1.0 / np.maximum(facing, 0.2)), 1.0)
        shade = _shaded(colour, normal)
        if layer == 0:
            shade *= _hollows(depth, hit, 1.0 / fine.mm_per_px)[..., None]
        weight = np.where(hit, passing * alpha, 0.0)
        light += weight[..., None] * shade
        passing *= np.where(hit, 1.0 - alpha, 1.0)
        if not (hit & (passing > 0.01)).any():
            break
        behind = np.where(hit & (passing > 0.01), depth + np.float32(_SAME_MM), _NOTHING)
    light += passing[..., None] * _BACKGROUND
    coarse = light.reshape(camera.size_px[1], _SAMPLES, camera.size_px[0], _SAMPLES, 3).mean(axis=(1, 3))
    coded: FloatArray = np.where(
        coarse <= 0.0031308, 12.92 * coarse, 1.055 * np.maximum(coarse, 1e-6) ** (1 / 2.4) - 0.055
    )
    return np.asarray(np.clip(coded * 255.0 + 0.5, 0, 255).astype(np.uint8))


def png(figure: Figure) -> bytes:
    """Return a figure as a PNG file's bytes, without the library's name and version."""
    out = io.BytesIO()
    figure.set_canvas(FigureCanvasAgg(figure))
    figure.savefig(out, format="png", facecolor=figure.get_facecolor(), metadata={"Software": None})
    return out.getvalue()


def _scene(
    bodies: Sequence[Body], camera: Camera
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return all bodies as one: corners in pixels, normals in the camera's axes, triangles, the body of each."""
    starts = np.cumsum([0, *(len(each.vertices_mm) for each in bodies[:-1])])
    return (
        np.concatenate([camera.project(each.vertices_mm) for each in bodies]),
        np.concatenate([each.normals @ camera.axes.T for each in bodies]),
        np.concatenate([each.triangles + start for each, start in zip(bodies, starts, strict=True)]),
        np.repeat(np.arange(len(bodies)), [len(each.triangles) for each in bodies]),
    )


def _shaded(colour: Single, normal: Single) -> Single:
    """Return the light (H, W, 3) that comes back: a key light from the upper left, a fill, the sky, a little gloss."""
    towards = normal * np.where(normal[..., 2:] < 0.0, np.float32(-1.0), np.float32(1.0))
    key, fill = _unit([-0.45, 0.6, 0.75]), _unit([0.7, -0.1, 0.5])
    diffuse = 0.85 * np.maximum(towards @ key, 0.0) + 0.22 * np.maximum(towards @ fill, 0.0)
    sky = 0.16 + 0.1 * (0.5 + 0.5 * towards[..., 1])
    half = _unit([-0.25, 0.35, 0.95])
    gloss = 0.14 * np.maximum(towards @ half, 0.0) ** 40
    return np.asarray(colour * (diffuse + sky)[..., None] + gloss[..., None], np.float32)


def _hollows(depth: Single, hit: npt.NDArray[np.bool_], px_per_mm: float) -> FloatArray:
    """Return a darkening (H, W) of what lies deeper than what is around it.

    Luft, Colditz and Deussen, "Image enhancement by unsharp masking the depth buffer", SIGGRAPH 2006.
    """
    height, width = depth.shape
    small = (max(width // _COARSER, 1), max(height // _COARSER, 1))
    filled = cv2.resize(np.where(hit, depth, np.float32(0.0)), small, interpolation=cv2.INTER_AREA)
    weight = cv2.resize(hit.astype(np.float32), small, interpolation=cv2.INTER_AREA)
    dark: npt.NDArray[Any] = np.zeros(depth.shape, np.float32)
    for radius_mm, strength in ((2.5, 0.10), (8.0, 0.045)):
        sigma = max(radius_mm * px_per_mm / _COARSER, 0.5)
        near = cv2.GaussianBlur(weight, (0, 0), sigma)
        around: npt.NDArray[Any] = cv2.GaussianBlur(filled, (0, 0), sigma) / np.maximum(near, 1e-3)
        around = cv2.resize(around, (width, height), interpolation=cv2.INTER_LINEAR)
        dark += np.float32(strength) * np.maximum(depth - around, 0.0) * hit
    return np.asarray(1.0 / (1.0 + dark))


def _linear(colour: str) -> FloatArray:
    coded = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255.0
    return np.asarray(np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4))


def _unit(vector: Sequence[float]) -> Single:
    return np.asarray(np.array(vector) / np.linalg.norm(vector), np.float32)


@njit(cache=True, nogil=True)
def _nearest(
    corners: FloatArray,
    normals: FloatArray,
    triangles: npt.NDArray[np.int64],
    owner: npt.NDArray[np.int64],
    behind: Single,
) -> tuple[Single, npt.NDArray[np.int64], Single]:  # pragma: no cover - compiled
    """Return depth (H, W), body (-1: none) and normal (H, W, 3) of what is nearest beyond `behind`."""
    height, width = behind.shape
    depth = np.full((height, width), np.float32(1e9), np.float32)
    body = np.full((height, width), -1, np.int64)
    normal = np.zeros((height, width, 3), np.float32)
    for index in range(len(triangles)):
        ia, ib, ic = triangles[index]
        ax, ay, az = corners[ia]
        bx, by, bz = corners[ib]
        cx, cy, cz = corners[ic]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-12:
            continue
        first = max(int(np.ceil(min(ax, bx, cx))), 0)
        last = min(int(np.floor(max(ax, bx, cx))), width - 1)
        top = max(int(np.ceil(min(ay, by, cy))), 0)
        bottom = min(int(np.floor(max(ay, by, cy))), height - 1)
        for y in range(top, bottom + 1):
            for x in range(first, last + 1):
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                w = 1.0 - u - v
                if u < -1e-9 or v < -1e-9 or w < -1e-9:
                    continue
                z = np.float32(u * az + v * bz + w * cz)
                if z > behind[y, x] and z < depth[y, x]:
                    depth[y, x] = z
                    body[y, x] = owner[index]
                    nx = u * normals[ia, 0] + v * normals[ib, 0] + w * normals[ic, 0]
                    ny = u * normals[ia, 1] + v * normals[ib, 1] + w * normals[ic, 1]
                    nz = u * normals[ia, 2] + v * normals[ib, 2] + w * normals[ic, 2]
                    size = np.sqrt(nx * nx + ny * ny + nz * nz) + 1e-12
                    normal[y, x, 0], normal[y, x, 1], normal[y, x, 2] = nx / size, ny / size, nz / size
    return depth, body, normal
