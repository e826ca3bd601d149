"""The whole rig: every part where it belongs, and the sets of parts that are there at the same time."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from cathxr.hardware.cad.camera import camera_places
from cathxr.hardware.cad.crosses import cross_places
from cathxr.hardware.cad.fittings import fitting_places
from cathxr.hardware.cad.frame import frame_places, sheet_parts
from cathxr.hardware.cad.inlet import inlet_parts, inlet_places
from cathxr.hardware.cad.part import ALWAYS, BOUGHT, CUT, PRINTED, SOFT, Part, Place
from cathxr.hardware.cad.phantom import phantom_place
from cathxr.hardware.cad.roll_fittings import roll_fittings
from cathxr.hardware.cad.roll_unit import roll_places
from cathxr.hardware.layout import Layout


@dataclass(frozen=True, eq=False)
class Rig3d:
    """The rig as solids. places: everything, in all set-ups; spare: parts that are made and not in (other inlets)."""

    layout: Layout
    places: tuple[Place, ...]
    spare: tuple[Part, ...]

    @property
    def parts(self) -> dict[str, Part]:
        """Every kind of part by its key."""
        return {each.key: each for each in (*(place.part for place in self.places), *self.spare)}

    @property
    def counts(self) -> Counter[str]:
        """How many of each are needed, by key."""
        return Counter([*(place.part.key for place in self.places), *(each.key for each in self.spare)])

    def made(self) -> dict[str, Part]:
        """Return the parts that are printed."""
        return {key: part for key, part in self.parts.items() if part.kind in (PRINTED, SOFT)}

    def within(self, setups: Iterable[str]) -> tuple[Place, ...]:
        """Return what is there in any of these set-ups, and what always is."""
        wanted = {ALWAYS, *setups}
        return tuple(each for each in self.places if each.setup in wanted)


def rig_3d(layout: Layout) -> Rig3d:
    """Return the rig as solids: a few seconds of work."""
    sheets, inlets = sheet_parts(layout), tuple(inlet_parts(layout))
    places = (
        *frame_places(layout, sheets),
        *fitting_places(layout),
        *inlet_places(layout, inlets),
        *camera_places(layout),
        *cross_places(layout),
        phantom_place(layout),
        *roll_places(layout, sheets["rail_plate"]),
        *roll_fittings(layout),
    )
    there = {each.part.key for each in places}
    return Rig3d(layout, places, tuple(each for each in inlets if each.key not in there))


__all__ = ["ALWAYS", "BOUGHT", "CUT", "PRINTED", "SOFT", "Rig3d", "rig_3d"]
