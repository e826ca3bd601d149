"""One camera's picture of what never moves: the lit background, the opaque things before it, and their depth."""

import zlib
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from cathxr.core import FloatArray
from cathxr.geometry import CameraModel
from cathxr.twin.settings import TwinSettings
from cathxr.twin.static_scene import StaticScene

Float32 = NDArray[np.float32]
_SUPERSAMPLES = 5
_NOTHING = -1
_LED_TINT = (1.0, 0.985, 0.955)
_FULL_SCALE = 255.0


@dataclass(frozen=True, eq=False)
class StaticPicture:
    """level (H, W, 3): light, DN, without glare and black level; depth_mm (H, W), infinite where nothing is."""

    level: Float32
    depth_mm: Float32


def static_picture(
    model: CameraModel, rays: Float32, scene: StaticScene, settings: TwinSettings, *, seed: int
) -> StaticPicture:
    """Return the empty box as one camera sees it, blurred by its lens. rays: the camera's `lens.ray_table`."""
    width, height = model.size_px
    light = _back_light(width, height, settings, seed=seed)
    things = _in_camera(model, scene)
    which = np.full((height, width), _NOTHING, dtype=np.int32)
    depth = np.full((height, width), np.inf, dtype=np.float32)
    shade = np.zeros((height, width), dtype=np.float32)
    _trace(rays, things, which, depth, shade)
    colours = np.concatenate([scene.box_colour, scene.disc_colour, np.zeros((1, 3))])
    front = _FULL_SCALE * settings.front_light
    level = light.copy()
    solid = which != _NOTHING
    level[solid] = front * shade[solid, None] * colours[which[solid]]
    _soften(rays, things, which, colours * front, light, level)
    if settings.lens_blur_px > 0:
        level = np.asarray(cv2.GaussianBlur(level, (0, 0), settings.lens_blur_px), dtype=np.float32)
    return StaticPicture(np.ascontiguousarray(level), depth)


def glare_picture(width: int, height: int, settings: TwinSettings, *, seed: int) -> Float32:
    """Return (H, W) the level, DN, that reflections on the window add to everything."""
    rng = np.random.default_rng([seed, 0x61A5E])
    veil = np.zeros((height, width), dtype=np.float32)
    v, u = np.ogrid[0.0:height, 0.0:width]
    v, u = v.astype(np.float32), u.astype(np.float32)
    for _ in range(settings.glare_spots):
        centre = rng.uniform(0.15, 0.85, size=2) * (width, height)
        spread = width * rng.uniform(0.006, 0.022)
        stretch, lean = rng.uniform(0.5, 2.0), rng.uniform(0.0, np.pi)
        a = (u - centre[0]) * np.cos(lean) + (v - centre[1]) * np.sin(lean)
        b = (v - centre[1]) * np.cos(lean) - (u - centre[0]) * np.sin(lean)
        core = np.exp(-0.5 * ((a / stretch) ** 2 + (b * stretch) ** 2) / spread**2)
        halo = np.exp(-0.5 * (a**2 + b**2) / (4.0 * spread) ** 2)
        veil += (_FULL_SCALE * settings.glare_level * (1.4 * core + 0.15 * halo)).astype(np.float32)
    return veil


def _back_light(width: int, height: int, settings: TwinSettings, *, seed: int) -> Float32:
    """Return the bare background (H, W, 3), DN: a diffuser or a painted wall, with the lens's vignetting."""
    rng = np.random.default_rng([seed, zlib.crc32(settings.background.encode())])
    v, u = np.ogrid[0.0:height, 0.0:width]
    v, u = v.astype(np.float32), u.astype(np.float32)
    half = 0.5 * np.hypot(width, height)
    off = ((u - 0.5 * width) ** 2 + (v - 0.5 * height) ** 2) / half**2
    fall = 1.0 - settings.vignetting * off * (0.6 + 0.4 * off)
    slow = _uneven(rng, width, height) * settings.unevenness
    grain = 1.0 + np.float32(0.004) * rng.standard_normal((height, width), dtype=np.float32)
    if settings.background == "back_lit":
        level = settings.back_light * fall * (1.0 + slow) * grain
        colour = level[..., None] * np.array(_LED_TINT, dtype=np.float32)
    else:
        wall = np.array([0.42, 0.31, 0.14]) + 0.06 * np.stack(
            [_noise(rng, width, height, cells=4) for _ in range(3)], -1
        )
        patches = 0.05 * np.sign(_noise(rng, width, height, cells=6))[..., None] * np.array([0.3, 1.0, 0.6])
        colour = settings.front_light * (fall * (1.0 + slow) * grain)[..., None] * np.clip(wall + patches, 0.03, 1.0)
    return np.asarray(_FULL_SCALE * colour, dtype=np.float32)


