"""A label volume made small enough for a browser: cut to what is labelled, with fewer voxels along each side."""

import numpy as np

from cathxr.core import DataError
from cathxr.heart.boxes import box_around
from cathxr.heart.volume import Grid, LabelVolume


def label_texture(volume: LabelVolume, *, most: int = 192) -> LabelVolume:
    """Return the labelled part of a volume, at most `most` voxels long, one voxel of nothing all around it.

    Each voxel has the label of the nearest one of `volume`: labels cannot be averaged. The nearest voxel outside is
    nothing, so that a texture that repeats its rim for ever is right everywhere.

    Raises:
        DataError: nothing is labelled.
        ValueError: `most` is not from 16 to 512.
    """
    if not 16 <= most <= 512:
        raise ValueError(f"most: expected 16 to 512, got {most}")
    box = box_around(volume.labels != 0)
    if box is None:
        raise DataError("The label volume is empty: build the heart again.")
    inside = most - 2  # the rim
    spacing = volume.grid.spacing_mm[::-1]
    low = np.array([each.start for each in box])
    counts = np.array([each.stop for each in box]) - low
    extent_mm = counts * spacing
    # No finer than the labels are: voxels that only repeat their neighbours are of no use.
    steps_mm = np.maximum(spacing, float(extent_mm.max()) / inside)
    fewer = np.minimum(np.ceil(extent_mm / steps_mm - 1e-6).astype(int), inside)
    steps = extent_mm / fewer / spacing  # in voxels of the source, along k, j, i
    at = [np.minimum((start + (np.arange(n) + 0.5) * step).astype(int), start + length - 1)
          for start, length, n, step in zip(low, counts, fewer, steps, strict=True)]  # fmt: skip
    labels = np.pad(volume.labels[np.ix_(*at)], 1)
    matrix = volume.grid.ct_from_voxel.copy()
    step_ijk = steps[::-1]
    first = low[::-1] - 0.5 + 0.5 * step_ijk - step_ijk  # the rim's centre
    matrix[:3, 3] = volume.grid.to_ct(first)
    matrix[:3, :3] = volume.grid.ct_from_voxel[:3, :3] * step_ijk
    return LabelVolume(labels, Grid((labels.shape[0], labels.shape[1], labels.shape[2]), matrix), volume.names)
