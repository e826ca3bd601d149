"""Voxels in space: a CT volume, and the labels of structures on such a grid."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.core.arrays import checked

Progress = Callable[[str, float | None], None]
"""Called with what is being done, and the share of it that is done (0 to 1), or None where that is not known."""


def silent(_what: str, _share: float | None) -> None:
    """Show no progress."""


@dataclass(frozen=True)
class Technical:
    """What a series says about how it was made: all that ever leaves the reader. Nothing in it can name anybody.

    phase: how the cardiac phase was chosen, in words, or "" where the series says nothing about it.
    kernel, manufacturer_model: as far as they match the known vocabulary of such values, else "".
    """

    modality: str
    phase: str = ""
    kernel: str = ""
    slice_thickness_mm: float | None = None
    tube_voltage_kv: float | None = None
    contrast: bool | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Grid:
    """A regular grid of voxels with orthogonal axes, right-handed.

    shape (K, J, I): slices, rows, columns. ct_from_voxel (4, 4): (i, j, k, 1) of a voxel's centre to mm in `ct`.
    """

    shape: tuple[int, int, int]
    ct_from_voxel: FloatArray

    def __post_init__(self) -> None:
        matrix = checked("ct_from_voxel", self.ct_from_voxel, (4, 4))
        object.__setattr__(self, "ct_from_voxel", matrix)
        axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
        if not np.allclose(axes.T @ axes, np.eye(3), atol=1e-4) or np.linalg.det(axes) < 0.0:
            raise ValueError("ct_from_voxel: the axes are not orthogonal and right-handed")

    @property
    def spacing_mm(self) -> FloatArray:
        """Distance between voxel centres along i, j and k: (3,) mm."""
        return np.asarray(np.linalg.norm(self.ct_from_voxel[:3, :3], axis=0))

    @property
    def voxel_ml(self) -> float:
        """Volume of one voxel, mL."""
        return float(np.prod(self.spacing_mm)) / 1000.0

    def to_ct(self, ijk: npt.ArrayLike) -> FloatArray:
        """Return points (…, 3) mm in `ct` of voxel coordinates (…, 3) in the order i, j, k."""
        return np.asarray(np.asarray(ijk, float) @ self.ct_from_voxel[:3, :3].T + self.ct_from_voxel[:3, 3])

    def to_voxel(self, points_ct: npt.ArrayLike) -> FloatArray:
        """Return voxel coordinates (…, 3) in the order i, j, k of points (…, 3) mm in `ct`."""
        inverse = np.linalg.inv(self.ct_from_voxel)
        return np.asarray(np.asarray(points_ct, float) @ inverse[:3, :3].T + inverse[:3, 3])


@dataclass(frozen=True, eq=False)
class Volume:
    """A CT volume. hu: int16 (K, J, I), Hounsfield units, read-only."""

    hu: npt.NDArray[np.int16]
    grid: Grid
    technical: Technical

    def __post_init__(self) -> None:
        if self.hu.dtype != np.int16 or self.hu.shape != self.grid.shape:
            raise ValueError(f"hu: expected int16 of shape {self.grid.shape}, got {self.hu.dtype} {self.hu.shape}")
        self.hu.setflags(write=False)


@dataclass(frozen=True, eq=False)
class LabelVolume:
    """Which structure each voxel belongs to. labels: uint8 (K, J, I), read-only, 0 is none.

    names: the structure's key (see `anatomy`) by label; a label without a name is an error. counts (256,): how many
    voxels each label has.
    """

    labels: npt.NDArray[np.uint8]
    grid: Grid
    names: Mapping[int, str] = field(default_factory=dict)
    counts: npt.NDArray[np.int64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        labels: npt.NDArray[Any] = self.labels
        if labels.dtype != np.uint8 or labels.shape != self.grid.shape:
            raise ValueError(f"labels: expected uint8 of shape {self.grid.shape}, got {labels.dtype} {labels.shape}")
        # Slice by slice: counting all at once would need eight bytes for each voxel.
        counts = sum((np.bincount(each.ravel(), minlength=256) for each in labels), np.zeros(256, np.int64))
        counts.setflags(write=False)
        object.__setattr__(self, "counts", counts)
        if nameless := [int(each) for each in np.flatnonzero(counts[1:]) + 1 if int(each) not in self.names]:
            raise ValueError(f"labels: no name for the values {nameless}")
        self.labels.setflags(write=False)
        object.__setattr__(self, "names", MappingProxyType(dict(self.names)))

    def mask(self, key: str) -> npt.NDArray[np.bool_]:
        """Return where (K, J, I) the structure `key` is; nowhere when it has no label."""
        values = self._values(key)
        mask = np.equal(self.labels, values[0]) if values else np.zeros(self.grid.shape, np.bool_)
        for value in values[1:]:
            mask |= self.labels == value
        return np.asarray(mask)

    def voxels(self, key: str) -> int:
        """Return how many voxels the structure has."""
        return int(self.counts[self._values(key)].sum())

    def volume_ml(self, key: str) -> float:
        """Return the volume of the structure's voxels, mL."""
        return float(self.voxels(key)) * self.grid.voxel_ml

    def _values(self, key: str) -> list[int]:
        return [label for label, name in self.names.items() if name == key]
