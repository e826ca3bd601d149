"""How far the tracked tip's frame is from the twin's true one, on rendered pictures."""

from dataclasses import dataclass, replace

import numpy as np

from cathxr.core import FloatArray, Image, Observation, Rig, Status, Track
from cathxr.geometry.roll import total_bend_rad
from cathxr.storage.rig_file import example_rig
from cathxr.tracking import make_tracker, read_and_track
from cathxr.twin.render import CameraRenderer
from cathxr.twin.settings import TwinSettings
from cathxr.twin.world import TwinWorld
from cathxr.vision import make_detector

CAMERAS = ("top", "front")
_PERIOD_NS = 100_000_000


@dataclass(frozen=True, eq=False)
class OrientationErrors:
    """Degrees, one for each tracked pair: of the whole rotation, about the tangent, of the tangent; the bend."""

    pictures: int
    whole_deg: FloatArray
    about_deg: FloatArray
    tangent_deg: FloatArray
    bend_deg: FloatArray

    @property
    def tracked(self) -> int:
        return len(self.whole_deg)


def orientation_errors(
    manoeuvre: str,
    seed: int,
    *,
    pictures: int,
    per_mm: float = 0.0,
    per_quarter: float = 0.0,
    is_configured: bool = True,
) -> OrientationErrors:
    """Return the errors of one manoeuvre; the true catheter is twisted, and the rig says so if it is configured."""
    rig = example_rig()
    settings = TwinSettings(manoeuvre=manoeuvre, torsion_deg_per_mm=per_mm, torsion_deg_per_quarter_bend=per_quarter)
    world = TwinWorld(rig, seed=seed, settings=settings)
    if is_configured and rig.roll is not None:
        roll = replace(rig.roll, torsion_deg_per_mm=per_mm, torsion_deg_per_quarter_bend=per_quarter)
        rig = replace(rig, roll=roll)
    rows = [
        [*_differences(track, truth), np.degrees(total_bend_rad(truth.shape_box))]
        for track, truth in _tracks(rig, world, pictures)
        if track.status is Status.TRACKED and truth.shape_box is not None
    ]
    columns = np.array(rows).reshape(-1, 4).T
    return OrientationErrors(pictures, *columns)


def _tracks(rig: Rig, world: TwinWorld, pictures: int) -> list[tuple[Track, Track]]:
    """Return (tracked, true) of each picture pair; the roll that is given is the true one."""
    renderers = {name: CameraRenderer(world, name) for name in CAMERAS}
    detectors = {name: make_detector("model", rig, name) for name in CAMERAS}
    tracker = make_tracker("model", rig)
    last: Track | None = None
    found = []
    for seq in range(pictures):
        t_ns = seq * _PERIOD_NS
        truth = world.truth(t_ns, seq=seq, points=200)
        images = {name: Image(name, seq, t_ns, renderers[name].picture(t_ns)) for name in CAMERAS}

        def look(predicted: Track | None, images: dict[str, Image] = images, truth: Track = truth) -> Observation:
            detections = tuple(detectors[name].detect(images[name], predicted) for name in CAMERAS)
            return Observation(truth.seq, truth.t_ns, detections, 0, truth.roll_rad)

        _, track = read_and_track(look, tracker, last)
        last = None if track.status is Status.LOST else track
        found.append((track, truth))
    return found


def _differences(track: Track, truth: Track) -> tuple[float, float, float]:
    assert track.box_from_tip is not None, "tracked"
    assert truth.box_from_tip is not None, "there is a catheter"
    between = truth.box_from_tip.rotation.T @ track.box_from_tip.rotation
    whole = np.arccos(np.clip(0.5 * (np.trace(between) - 1.0), -1.0, 1.0))
    about = abs(np.arctan2(between[1, 0] - between[0, 1], between[0, 0] + between[1, 1]))
    tangent = np.arccos(np.clip(between[2, 2], -1.0, 1.0))
    return float(np.degrees(whole)), float(np.degrees(about)), float(np.degrees(tangent))
