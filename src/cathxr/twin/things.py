"""Opaque things that never move in the box, as blocks, discs and balls."""

from dataclasses import dataclass, field, replace

import numpy as np

from cathxr.core import FloatArray
from cathxr.twin.settings import Colour


def _no_points() -> FloatArray:
    return np.empty((0, 3))


@dataclass(frozen=True, eq=False)
class StaticScene:
    """Opaque things in `box`, mm.

    box_centre (B, 3), box_axes (B, 3, 3) columns, box_half (B, 3), box_colour (B, 3); disc_centre (D, 3), disc_normal
    (D, 3), disc_radius (D,), disc_colour (D, 3); ball_centre (S, 3), ball_radius (S,), ball_colour (S, 3). Discs lie on
    faces and are seen from either side.
    """

    box_centre: FloatArray = field(default_factory=_no_points)
    box_axes: FloatArray = field(default_factory=lambda: np.empty((0, 3, 3)))
    box_half: FloatArray = field(default_factory=_no_points)
    box_colour: FloatArray = field(default_factory=_no_points)
    disc_centre: FloatArray = field(default_factory=_no_points)
    disc_normal: FloatArray = field(default_factory=_no_points)
    disc_radius: FloatArray = field(default_factory=lambda: np.empty(0))
    disc_colour: FloatArray = field(default_factory=_no_points)
    ball_centre: FloatArray = field(default_factory=_no_points)
    ball_radius: FloatArray = field(default_factory=lambda: np.empty(0))
    ball_colour: FloatArray = field(default_factory=_no_points)

    def with_box(self, centre: FloatArray, axes: FloatArray, half: FloatArray, colour: Colour) -> "StaticScene":
        """Return the scene with one more block: axes (3, 3) columns, half its size (3,) along them."""
        return replace(
            self,
            box_centre=np.concatenate([self.box_centre, centre[None]]),
            box_axes=np.concatenate([self.box_axes, axes[None]]),
            box_half=np.concatenate([self.box_half, half[None]]),
            box_colour=np.concatenate([self.box_colour, np.array(colour)[None]]),
        )

    def with_disc(self, centre: FloatArray, normal: FloatArray, radius: float, colour: Colour) -> "StaticScene":
        """Return the scene with one more disc."""
        return replace(
            self,
            disc_centre=np.concatenate([self.disc_centre, centre[None]]),
            disc_normal=np.concatenate([self.disc_normal, normal[None]]),
            disc_radius=np.concatenate([self.disc_radius, [radius]]),
            disc_colour=np.concatenate([self.disc_colour, np.array(colour)[None]]),
        )

    def with_ball(self, centre: FloatArray, radius: float, colour: Colour) -> "StaticScene":
        """Return the scene with one more ball."""
        return replace(
            self,
            ball_centre=np.concatenate([self.ball_centre, centre[None]]),
            ball_radius=np.concatenate([self.ball_radius, [radius]]),
            ball_colour=np.concatenate([self.ball_colour, np.array(colour)[None]]),
        )
