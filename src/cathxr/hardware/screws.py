"""Every screwed joint: which screw, how many, with which nut. Lengths follow from what they go through."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from cathxr.hardware.layout import (
    CARRIER_MM,
    HOLDER_PLATE_MM,
    PANEL_REST_MM,
    RAIL_LENGTH_MM,
    ROLL_BASE_MM,
    STANDOFF_MM,
    Layout,
)

LENGTHS_MM = (4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50)
"""In which cap screws (ISO 4762) are sold."""
NUT_MM: Mapping[str, float] = {"": 0.0, "nut": 0.8, "lock nut": 1.3}
"""A nut's height over its thread's size (ISO 4032; ISO 10511 with its ring), at most."""
BRACKET_MM, CAP_EAR_MM, ENCODER_PLATE_MM, LUG_MM, TRAY_TAB_MM, LEG_MM = 6.0, 8.0, 5.0, 6.0, 3.0, 3.0
CARRIAGE_SUNK_MM = 3.2
RAIL_UNDER_HEAD_MM = 3.5
"""What is left of an MGN12 rail under a sunk head."""
_BOARD_MM = 1.6


@dataclass(frozen=True)
class Joint:
    """One kind of joint. grip_mm: from under the head to the nut, or to where the thread begins in the last part.

    hold_mm: how much thread must hold there (without a nut); most_mm: how deep it may go. nut: "", "nut", "lock nut".
    """

    key: str
    where: str
    quantity: int
    size_mm: int
    grip_mm: float
    hold_mm: float = 0.0
    most_mm: float = float("inf")
    nut: str = ""

    @property
    def least_mm(self) -> float:
        """The least length that holds."""
        return self.grip_mm + (NUT_MM[self.nut] * self.size_mm if self.nut else self.hold_mm)

    @property
    def length_mm(self) -> int:
        """The shortest screw that is sold and holds."""
        return next(each for each in LENGTHS_MM if each >= self.least_mm - 1e-9)

    @property
    def name(self) -> str:
        """As M3 x 10."""
        return f"M{self.size_mm} x {self.length_mm}"


def joints(layout: Layout) -> dict[str, Joint]:
    """Return every joint by its key."""
    panel, rest = layout.parameters.panel, PANEL_REST_MM - STANDOFF_MM
    rail = int(RAIL_LENGTH_MM // 25.0)
    found = (
        Joint("holder", "inlet holder through its panel", 4, 3, HOLDER_PLATE_MM + panel.thickness_mm, nut="nut"),
        Joint("leg", "legs on the crosses; black ones", 16, 3, LEG_MM, 3.0, 6.0),
        Joint("tilt", "camera carriers", 6, 3, panel.plate_mm + rest, nut="lock nut"),
        Joint("board", "camera boards", 8, 2, _BOARD_MM, 4.0, STANDOFF_MM + CARRIER_MM + 4.0),
        Joint("beam", "the rail's bracket on the lower beam", 2, 4, BRACKET_MM, 8.0,
              0.5 * layout.parameters.frame.section_mm - 1.0),
        Joint("rail", "the rail on its plate", rail, 3, RAIL_UNDER_HEAD_MM + panel.plate_mm, nut="nut"),
        Joint("rail_end", "the rail's plate on bracket and leg", 4, 3, panel.plate_mm, 4.0, 8.0),
        Joint("carriage", "the base on the carriage", 4, 3, ROLL_BASE_MM - CARRIAGE_SUNK_MM, 2.5, 3.5),
        Joint("cap", "bearing caps", 4, 3, CAP_EAR_MM, 6.0, 13.0),
        Joint("encoder", "encoder on its plate", 3, 3, ENCODER_PLATE_MM, 4.0, 6.0),
        Joint("tray", "Nano holder on the base", 2, 3, TRAY_TAB_MM, 4.0, 6.0),
        Joint("pivot", "the encoder plate's pivot", 1, 4, ENCODER_PLATE_MM + 0.5 + LUG_MM, nut="lock nut"),
    )  # fmt: skip
    return {each.key: each for each in found}


def screw_lines(every: Iterable[Joint]) -> list[tuple[str, int, str]]:
    """Return screws and nuts as (name, pieces, where), the same ones together, thin and short ones first."""
    every = sorted(every, key=lambda each: (each.size_mm, each.length_mm))
    screws: dict[str, list[Joint]] = {}
    nuts: dict[str, list[Joint]] = {}
    for each in every:
        screws.setdefault(f"Screw {each.name}", []).append(each)
        if each.nut:
            nuts.setdefault(f"{each.nut.capitalize()} M{each.size_mm}", []).append(each)
    return [
        (name, sum(each.quantity for each in group), "; ".join(f"{each.quantity} {each.where}" for each in group))
        for name, group in (*screws.items(), *nuts.items())
    ]
