"""One camera's picture of what never moves: the lit background, the opaque things before it, and their depth."""

import zlib
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.core import FloatArray
from cathxr.geometry import CameraModel
from cathxr.twin.settings import TwinSettings
from cathxr.twin.static_kernels import soften, trace
from cathxr.twin.things import StaticScene

Float32 = NDArray[np.float32]
_NOTHING = -1
LAMP = (-0.26, -0.34, -1.0)
"""Towards the front lamp, in the camera's frame: beside the lens, a little to the left of it and above."""
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
    cast = np.array(settings.cast)
    light = np.asarray(back_light(width, height, settings, seed=seed) * cast, dtype=np.float32)
    things = _in_camera(model, scene)
    which = np.full((height, width), _NOTHING, dtype=np.int32)
    depth = np.full((height, width), np.inf, dtype=np.float32)
    shade, shine = np.zeros((height, width), dtype=np.float32), np.zeros((height, width), dtype=np.float32)
    trace(rays, things, which, depth, shade, shine)
    front = _FULL_SCALE * settings.front_light * cast
    colours = np.concatenate([scene.box_colour, scene.disc_colour, scene.ball_colour]) * front
    gloss = _FULL_SCALE * settings.specular * cast
    lamp = front_lamp(width, height, settings, seed=seed)
    level = light.copy()
    solid = which != _NOTHING
    level[solid] = lamp[solid, None] * (shade[solid, None] * colours[which[solid]] + shine[solid, None] * gloss)
    soften(rays, things, which, colours, gloss, lamp, light, level)
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


def fall_off(width: int, height: int, settings: TwinSettings) -> Float32:
    """Return (H, W) the lens's vignetting: 1 in the middle, least in the corners."""
    v, u = np.ogrid[0.0:height, 0.0:width]
    v, u = v.astype(np.float32), u.astype(np.float32)
    half = 0.5 * np.hypot(width, height)
    off = ((u - 0.5 * width) ** 2 + (v - 0.5 * height) ** 2) / half**2
    return np.asarray(1.0 - settings.vignetting * off * (0.6 + 0.4 * off), dtype=np.float32)


def front_lamp(width: int, height: int, settings: TwinSettings, *, seed: int) -> Float32:
    """Return (H, W) the front light's share of its mean on what each pixel sees: slow variation, by seed."""
    if settings.front_unevenness <= 0.0:
        return np.ones((height, width), dtype=np.float32)
    slow = _uneven(np.random.default_rng([seed, 0x1A3B]), width, height)
    return np.asarray(1.0 + np.float32(settings.front_unevenness) * slow, dtype=np.float32)


def back_light(width: int, height: int, settings: TwinSettings, *, seed: int) -> Float32:
    """Return the bare background (H, W, 3), DN: a diffuser or a painted wall, with the lens's vignetting."""
    rng = np.random.default_rng([seed, zlib.crc32(settings.background.encode())])
    fall = fall_off(width, height, settings)
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
        lit = fall * (1.0 + slow) * grain * front_lamp(width, height, settings, seed=seed)
        colour = settings.front_light * lit[..., None] * np.clip(wall + patches, 0.03, 1.0)
    return np.asarray(_FULL_SCALE * colour, dtype=np.float32)


def _uneven(rng: np.random.Generator, width: int, height: int) -> Float32:
    """Return a field (H, W) within ±1 that varies as slowly as a diffuser's light: a few long waves."""
    v, u = np.arange(height) / width, np.arange(width) / width
    across, along = [], []
    for _ in range(5):
        way, length = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.7, 2.5)
        down = 2.0 * np.pi / length * np.sin(way) * v
        right = 2.0 * np.pi / length * np.cos(way) * u + rng.uniform(0.0, 2.0 * np.pi)
        # the cosine of the sum of both, which are functions of one coordinate each
        across += [np.cos(down), -np.sin(down)]
        along += [np.cos(right), np.sin(right)]
    field = np.stack(across, axis=1).astype(np.float32) @ np.stack(along).astype(np.float32)
    field -= 0.5 * (field.max() + field.min())
    return np.asarray(field / np.abs(field).max(), dtype=np.float32)


def _noise(rng: np.random.Generator, width: int, height: int, *, cells: int) -> Float32:
    """Return a slowly varying field (H, W) within about ±1."""
    coarse = rng.uniform(-1.0, 1.0, size=(cells + 2, cells + 3)).astype(np.float32)
    return np.asarray(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC), dtype=np.float32)


def _in_camera(model: CameraModel, scene: StaticScene) -> tuple[FloatArray, ...]:
    """Return the scene's arrays in the camera's frame, as the kernels take them."""
    turn = model.camera_from_box.rotation
    boxes, axes = model.to_camera(scene.box_centre), np.ascontiguousarray(turn @ scene.box_axes)
    discs, balls = model.to_camera(scene.disc_centre), model.to_camera(scene.ball_centre)
    signs = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3, indexing="ij"), axis=-1).reshape(8, 3)
    corners = boxes[:, None] + np.einsum("bij,bkj->bki", axes, signs * scene.box_half[:, None])
    # A ball lies in the block around it.
    around = np.concatenate([discs, balls])[:, None]
    radii = np.concatenate([scene.disc_radius, scene.ball_radius])
    corners = np.concatenate([corners, around + signs * radii[:, None, None]])
    lamp = np.array(LAMP) / np.linalg.norm(LAMP)
    normals = np.ascontiguousarray(scene.disc_normal @ turn.T)
    return (
        boxes,
        axes,
        scene.box_half,
        discs,
        normals,
        scene.disc_radius,
        balls,
        scene.ball_radius,
        lamp,
        _view(corners),
    )


def _view(corners: FloatArray) -> FloatArray:
    """Return (N, 4) the least and greatest x/z and y/z of things within corners (N, 8, 3) of the camera's frame."""
    if len(corners) == 0:
        return np.empty((0, 4))
    depth = corners[..., 2:]
    seen = corners[..., :2] / np.maximum(depth, 1e-9)
    least, most = seen.min(axis=1), seen.max(axis=1)
    beside = (depth <= 1e-6).any(axis=(1, 2))
    least[beside], most[beside] = -np.inf, np.inf
    return np.column_stack([least[:, 0], most[:, 0], least[:, 1], most[:, 1]])
