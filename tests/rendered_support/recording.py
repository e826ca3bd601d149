"""Renders recordings: two folders of pictures, the rig, the times, pictures of the empty box, and the truth."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from zlib import crc32

import cv2
import mitsuba as mi
import numpy as np

from cathxr.core import FloatArray, Intrinsics, Pose
from cathxr.core.rig import Catheter
from cathxr.geometry.pose import pose_from_vector
from cathxr.storage.rig_file import example_rig, write_rig

from .camera import RenderedCamera, make_cameras
from .materials import catheter, colour, material
from .shapes import moving
from .worlds import Light, World

mi.set_variant("scalar_rgb")  # needs no LLVM; loaded once for a process

RATE_HZ = 30.0
_PANEL_AT_MM = 75.0
_EXPOSURES = 15
"""Pictures, of one sample a pixel each, that are averaged for one whose shutter stays open: fewer would draw steps."""
_FULL = 0.75
"""What a bright part of the panel shows, of the sensor's full scale."""
_EMPTY_SAMPLES = 6


class _Studio:
    """A box with its cameras: what is rendered again and again."""

    def __init__(self, world: World, folder: Path) -> None:
        self.world, self.folder = world, folder
        self.rng = np.random.default_rng(crc32(world.name.encode()))
        self.phase = float(self.rng.uniform()) if world.motion == "sweep" else 0.0
        self.cameras = make_cameras(world.optics, self.rng)
        self.box = _box(world.light, self.rng) | _debris(world.debris, self.rng)
        empty = mi.load_dict(self.box)
        self.empty = [self._render(empty, each, (0, 0, *each.size), _EMPTY_SAMPLES, 1) for each in self.cameras]
        self.gain = _FULL / max(float(np.percentile(each, 90)) for each in self.empty)

    def light(self, time_s: float, seed: int) -> list[FloatArray]:
        """Return what arrives at each camera at one instant: the empty box, and what is around the catheter anew."""
        points = moving(self.world.motion, time_s, self.phase)
        scene = mi.load_dict(self.box | catheter(self.world, points, self.folder, mi.ScalarTransform4f))
        seen = points[points[:, 0] > -12.0]
        samples = 1 if self.world.optics.exposure_s else self.world.samples
        result = []
        for index, (camera, empty) in enumerate(zip(self.cameras, self.empty, strict=True)):
            window = camera.window(seen, 2.0 * self.world.diameter_mm)
            x0, y0, x1, y1 = window
            whole = empty.copy()
            whole[y0:y1, x0:x1] = self._render(scene, camera, window, samples, 7 * seed + index)
            result.append(whole)
        return result

    def write(self, path: Path, camera: RenderedCamera, light: FloatArray) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not cv2.imwrite(str(path), camera.picture(self.gain * light, self.rng)):
            raise OSError(f"{path} cannot be written")

    def _render(
        self, scene: Any, camera: RenderedCamera, window: tuple[int, int, int, int], samples: int, seed: int
    ) -> FloatArray:
        """Return light (h, w, 3), BGR, of a window of what a camera's pinhole would show."""
        (width, height), (x0, y0, x1, y1) = camera.size, window
        place, axis = camera.place, camera.rotation[2]
        film = {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "crop_offset_x": x0,
            "crop_offset_y": y0,
            "crop_width": x1 - x0,
            "crop_height": y1 - y0,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        }
        sensor = mi.load_dict(
            {
                "type": "thinlens",
                "fov": float(2.0 * np.degrees(np.arctan(0.5 * width / camera.focal))),
                "fov_axis": "x",
                "aperture_radius": 0.5,
                "focus_distance": 330.0,
                "near_clip": 10.0,
                "far_clip": 2000.0,
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=place.tolist(), target=(place + 100.0 * axis).tolist(), up=(-camera.rotation[1]).tolist()
                ),
                "film": film,
                "sampler": {"type": "independent", "sample_count": samples},
            }
        )
        return np.array(mi.render(scene, sensor=sensor, spp=samples, seed=seed))[..., 2::-1]


