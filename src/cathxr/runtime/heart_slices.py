"""The slices that the seeds' page asks for: a CT, and the newest labels of it under one numbering."""

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cathxr.core import DataError
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.slices import Hanging, PlaneName, hanging, slice_of
from cathxr.heart.volume import LabelVolume, Volume

_FIRST_OTHER = 100  # for structures that are not in the catalogue
_SAME_MM = 0.05

Box = tuple[tuple[int, int, int], tuple[int, int, int]]
"""The first and the last voxel (x, y, z), as seen, of what is labelled."""


@dataclass(frozen=True, eq=False)
class _Shown:
    version: int
    hung: npt.NDArray[np.uint8]
    numbers: npt.NDArray[np.uint8]  # (256,) the page's number of each value
    keys: dict[int, str]  # by the page's number
    box: Box | None


class HeartSlices:
    """Serves slices, as `wire.heart_pages.SliceSource`. From any thread."""

    def __init__(self, volume: Volume) -> None:
        self.hanging: Hanging = hanging(volume.grid)
        self._grid = volume.grid
        self._hu = self.hanging.hung(volume.hu)
        self._lock = threading.Lock()
        self._shown: _Shown | None = None

    def show(self, labels: LabelVolume) -> None:
        """Serve these labels from now on, as a newer version.

        Raises:
            DataError: they are not on the CT's grid.
        """
        same = labels.grid.shape == self._grid.shape
        if not same or np.abs(labels.grid.ct_from_voxel - self._grid.ct_from_voxel).max() > _SAME_MM:
            raise DataError("The labels are not on the CT's grid of voxels: give labels made on this very CT.")
        numbers = np.zeros(256, np.uint8)
        keys = {}
        others = [key for key in dict.fromkeys(labels.names.values()) if key not in CATALOGUE]
        for value, key in labels.names.items():
            number = CATALOGUE[key].label if key in CATALOGUE else _FIRST_OTHER + others.index(key)
            numbers[value], keys[number] = number, key
        hung = self.hanging.hung(labels.labels)
        box = _box_of(hung)
        with self._lock:
            version = 1 if self._shown is None else self._shown.version + 1
            self._shown = _Shown(version, hung, numbers, keys, box)

    @property
    def version(self) -> int:
        """Number of the labels that are served, 0 before the first."""
        shown = self._now()
        return 0 if shown is None else shown.version

    @property
    def keys(self) -> dict[int, str]:
        """The structures of these labels, by their value in the slices."""
        shown = self._now()
        return {} if shown is None else dict(shown.keys)

    @property
    def box(self) -> Box | None:
        """Where the labels are; None where there are none."""
        shown = self._now()
        return None if shown is None else shown.box

    def ct(self, plane: PlaneName, index: int) -> bytes | None:
        """Return a slice's Hounsfield units, int16 little-endian, row by row; None where there is none."""
        return _bytes(self._hu, plane, index, np.dtype("<i2"))

    def labels(self, version: int, plane: PlaneName, index: int) -> bytes | None:
        """Return a slice's labels, uint8, row by row; None where there is none of that version."""
        shown = self._now()
        if shown is None or shown.version != version or (found := _slice(shown.hung, plane, index)) is None:
            return None
        return bytes(shown.numbers[found].tobytes())

    def hu_at(self, seen: tuple[int, int, int]) -> int:
        """Return the Hounsfield units of the voxel (x, y, z)."""
        return int(self._hu[seen[::-1]])

    def key_at(self, seen: tuple[int, int, int]) -> str:
        """Return the structure that the labels have at the voxel (x, y, z), "" for none."""
        shown = self._now()
        return "" if shown is None else shown.keys.get(int(shown.numbers[shown.hung[seen[::-1]]]), "")

    def _now(self) -> _Shown | None:
        with self._lock:
            return self._shown


def volumes_ml(labels: LabelVolume) -> dict[str, float]:
    """Return each structure's volume by its key, mL."""
    # As many values as fit go through bincount at once: it makes 8-byte integers of all that it is given.
    counts = sum(np.bincount(each.ravel(), minlength=256) for each in labels.labels)
    volumes: dict[str, float] = {}
    for value, key in labels.names.items():
        volumes[key] = volumes.get(key, 0.0) + float(np.asarray(counts)[value]) * labels.grid.voxel_ml
    return {key: volume for key, volume in volumes.items() if volume > 0.0}


def _box_of(hung: npt.NDArray[np.uint8]) -> Box | None:
    over_z = np.asarray(hung.any(axis=0))  # (Y, X)
    ranges = [np.flatnonzero(each) for each in (over_z.any(axis=0), over_z.any(axis=1), hung.any(axis=(1, 2)))]
    if ranges[0].size == 0:
        return None
    low, high = ([int(each[at]) for each in ranges] for at in (0, -1))
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def _bytes(hung: npt.NDArray[Any], plane: PlaneName, index: int, dtype: np.dtype[Any]) -> bytes | None:
    found = _slice(hung, plane, index)
    return None if found is None else found.astype(dtype, copy=False).tobytes()


def _slice(hung: npt.NDArray[Any], plane: PlaneName, index: int) -> npt.NDArray[Any] | None:
    try:
        return slice_of(hung, plane, index)
    except ValueError:
        return None
