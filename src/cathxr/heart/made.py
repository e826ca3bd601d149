"""What a heart was made from and what was made of it, before it is a folder."""

from collections.abc import Sequence
from dataclasses import dataclass

from cathxr.heart.model import HeartSource
from cathxr.heart.openings import Places
from cathxr.heart.surfaces import PartSurface
from cathxr.heart.volume import LabelVolume, Volume


@dataclass(frozen=True, eq=False)
class Made:
    """All that the heart folder and its quality page tell. findings: sentences about what is missing or doubtful."""

    name: str
    volume: Volume | None
    labels: LabelVolume
    parts: Sequence[PartSurface]
    places: Places
    findings: tuple[str, ...]
    source: HeartSource
    budget: int
