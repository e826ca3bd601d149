"""What was found of the fiducials in one camera's picture."""

from dataclasses import dataclass

from cathxr.core import FloatArray
from cathxr.core.arrays import checked


@dataclass(frozen=True, eq=False)
class FoundMarker:
    """One fiducial in a picture.

    centre_px (2,): the projection of the fiducial's centre, raw (distorted) pixels; sigma_px: its standard deviation
    along each axis; radius_px: apparent radius (0 where unknown); placed: a person placed it.
    """

    name: str
    colour: str
    centre_px: FloatArray
    sigma_px: float
    radius_px: float = 0.0
    placed: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_px", checked("centre_px", self.centre_px, (2,)))
        if not self.sigma_px > 0:
            raise ValueError(f"sigma_px: expected a positive number, got {self.sigma_px}")


@dataclass(frozen=True, eq=False)
class Blob:
    """A coloured spot that might be a fiducial. name: the marker it was taken for, "" for none; why: why not."""

    colour: str
    centre_px: FloatArray
    radius_px: float
    name: str = ""
    why: str = ""


@dataclass(frozen=True, eq=False)
class Sighting:
    """The fiducials in one picture of `camera`.

    markers: those found, of both crosses. blobs: everything that was considered. missing: names that should be there
    and were not found. ambiguous: names for which more than one spot would do. problem: None when the markers suffice
    for a pose, else a sentence that says which are missing or ambiguous and what to do.
    """

    camera: str
    size_px: tuple[int, int]
    markers: tuple[FoundMarker, ...] = ()
    blobs: tuple[Blob, ...] = ()
    missing: tuple[str, ...] = ()
    ambiguous: tuple[str, ...] = ()
    problem: str | None = None