def render(world: World, folder: Path, *, pairs: int) -> Iterator[int]:
    """Render a recording into `folder`, one pair at each step: top/, front/, rig.toml, times.csv, truth.jsonl.

    Each line of truth.jsonl: tip (3,), direction (3,) unit, and curve (N, 3), mm in `box`, from the inlet to the tip.
    """
    folder.mkdir(parents=True, exist_ok=True)
    studio = _Studio(world, folder)
    _write_rig(folder / "rig.toml", world, studio.cameras)
    for camera, light in zip(studio.cameras, studio.empty, strict=True):
        studio.write(folder / f"empty_{camera.name}.png", camera, light)
    times = [f"{seq},{seq / RATE_HZ:.6f},{seq / RATE_HZ:.6f}\n" for seq in range(pairs)]
    (folder / "times.csv").write_text("seq,t_top_s,t_front_s\n" + "".join(times), encoding="utf-8")
    parts = _EXPOSURES if world.optics.exposure_s else 1
    with (folder / "truth.jsonl").open("w", encoding="utf-8") as truth:
        for seq in range(pairs):
            mean = [np.zeros_like(each) for each in studio.empty]
            for part in range(parts):
                offset_s = ((part + 0.5) / parts - 0.5) * world.optics.exposure_s
                for total, light in zip(mean, studio.light(seq / RATE_HZ + offset_s, seq * parts + part), strict=True):
                    total += light / parts
            for camera, light in zip(studio.cameras, mean, strict=True):
                studio.write(folder / camera.name / f"{seq:05d}.png", camera, light)
            truth.write(json.dumps(_truth(world, moving(world.motion, seq / RATE_HZ, studio.phase))) + "\n")
            yield seq


def _truth(world: World, points: FloatArray) -> dict[str, list[Any]]:
    ahead = points[-1] - points[-2]
    ahead /= np.linalg.norm(ahead)
    tip = points[-1] + (0.5 * world.diameter_mm if world.end == "round" else 0.0) * ahead
    curve = np.vstack([points[points[:, 0] >= 0.0], tip])
    return {"tip": tip.tolist(), "direction": ahead.tolist(), "curve": curve.tolist()}


def _box(light: Light, rng: np.random.Generator) -> dict[str, Any]:
    """Return two glowing panels, the inlet's and the far wall, and what light comes from everywhere else."""
    at, half = mi.ScalarTransform4f, light.half_mm
    wall = {"type": "twosided", "surface": {"type": "diffuse", "reflectance": colour(light.wall)}}

    def upright(x: float) -> dict[str, Any]:
        pose = at().translate([x, 0, 0]).rotate([0, 1, 0], 90).scale(half)
        return {"type": "rectangle", "to_world": pose, "bsdf": wall}

    below = at().translate([60, 0, -_PANEL_AT_MM]).scale(half)
    behind = at().translate([60, _PANEL_AT_MM, 0]).rotate([1, 0, 0], 90).scale(half)
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "below": _panel(below, light.levels[0], light.fall, rng),
        "behind": _panel(behind, light.levels[1], light.fall, rng),
        "inlet": upright(-2.0),
        "far": upright(60.0 + half),
        "room": {"type": "constant", "radiance": colour(light.ambient)},
    }


def _panel(pose: Any, level: float, fall: float, rng: np.random.Generator) -> dict[str, Any]:
    """Return a panel that glows less towards its corners, with clouds of a few per cent in its diffuser."""
    count = 64
    y, x = np.mgrid[:count, :count] / (count - 1) - 0.5
    clouds = 1.0 + 0.24 * cv2.GaussianBlur(rng.normal(size=(count, count)), (0, 0), 8)
    glow = np.clip((1.0 - 2.0 * fall * (x * x + y * y)) * clouds, 0.05, None)
    radiance = mi.Bitmap(np.repeat((level * glow).astype(np.float32)[..., None], 3, axis=2))
    return {
        "type": "rectangle",
        "to_world": pose,
        "bsdf": {"type": "diffuse", "reflectance": colour(0.7)},
        "emitter": {"type": "area", "radiance": {"type": "bitmap", "bitmap": radiance, "raw": True}},
    }


def _debris(count: int, rng: np.random.Generator) -> dict[str, Any]:
    return {
        f"speck{index}": {
            "type": "sphere",
            "center": rng.uniform([5, -50, -50], [110, 50, 50]).tolist(),
            "radius": float(rng.uniform(0.2, 1.2)),
            "bsdf": material("black" if index % 2 else "grey"),
        }
        for index in range(count)
    }


def _write_rig(path: Path, world: World, cameras: list[RenderedCamera]) -> None:
    nominal = example_rig()
    found = {}
    for each in cameras:
        turn = pose_from_vector(np.concatenate([cv2.Rodrigues(each.rotation)[0][:, 0], np.zeros(3)]))
        found[each.name] = replace(
            nominal.cameras[each.name],
            size_px=each.optics.size_px,
            rate_hz=RATE_HZ,
            intrinsics=Intrinsics(each.focal_px, each.centre_px, np.array(each.optics.distortion)),
            camera_from_box=Pose(turn.rotation_wxyz, each.translation),
        )
    write_rig(path, replace(nominal, name=world.name, catheter=Catheter(world.what, world.diameter_mm), cameras=found))
