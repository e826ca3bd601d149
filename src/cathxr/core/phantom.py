"""A printed phantom: holes at known places, into which the tip is put one after the other."""

from dataclasses import dataclass

import numpy as np

from cathxr.core.arrays import FloatArray, checked


@dataclass(frozen=True, eq=False)
class Hole:
    """One hole. position_mm (3,): where the tip is when it is seated, mm in `box`; region: "" for none."""

    name: str
    position_mm: FloatArray
    region: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_mm", checked("position_mm", self.position_mm, (3,)))


@dataclass(frozen=True, eq=False)
class Phantom:
    """A phantom's holes in the order in which they are visited.

    position_std_mm: how well a hole's place is known, along each axis; catheter_diameter_mm: what the holes are made
    for (None: any).
    """

    name: str
    holes: tuple[Hole, ...]
    position_std_mm: float
    catheter_diameter_mm: float | None = None

    def __post_init__(self) -> None:
        names = [each.name for each in self.holes]
        if len(names) < 3 or len(set(names)) != len(names):
            raise ValueError(f"holes: expected at least three with different names, got {names}")
        if not (np.isfinite(self.position_std_mm) and self.position_std_mm >= 0):
            raise ValueError(f"position_std_mm: expected a number of at least 0, got {self.position_std_mm}")

    @property
    def positions_mm(self) -> FloatArray:
        """The holes' places (H, 3), mm in `box`."""
        return np.stack([each.position_mm for each in self.holes])

    @property
    def least_spacing_mm(self) -> float:
        """The distance of the two holes that are nearest to each other."""
        apart = np.linalg.norm(self.positions_mm[:, None] - self.positions_mm[None], axis=-1)
        return float(apart[~np.eye(len(self.holes), dtype=bool)].min())
