"""The categories that `cathxr bench tracking` measures, and the calibrations that it measures them with."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from cathxr.core import ConfigError, FloatArray, Image, PixelArray, Rig, RigCamera, Track
from cathxr.geometry import CameraModel
from cathxr.geometry.calibration_error import ASSUMED_MARKER_PX, pose_jacobian
from cathxr.geometry.pose import perturbed
from cathxr.storage.rig_file import example_rig
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig, with_readout

CAMERAS = ("top", "front")
MM_PER_FRENCH = 1.0 / 3.0
_ROUNDS = 8


@dataclass(frozen=True)
class Category:
    """A twin's scene, and what is special. empty_picture: the detectors are given one; french: the catheter's size."""

    scene: str
    empty_picture: bool = False
    french: float = 9.0


CATEGORIES: Mapping[str, Category] = MappingProxyType(
    {
        name: Category(name)
        for name in ("smooth", "flexion", "roll", "insertion", "rest", "fast", "quick", "low_contrast")
    }
    | {name: Category(name) for name in ("curl", "crossing", "at_a_camera")}
    | {name: Category(name, empty_picture=True) for name in ("white", "coloured")}
    | {name: Category(name) for name in ("debris", "bubbles", "glare", "flicker", "vignetting", "noisy", "mjpg")}
    | {"dropouts": Category("dropouts"), "4F": Category("smooth", french=4.0), "14F": Category("smooth", french=14.0)}
    | {name: Category(name) for name in ("rolling_shutter", "skew")}
)


@dataclass(frozen=True, eq=False)
class ScenePair:
    """Both cameras' pictures, None where one never arrived, and the truth at the top picture's instant."""

    seq: int
    t_ns: int
    pictures: Mapping[str, Image | None]
    truth: Track


class Sequence:
    """One run of the twin: its rig as it is, the rig as calibrated, and its pictures at the true rate.

    Raises:
        ConfigError: no such category.
    """

    def __init__(
        self,
        name: str,
        *,
        seed: int,
        calibration: str = "exact",
        size_px: tuple[int, int] | None = None,
        changes: Mapping[str, Any] | None = None,
    ) -> None:
        """Build the twin. changes: settings of the scene that are to be others."""
        if name not in CATEGORIES:
            raise ConfigError(f"There is no scene {name!r} to measure; there are {', '.join(CATEGORIES)}.")
        self.category = CATEGORIES[name]
        rig = true_rig(example_rig(), seed)
        diameter = self.category.french * MM_PER_FRENCH
        rig = replace(rig, catheter=replace(rig.catheter, diameter_mm=diameter))
        if size_px is not None:
            rig = replace(rig, cameras={each: resized(camera, size_px) for each, camera in rig.cameras.items()})
        self.settings = replace(scene(self.category.scene), **(changes or {}))
        rig = with_readout(rig, self.settings.readout_ms)
        self.world = TwinWorld(rig, seed=seed, settings=self.settings)
        self.renderers = {each: CameraRenderer(self.world, each) for each in CAMERAS}
        self._rng = np.random.default_rng([seed, 0xF1D])
        self.rig = rig if calibration == "exact" else from_fiducials(rig, self._rng)

    def empty_pictures(self) -> Mapping[str, PixelArray | None]:
        """Return the empty box as each camera shows it, None where the category goes without."""
        return {
            each: renderer.empty_picture() if self.category.empty_picture else None
            for each, renderer in self.renderers.items()
        }

    def pairs(self, count: int, rate_hz: float) -> Iterator[ScenePair]:
        """Yield so many pairs, one after the other in time."""
        skew_ns = {"top": 0, "front": round(self.settings.front_skew_ms * 1e6)}
        for seq in range(count):
            t_ns = 1_000_000_000 + round(seq * 1e9 / rate_hz)
            pictures = {}
            for name, renderer in self.renderers.items():
                lost = self._rng.uniform() < self.settings.drop_share
                at_ns = t_ns + skew_ns[name]
                pictures[name] = None if lost else Image(name, seq, at_ns, renderer.picture(at_ns))
            yield ScenePair(seq, t_ns, pictures, self.world.truth(t_ns, seq=seq))


def resized(camera: RigCamera, size_px: tuple[int, int]) -> RigCamera:
    """Return a camera that sees the same across its width, with another number of pixels (width, height)."""
    scale = size_px[0] / camera.size_px[0]
    middle = 0.5 * (np.array(camera.size_px) - 1.0)
    inner = camera.intrinsics
    centre = scale * (inner.centre_px - middle) + 0.5 * (np.array(size_px) - 1.0)
    intrinsics = replace(inner, focal_px=scale * inner.focal_px, centre_px=centre)
    return replace(camera, size_px=size_px, intrinsics=intrinsics)


def from_fiducials(rig: Rig, rng: np.random.Generator) -> Rig:
    """Return the rig with each camera's pose found from its own four fiducials, seen with 0.1 px of noise."""
    cameras = {}
    for name, camera in rig.cameras.items():
        model = CameraModel.of(camera)
        points = np.stack([each.position_mm for each in rig.markers[name]])
        seen = model.project(points) + rng.normal(scale=ASSUMED_MARKER_PX, size=(len(points), 2))
        cameras[name] = replace(camera, camera_from_box=_posed(model, points, seen).camera_from_box)
    return replace(rig, cameras=cameras)


def _posed(model: CameraModel, points: FloatArray, seen: FloatArray) -> CameraModel:
    """Return the camera whose pose is the least-squares one for fiducials (N, 3) mm seen at (N, 2) px."""
    for _ in range(_ROUNDS):
        jacobian = pose_jacobian(model, points).reshape(-1, 6)
        step = np.linalg.lstsq(jacobian, (seen - model.project(points)).reshape(-1), rcond=None)[0]
        model = replace(model, camera_from_box=perturbed(model.camera_from_box, np.asarray(step, dtype=np.float64)))
    return model
