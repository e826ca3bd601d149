"""The atlas: where the structures lie in one real heart, and how its shape becomes a belief about another."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.segmentation.distances import distance_to, distance_within
from cathxr.heart.segmentation.model_heart import labelled_heart
from cathxr.heart.volume import Grid, LabelVolume

STRUCTURES = tuple(key for key, each in CATALOGUE.items() if each.label <= 10)
"""What the atlas knows as blood, in the order of its distance maps."""
CHAMBERS = STRUCTURES[:4]
_RING_MM = 8.0
_WALL_MM, _FADING_MM, _VESSEL_WEIGHT = 10.0, 15.0, 0.3
_SPACING_MM = 2.0
_FINE = 2
_MARGIN_MM = 30.0
_FILE = "atlas.npz"


@dataclass(frozen=True, eq=False)
class Atlas:
    """labels: the heart's voxels, upright. distances (S, K, J, I): mm to each of STRUCTURES, negative within it.

    near (K, J, I): the heart and a ring about it, where the atlas says something. weight (K, J, I): how much it is to
    be believed there; its vessels run more differently from one person to the next than its chambers.
    """

    labels: LabelVolume
    distances: npt.NDArray[np.float32]
    near: npt.NDArray[np.bool_]
    weight: npt.NDArray[np.float32]

    @property
    def blood(self) -> npt.NDArray[np.bool_]:
        """Where (K, J, I) any structure's blood is."""
        return np.asarray((self.labels.labels > 0) & (self.labels.labels <= len(STRUCTURES)))


def make_atlas(stl_folder: Path, out: Path) -> None:
    """Write the atlas file of the real heart's surfaces: every voxel holds what fills most of it.

    Raises:
        DataError: a surface is missing or damaged.
    """
    fine = labelled_heart(stl_folder, _SPACING_MM / _FINE)
    shape = tuple(size // _FINE for size in fine.labels.shape)
    cut = fine.labels[tuple(slice(0, size * _FINE) for size in shape)]
    blocks = cut.reshape(shape[0], _FINE, shape[1], _FINE, shape[2], _FINE)
    shares = [(blocks == label).mean(axis=(1, 3, 5), dtype=np.float32) for label in range(12)]
    labels = np.argmax(shares, axis=0).astype(np.uint8)
    (box,) = ndimage.find_objects((labels > 0).astype(np.uint8))
    origin = fine.grid.to_ct(np.array([each.start * _FINE + (_FINE - 1) / 2.0 for each in reversed(box)]))
    np.savez_compressed(out, labels=labels[box], origin_mm=origin, spacing_mm=_SPACING_MM)


def load_atlas() -> Atlas:
    """Return the built-in atlas with a margin all round."""
    with (resources.files(__package__) / _FILE).open("rb") as file, np.load(file) as data:
        spacing = float(data["spacing_mm"])
        margin = round(_MARGIN_MM / spacing)
        labels = np.pad(data["labels"], margin)
        matrix = np.diag([spacing, spacing, spacing, 1.0])
        matrix[:3, 3] = data["origin_mm"] - margin * spacing
    names = {each.label: each.key for each in CATALOGUE.values()}
    volume = LabelVolume(labels, Grid(labels.shape, matrix), names)
    distances = np.stack([signed_distance(labels == CATALOGUE[key].label, spacing) for key in STRUCTURES])
    near = distance_to(labels > 0, spacing) < _RING_MM
    chambers = distances[: len(CHAMBERS)].min(axis=0)
    weight = np.clip(1.0 - (chambers - _WALL_MM) / _FADING_MM, _VESSEL_WEIGHT, 1.0)
    return Atlas(volume, distances, near, weight.astype(np.float32))


def signed_distance(mask: npt.NDArray[np.bool_], spacing_mm: float) -> npt.NDArray[np.float32]:
    """Return the distance mm of each voxel to the mask's edge, negative within it."""
    return distance_to(mask, spacing_mm) - distance_within(mask, spacing_mm)
