"""What a drawing is made of: a Part as it is printed, cut or bought, and where it is put."""

from dataclasses import dataclass, field

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.shapes import Solid, placed

PRINTED, SOFT, CUT, BOUGHT = "printed", "soft", "cut", "bought"
ALWAYS, CALIBRATION, PHANTOM, JIG = "", "calibration", "phantom", "jig"


def _no_turn() -> FloatArray:
    return np.eye(3)


@dataclass(frozen=True, eq=False)
class Part:
    """One kind of part. solid: in its own frame; kind: PRINTED, SOFT (TPU), CUT or BOUGHT.

    print_up: the direction in its own frame that points up on the printer's bed. colour: red, green, blue, 0 to 1.
    note: what to know when it is printed.
    """

    key: str
    title: str
    kind: str
    solid: Solid
    colour: tuple[float, float, float]
    print_up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    note: str = ""


@dataclass(frozen=True, eq=False)
class Place:
    """One part in the rig. columns (3, 3): its axes in `box`; origin (3,) mm. setup: in which set-up it is there.

    group: what it is built with, for exploded views.
    """

    part: Part
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))
    columns: FloatArray = field(default_factory=_no_turn)
    setup: str = ALWAYS
    group: str = "frame"

    def solid(self) -> Solid:
        """Return the part's solid where it is."""
        return placed(self.part.solid, self.columns, self.origin.tolist())
