"""How a person moves a board about before a camera: from one good place to the next, with rests between."""

from dataclasses import replace

import numpy as np

from cathxr.core import CalibrationError, FloatArray, Pose, RigCamera
from cathxr.geometry import CameraModel
from cathxr.geometry.pose import interpolated, pose_from_vector, quaternion_from_rotation_vector

REST_S = 1.2
TRAVEL_S = 0.9
_TREMOR_PX = 0.1
_TREMOR_HZ = (2.3, 4.1, 6.7)
_TILT_DEG = (12.0, 38.0)
_ROLL_DEG = 25.0
_SHARE = (0.55, 0.85)
_MARGIN = 0.015
_TRIES = 200
# Corners, sides and the middle, in an order in which a person would not go but which shows early what is missing.
_PLACES = ((0.5, 0.5), (0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 1.0), (0.0, 0.5), (1.0, 0.5))


class BoardMotion:
    """Where a board is at any time, by seed: it travels for TRAVEL_S and then rests for REST_S, again and again.

    camera: whose picture the rests cover; its place in the box does not matter. size_mm (2,): the print's width and
    height; offset_mm (2,): from the print's corner to the board's origin, and the bare margin on the other side.
    """

    def __init__(self, camera: RigCamera, size_mm: FloatArray, offset_mm: FloatArray, *, seed: int = 0) -> None:
        self.camera, self.size_mm, self.offset_mm, self.seed = camera, size_mm, offset_mm, seed
        self._rests: dict[int, Pose] = {}

    def pose(self, t_s: float) -> Pose:
        """Return camera_from_board at a time; before zero it rests in the first place."""
        index, since = divmod(max(t_s, 0.0), TRAVEL_S + REST_S)
        there = self.rest(int(index) + 1)
        if since < TRAVEL_S:
            there = interpolated(self.rest(int(index)), there, _eased(since / TRAVEL_S))
        # A hand trembles: a tenth of a pixel, wherever the board is.
        scale = _TREMOR_PX * there.translation_mm[2] / float(self.camera.intrinsics.focal_px.mean())
        phases = np.random.default_rng([self.seed, 0x73E]).uniform(0.0, 2.0 * np.pi, size=(3, 3))
        waves = np.sin(2.0 * np.pi * np.array(_TREMOR_HZ)[:, None] * t_s + phases).sum(axis=0)
        return replace(there, translation_mm=there.translation_mm + scale * np.sqrt(2.0 / 3.0) * waves)

    def twist(self, t_s: float, exposure_s: float) -> FloatArray:
        """Return (6,) how far the board turns (rad) and shifts (mm) in the camera's frame over an exposure."""
        before, after = self.pose(t_s - 0.5 * exposure_s), self.pose(t_s + 0.5 * exposure_s)
        turn = after.rotation @ before.rotation.T
        # Over an exposure the turn is tiny: its rotation vector is that of the antisymmetric part.
        vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        return np.concatenate([vector, after.translation_mm - before.translation_mm])

    def rest(self, index: int) -> Pose:
        """Return camera_from_board in the place of an index, 0 being where it all begins.

        Raises:
            CalibrationError: the board does not fit into the picture.
        """
        if index not in self._rests:
            self._rests[index] = self._found(index)
        return self._rests[index]

    def _found(self, index: int) -> Pose:
        rng = np.random.default_rng([self.seed, index, 0xB0A2])
        slack = rng.uniform(-0.08, 0.08, size=2) if index >= len(_PLACES) else np.zeros(2)
        wanted = np.clip(np.array(_PLACES[index % len(_PLACES)]) + slack, 0.0, 1.0)
        for _ in range(_TRIES):
            pose = self._placed(rng, (float(wanted[0]), float(wanted[1])))
            if pose is not None:
                return pose
        raise CalibrationError(
            f"The twin finds no place before the {self.camera.name} camera where a board of "
            f"{self.size_mm[0]:.0f} x {self.size_mm[1]:.0f} mm is all in the picture: use a board of another shape."
        )

    def _placed(self, rng: np.random.Generator, place: tuple[float, float]) -> Pose | None:
        """Return a pose at a place of the picture (shares of what is free beside the board); None when it juts out."""
        side, tilt = rng.uniform(0.0, 2.0 * np.pi), np.deg2rad(rng.uniform(*_TILT_DEG))
        turn = Pose(quaternion_from_rotation_vector(tilt * np.array([np.cos(side), np.sin(side), 0.0])), np.zeros(3))
        roll = np.array([0.0, 0.0, np.deg2rad(rng.uniform(-_ROLL_DEG, _ROLL_DEG)), 0.0, 0.0, 0.0])
        rotation = (pose_from_vector(roll) @ turn).rotation_wxyz
        focal = float(self.camera.intrinsics.focal_px.mean())
        size = np.array(self.camera.size_px, dtype=np.float64)
        share = rng.uniform(*_SHARE)
        depth = max(focal * float(self.size_mm.max()) / (share * float(size.min())), float(self.size_mm.max()))
        corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
        # The pattern must be in the picture; of the bare margin around it, as wide as the offset, some may jut out.
        corners = corners * [*(self.size_mm - 2.0 * self.offset_mm), 0.0]
        middle = Pose(rotation, np.zeros(3)).apply(corners.mean(axis=0))
        pose = Pose(rotation, np.array([0.0, 0.0, depth]) - middle)
        margin = _MARGIN * float(size.max())
        for _ in range(6):
            model = CameraModel(self.camera.intrinsics, pose, self.camera.size_px)
            seen = model.project(corners)
            low, high = seen.min(axis=0), seen.max(axis=0)
            free = size - 1.0 - 2.0 * margin - (high - low)
            if (free < 0.0).any():
                return None
            shift = (margin + np.array(place) * free - low) * depth / focal
            pose = replace(pose, translation_mm=pose.translation_mm + np.append(shift, 0.0))
        seen = CameraModel(self.camera.intrinsics, pose, self.camera.size_px).project(corners)
        inside = (seen >= 0.5 * margin).all() and (seen <= size - 1.0 - 0.5 * margin).all()
        return pose if inside else None


def _eased(share: float) -> float:
    """Return how far along, 0 to 1, with no rate and no acceleration at either end (minimum jerk)."""
    return share**3 * (10.0 + share * (6.0 * share - 15.0))
