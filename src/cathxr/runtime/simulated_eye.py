"""What sees the twin's catheter in a simulated trial: the truth with the tracker's errors, or cameras and tracker."""

from typing import Protocol

import numpy as np

from cathxr.core import ConfigError, FloatArray, Image, Observation, Pose, Rig, Track
from cathxr.core.track import Status
from cathxr.geometry.pose import turned_about_z
from cathxr.geometry.roll import RollFollower
from cathxr.tracking import make_tracker
from cathxr.twin import CameraRenderer, TwinWorld
from cathxr.twin.gears import Gears
from cathxr.vision import make_detector

TIP_STD_MM = 0.0063
"""Along each axis: a mean distance of 0.010 mm, as measured on the twin's "smooth" scene (docs/benchmarks.md)."""
TANGENT_STD_DEG = 0.21
"""About each of two axes: a mean angle of 0.26 degrees, from the same table."""
SIGMA_MM = 0.03
"""What the tracker states there: its error is 0.32 of it."""
_POINTS = 20


class Eye(Protocol):
    """Gives the Track of an instant; instants never go back."""

    def track(self, seq: int, t_ns: int) -> Track:
        """Return the Track."""
        ...


class Encoder:
    """The twin's gears and encoder, read as a rig says: the roll to the count, without play."""

    def __init__(self, world: TwinWorld, rig: Rig) -> None:
        """Raises ConfigError where the rig has no [roll]."""
        if rig.roll is None:
            raise ConfigError(f"The rig {rig.name!r} has no [roll], which simulated trials need: add [roll] to it.")
        self._gears, self._follower = Gears(world, rig.roll, play_deg=0.0), RollFollower(rig.roll)

    def roll_rad(self, t_ns: int) -> float:
        """Return the roll that the encoder gives."""
        return self._follower.angle_rad(self._gears.count(t_ns))


class TruthEye:
    """The twin's exact catheter with white errors of the size that the tracker was measured to have, and the encoder.

    The tracker's own errors change slowly with the catheter's place; white ones of the same size are the harder case
    for speeds and smoothness.
    """

    def __init__(self, world: TwinWorld, rig: Rig, rng: np.random.Generator) -> None:
        self._world, self._encoder, self._rng = world, Encoder(world, rig), rng

    def track(self, seq: int, t_ns: int) -> Track:
        """Return the Track of an instant."""
        truth = self._world.truth(t_ns, seq=seq, points=_POINTS)
        shape, pose, true_roll = truth.shape_box, truth.box_from_tip, truth.roll_rad
        if shape is None or pose is None or true_roll is None:
            return truth
        roll = self._encoder.roll_rad(t_ns)
        moved = self._rng.normal(0.0, TIP_STD_MM, 3)
        tilt = np.deg2rad(self._rng.normal(0.0, TANGENT_STD_DEG, 2))
        rotation = turned_about_z(pose.rotation, roll - true_roll) @ _tilted(tilt)
        # the shape is off by as much as the tip, and by nothing at the inlet, which the rig knows
        share = np.linspace(1.0, 0.0, len(shape))[:, None]
        points = shape + share * moved
        turned = Pose.from_matrix(rotation, points[0])
        return Track(seq, t_ns, Status.TRACKED, "", points, turned, roll, SIGMA_MM)


class PictureEye:
    """Both cameras' rendered pictures, the detectors and the tracker: nothing of the truth but through them."""

    def __init__(self, world: TwinWorld, rig: Rig) -> None:
        self._encoder = Encoder(world, rig)
        self._cameras = {each: CameraRenderer(world, each) for each in ("top", "front")}
        self._detectors = {each: make_detector("model", rig, each) for each in self._cameras}
        self._tracker = make_tracker("model", rig, points=_POINTS)

    def track(self, seq: int, t_ns: int) -> Track:
        """Return the Track of an instant, both cameras exposed at it."""
        found = tuple(
            self._detectors[each].detect(Image(each, seq, t_ns, renderer.picture(t_ns)))
            for each, renderer in self._cameras.items()
        )
        return self._tracker.update(Observation(seq, t_ns, found, 0, self._encoder.roll_rad(t_ns)))


def _tilted(tilt_rad: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) by (2,) rad about x and y of the tip, both small."""
    angle = float(np.hypot(*tilt_rad))
    if angle == 0.0:
        return np.eye(3)
    x, y = tilt_rad / angle
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross))
