"""Sessions without pictures: the twin's catheter projected into both cameras, with the noise of a real detection."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from cathxr.calibration.epipolar import Pairs, joined, session_pairs
from cathxr.core import Detection, FloatArray, Observation, Rig, Track
from cathxr.geometry import CameraModel, nearest_to_rays
from cathxr.geometry.pose import perturbed
from cathxr.storage.rig_file import example_rig
from cathxr.tracking import make_tracker
from cathxr.twin import TwinWorld, scene, true_rig

NOISE_PX = 0.05


@dataclass(frozen=True, eq=False)
class Recorded:
    """What a session would hold."""

    rig: Rig
    observations: list[Observation]
    tracks: list[Track]


def detection(
    model: CameraModel, camera: str, seq: int, t_ns: int, shape: FloatArray, rng: np.random.Generator
) -> Detection:
    """Return what a camera would measure of a centreline (N, 3), tip first, of a tube of 1.5 mm radius."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(shape, axis=0), axis=1))])
    at = np.linspace(1.5, along[-1] - 3.0, 60)
    points = np.column_stack([np.interp(at, along, axis) for axis in shape.T])
    curve, tip = model.project(points), model.project(shape[0])
    tangent = np.gradient(curve, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    curve = curve + normal * rng.normal(0.0, NOISE_PX, size=(len(curve), 1))
    slip = tangent[0] * rng.normal(0.0, NOISE_PX)
    curve[0] += slip
    return Detection(
        camera, seq, t_ns, curve, normal, np.full(len(curve), NOISE_PX), np.full(len(curve), 6.0), tip + slip, NOISE_PX
    )


def recorded(
    box: Rig, used: Rig, *, seconds: float, seed: int, manoeuvre: str, rate_hz: float = 5.0, front_late_s: float = 0.0
) -> Recorded:
    """Return a session of the box, tracked with another rig. front_late_s: how late the front camera's stamps are."""
    world = TwinWorld(box, seed=seed, settings=replace(scene("smooth"), manoeuvre=manoeuvre))
    rng = np.random.default_rng([seed, 7])
    models = {name: CameraModel.of(box.cameras[name]) for name in ("top", "front")}
    tracker = make_tracker("model", used)
    observations, tracks = [], []
    for seq in range(int(seconds * rate_hz)):
        stamp = round(seq * 1e9 / rate_hz)
        instants = {"top": stamp, "front": stamp - round(front_late_s * 1e9)}
        found = tuple(
            detection(models[name], name, seq, stamp, world.state(t_ns).shape_box, rng)
            for name, t_ns in instants.items()
        )
        observation = Observation(seq, stamp, found)
        observations.append(observation)
        tracks.append(tracker.update(observation))
    return Recorded(used, observations, tracks)


def knocked(rig: Rig, camera: str, *, turn_deg: float, shift_mm: float, seed: int) -> Rig:
    """Return a rig whose camera turned about its own centre and moved, in a random direction."""
    rng = np.random.default_rng([seed, 3])
    turn, shift = rng.normal(size=3), rng.normal(size=3)
    turn *= np.deg2rad(turn_deg) / np.linalg.norm(turn)
    shift *= shift_mm / np.linalg.norm(shift)
    old = rig.cameras[camera]
    lever = np.cross(turn, old.camera_from_box.translation_mm)
    pose = perturbed(old.camera_from_box, np.concatenate([turn, lever + shift]))
    return replace(rig, cameras={**rig.cameras, camera: replace(old, camera_from_box=pose)})


def tip_error_mm(box: Rig, used: Rig) -> float:
    """Return the mean error of points throughout the inner ROI that the box shows and another rig triangulates."""
    axes = [np.linspace(15.0, 105.0, 4), np.linspace(-35.0, 35.0, 4), np.linspace(-35.0, 35.0, 4)]
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
    seen = [CameraModel.of(box.cameras[name]).project(points) for name in ("top", "front")]
    models = [CameraModel.of(used.cameras[name]) for name in ("top", "front")]
    rays = np.stack([model.ray(each) for model, each in zip(models, seen, strict=True)])
    found = nearest_to_rays(np.stack([each.centre_box for each in models]), rays)
    return float(np.linalg.norm(found - points, axis=1).mean())


@pytest.fixture(scope="session")
def make_pairs() -> Callable[..., Pairs]:
    """A function that gives the pairs of two sessions of a box, tracked with another rig."""

    def make(box: Rig, used: Rig, *, seed: int, seconds: float = 40.0, front_late_s: float = 0.0) -> Pairs:
        parts = []
        for index, manoeuvre in enumerate(("smooth", "full_range")):
            made = recorded(box, used, seconds=seconds, seed=seed, manoeuvre=manoeuvre, front_late_s=front_late_s)
            parts.append(session_pairs(used, made.observations, made.tracks, session=index))
        return joined(parts)

    return make


@pytest.fixture(scope="session")
def box() -> Rig:
    """A box that is off the drawing, as all are."""
    return true_rig(example_rig(), 2)


@pytest.fixture(scope="session")
def knock() -> Callable[..., Rig]:
    return knocked


@pytest.fixture(scope="session")
def tip_error() -> Callable[[Rig, Rig], float]:
    return tip_error_mm


@pytest.fixture(scope="session")
def record_session() -> Callable[..., Recorded]:
    return recorded