def _uneven(rng: np.random.Generator, width: int, height: int) -> Float32:
    """Return a field (H, W) within ±1 that varies as slowly as a diffuser's light: a few long waves."""
    v, u = np.ogrid[0.0:height, 0.0:width]
    v, u = (v / width).astype(np.float32), (u / width).astype(np.float32)
    field = np.zeros((height, width), dtype=np.float32)
    for _ in range(5):
        way, length = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.7, 2.5)
        field += np.cos(2.0 * np.pi / length * (u * np.cos(way) + v * np.sin(way)) + rng.uniform(0.0, 2.0 * np.pi))
    field -= 0.5 * (field.max() + field.min())
    return np.asarray(field / np.abs(field).max(), dtype=np.float32)


def _noise(rng: np.random.Generator, width: int, height: int, *, cells: int) -> Float32:
    """Return a slowly varying field (H, W) within about ±1."""
    coarse = rng.uniform(-1.0, 1.0, size=(cells + 2, cells + 3)).astype(np.float32)
    return np.asarray(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC), dtype=np.float32)


def _in_camera(model: CameraModel, scene: StaticScene) -> tuple[FloatArray, ...]:
    """Return the scene's arrays in the camera's frame, as the kernels take them."""
    turn = model.camera_from_box.rotation
    return (
        model.to_camera(scene.box_centre),
        np.ascontiguousarray(turn @ scene.box_axes),
        scene.box_half,
        model.to_camera(scene.disc_centre),
        np.ascontiguousarray(scene.disc_normal @ turn.T),
        scene.disc_radius,
    )


@njit(cache=True, nogil=True)
def _first_hit(x, y, things):  # type: ignore[no-untyped-def]
    """Return which thing the ray (x, y, 1) hits first (-1: none), at what depth, and how squarely (0 to 1)."""
    centre, axes, half, discs, normals, radii = things
    best, depth, square = -1, np.inf, 0.0
    size = np.sqrt(x * x + y * y + 1.0)
    for k in range(centre.shape[0]):
        near, far, face = 0.0, np.inf, 0.0
        for j in range(3):
            way = axes[k, 0, j] * x + axes[k, 1, j] * y + axes[k, 2, j]
            off = axes[k, 0, j] * centre[k, 0] + axes[k, 1, j] * centre[k, 1] + axes[k, 2, j] * centre[k, 2]
            if abs(way) < 1e-12:
                if abs(off) > half[k, j]:
                    far = -1.0
                continue
            first, second = (off - half[k, j]) / way, (off + half[k, j]) / way
            if min(first, second) > near:
                near, face = min(first, second), abs(way) / size
            far = min(far, max(first, second))
        if near < far and near < depth and near > 0.0:
            best, depth, square = k, near, face
    for k in range(discs.shape[0]):
        way = normals[k, 0] * x + normals[k, 1] * y + normals[k, 2]
        if abs(way) < 1e-9:
            continue
        at = (normals[k, 0] * discs[k, 0] + normals[k, 1] * discs[k, 1] + normals[k, 2] * discs[k, 2]) / way
        dx, dy, dz = at * x - discs[k, 0], at * y - discs[k, 1], at - discs[k, 2]
        if 0.0 < at <= depth + 0.01 and dx * dx + dy * dy + dz * dz <= radii[k] * radii[k]:
            best, depth, square = centre.shape[0] + k, at, abs(way) / size
    return best, depth, 0.35 + 0.65 * square


@njit(cache=True, nogil=True)
def _trace(rays, things, which, depth, shade):  # type: ignore[no-untyped-def]
    """Fill what each pixel's centre sees."""
    for row in range(which.shape[0]):
        for column in range(which.shape[1]):
            x, y = rays[row, column, 0], rays[row, column, 1]
            hit = _first_hit(x, y, things)
            which[row, column], depth[row, column], shade[row, column] = hit


@njit(cache=True, nogil=True)
def _soften(rays, things, which, colours, light, level):  # type: ignore[no-untyped-def]
    """Replace the pixels at the rims of things in level (H, W, 3) by the mean of many rays through each."""
    height, width = which.shape
    for row in range(1, height - 1):
        for column in range(1, width - 1):
            rim = False
            for r in range(row - 1, row + 2):
                for c in range(column - 1, column + 2):
                    rim = rim or which[r, c] != which[row, column]
            if not rim:
                continue
            across_x = 0.5 * (rays[row, column + 1, 0] - rays[row, column - 1, 0])
            across_y = 0.5 * (rays[row, column + 1, 1] - rays[row, column - 1, 1])
            down_x = 0.5 * (rays[row + 1, column, 0] - rays[row - 1, column, 0])
            down_y = 0.5 * (rays[row + 1, column, 1] - rays[row - 1, column, 1])
            level[row, column] = 0.0
            for i in range(_SUPERSAMPLES):
                for j in range(_SUPERSAMPLES):
                    du, dv = (i + 0.5) / _SUPERSAMPLES - 0.5, (j + 0.5) / _SUPERSAMPLES - 0.5
                    x = rays[row, column, 0] + du * across_x + dv * down_x
                    y = rays[row, column, 1] + du * across_y + dv * down_y
                    best, _, square = _first_hit(x, y, things)
                    for k in range(3):
                        seen = light[row, column, k] if best < 0 else colours[best, k] * square
                        level[row, column, k] += seen / (_SUPERSAMPLES * _SUPERSAMPLES)
