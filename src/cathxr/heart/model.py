"""What a heart folder says: its source, its structures, and its openings and landmarks in `ct`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import numpy as np

from cathxr.core import FloatArray
from cathxr.core.arrays import checked
from cathxr.heart.acoustic_codes import CHANNELS, Scale
from cathxr.heart.volume import Grid, Technical


@dataclass(frozen=True)
class HeartSource:
    """Where the heart's shape comes from. changes: what was done to it. Never anything about a patient."""

    title: str
    authors: str
    url: str
    licence: str
    licence_url: str
    changes: str


@dataclass(frozen=True)
class Structure:
    """One named part. node: its name in heart.glb. label: its value in labels.nii.gz. colour: "#rrggbb", sRGB.

    opacity: 0 to 1, how it is best shown from outside. volume_ml: of the closed blood pool at full resolution; None for
    a vessel's stub, whose volume says nothing.
    """

    key: str
    name: str
    label: int
    node: str
    colour: str
    opacity: float = 1.0
    volume_ml: float | None = None


@dataclass(frozen=True, eq=False)
class Opening:
    """One hole in a structure: a valve or a vessel's mouth.

    centroid_mm (3,) mm in `ct`; normal (3,) unit in `ct`, out of the structure.
    diameter_mm: of the circle of equal area.
    """

    key: str
    name: str
    structure: str
    centroid_mm: FloatArray
    normal: FloatArray
    diameter_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centroid_mm", checked("centroid_mm", self.centroid_mm, (3,)))
        normal = checked("normal", self.normal, (3,))
        length = float(np.linalg.norm(normal))
        if abs(length - 1.0) > 1e-3:
            raise ValueError(f"normal: expected a vector of length 1, got length {length:.6g}")
        unit = normal / length
        unit.setflags(write=False)
        object.__setattr__(self, "normal", unit)


@dataclass(frozen=True, eq=False)
class Landmark:
    """One named point, position_mm (3,) mm in `ct`."""

    key: str
    name: str
    position_mm: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_mm", checked("position_mm", self.position_mm, (3,)))


@dataclass(frozen=True, eq=False)
class AcousticFile:
    """What heart.toml says about the acoustic volume's file: gzip of uint8 (K, J, I, 4), see docs/acoustic-volume.md.

    ct_from_voxel (4, 4): (i, j, k, 1) of a voxel's centre to mm in `ct`. scales: by channel. table: the tissue table.
    """

    file: Path
    shape: tuple[int, int, int]
    ct_from_voxel: FloatArray
    scales: Mapping[str, Scale]
    table: str

    def __post_init__(self) -> None:
        Grid(self.shape, self.ct_from_voxel)  # refuses axes that are no grid's
        object.__setattr__(self, "ct_from_voxel", checked("ct_from_voxel", self.ct_from_voxel, (4, 4)))
        if set(self.scales) != set(CHANNELS):
            raise ValueError(f"channels: expected {', '.join(CHANNELS)}, got {', '.join(self.scales)}")
        object.__setattr__(self, "scales", MappingProxyType(dict(self.scales)))


@dataclass(frozen=True, eq=False)
class HeartFolder:
    """A heart folder that has been read and checked.

    labels, registration, acoustic, technical are None where the file or the table is absent. technical: what the series
    says about how it was made, None where the heart was not made from one.
    """

    path: Path
    name: str
    source: HeartSource
    structures: Mapping[str, Structure]
    openings: Mapping[str, Opening]
    glb: Path
    landmarks: Mapping[str, Landmark] = field(default_factory=dict)
    labels: Path | None = None
    registration: Path | None = None
    acoustic: AcousticFile | None = None
    technical: Technical | None = None

    def __post_init__(self) -> None:
        for each in ("structures", "openings", "landmarks"):
            object.__setattr__(self, each, MappingProxyType(dict(getattr(self, each))))

    @property
    def points_ct(self) -> dict[str, FloatArray]:
        """Every named point (3,) mm in `ct`: landmarks, and openings by their centroids."""
        points = {key: opening.centroid_mm for key, opening in self.openings.items()}
        return points | {key: landmark.position_mm for key, landmark in self.landmarks.items()}
