"""Label maps (NIfTI, NRRD, MetaImage), and folders of one mask for each structure, as TotalSegmentator writes them."""

import gzip
import re
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import SimpleITK as sitk

from cathxr.core import DataError
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.reading.label_names import names_for, read_names
from cathxr.heart.reading.painting import Canvas, onto
from cathxr.heart.reading.structure_names import key_of
from cathxr.heart.reading.volume_files import read_grid
from cathxr.heart.volume import Grid, LabelVolume, Progress

_MAX_LABELS = 512
_NIFTI_HEADER = 348
_MAX_EXTENSION = 1 << 20
_LABEL = re.compile(rb'<Label[^>]*?Key="(\d{1,5})"[^>]*>([^<]{1,100})<')


def read_label_map(file: Path, path: Path, *, like: Grid | None, names: Path | None) -> LabelVolume:
    """Return a label map with the catalogue's labels, on the grid of `like` or its own. path: what errors name.

    Raises:
        DataError: it cannot be read, is no label map, or nothing says what its values are.
        ConfigError: the names file is wrong.
    """
    stored, grid = read_grid(file, path)
    values = _whole(stored, path)
    found = np.unique(values)
    found = found[found != 0]
    if len(found) == 0:
        raise DataError(f"{path} holds no label: every voxel is 0; check that it is the right file.")
    if len(found) > _MAX_LABELS:
        raise DataError(f"{path} holds {len(found)} different values, as pictures do, not labels; give a label map.")
    wanted = [int(each) for each in found]
    keys = read_names(names) if names else names_for(path, wanted, own=_own_names(file), stem=file.name)
    if missing := [each for each in wanted if each not in keys]:
        raise DataError(f"{names} names no structure for the labels {missing[:12]} of {path}; add them to it.")
    lowest = min(0, wanted[0])
    table = np.zeros(wanted[-1] - lowest + 1, np.uint8)
    used = {key for each in wanted if (key := keys[each])}
    for each in wanted:
        key = keys[each]
        table[each - lowest] = CATALOGUE[key].label if key else 0
    if not used:
        raise DataError(f"{path} holds no structure of a heart by its names; known are {', '.join(CATALOGUE)}.")
    labels = table[values - lowest]
    target = like or grid
    return LabelVolume(onto(labels, grid, target), target, {CATALOGUE[key].label: key for key in sorted(used)})


def read_mask_folder(
    files: Sequence[tuple[str, Path]], path: Path, *, like: Grid | None, progress: Progress
) -> LabelVolume:
    """Return masks of one structure each as labels, on the grid of `like` or that of the first. files: keys and files.

    Raises:
        DataError: a mask cannot be read, or all of them are empty.
    """
    canvas = Canvas(like) if like else None
    is_empty = True
    for number, (key, file) in enumerate(files):
        progress(f"Reading the mask of the {CATALOGUE[key].name.lower()}", number / len(files))
        stored, grid = read_grid(file, path)
        mask = (np.nan_to_num(stored) > _half(stored)).astype(np.uint8)
        canvas = canvas or Canvas(grid)
        placed = onto(mask, grid, canvas.grid)
        if placed.any():
            is_empty = False
            canvas.paint(key, placed != 0)
    if canvas is None or is_empty:
        raise DataError(f"{path}: all masks of the heart are empty on the scan's grid; check that they fit it.")
    return canvas.finished()


def named_files(paths: Sequence[Path]) -> list[tuple[str, Path]]:
    """Return the files whose names are structures', with their keys."""
    return [(key, each) for each in paths if (key := key_of(each.name))]


def _half(stored: npt.NDArray[Any]) -> float:
    """Return the threshold of a mask: a half of a probability; any value but 0 of whole numbers."""
    return 0.5 if stored.dtype.kind == "f" else 0.0


def _whole(stored: npt.NDArray[Any], path: Path) -> npt.NDArray[np.int64]:
    if stored.dtype.kind == "f":
        rounded = np.rint(stored)
        if not np.isfinite(stored).all() or np.abs(stored - rounded).max() > 1e-3:
            raise DataError(f"{path} holds fractions, as pictures and probabilities do, not labels; give a label map.")
        stored = rounded
    if stored.min() < -32768 or stored.max() > 65535:
        raise DataError(f"{path} holds values beyond 65535, which are no labels; give a label map.")
    return stored.astype(np.int32)


def _own_names(file: Path) -> dict[int, str]:
    """Return the structures' names by value that a file itself holds; {} where it holds none."""
    name = file.name.lower()
    if name.endswith(".nrrd"):
        return _names_of_slicer(file)
    return _names_of_extension(file) if name.endswith((".nii", ".nii.gz")) else {}


def _names_of_slicer(file: Path) -> dict[int, str]:
    """Return the segments of a 3D Slicer segmentation (.seg.nrrd)."""
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(file))
    reader.ReadImageInformation()
    names = {}
    for number in range(_MAX_LABELS):
        name, value = f"Segment{number}_Name", f"Segment{number}_LabelValue"
        if not (reader.HasMetaDataKey(name) and reader.HasMetaDataKey(value)):
            break
        text = reader.GetMetaData(value).strip()
        if text.isdigit():
            names[int(text)] = reader.GetMetaData(name)
    return names


def _names_of_extension(file: Path) -> dict[int, str]:
    """Return the label table in a NIfTI file's extension, which TotalSegmentator writes into a map of all labels."""
    with gzip.open(file) if file.name.lower().endswith(".gz") else file.open("rb") as opened:
        header = opened.read(_NIFTI_HEADER)
        order = "<" if header[:4] == _NIFTI_HEADER.to_bytes(4, "little") else ">"
        voxels_at = struct.unpack(f"{order}f", header[108:112])[0]
        extension = opened.read(int(min(max(voxels_at - _NIFTI_HEADER, 0.0), _MAX_EXTENSION)))
    found = _LABEL.findall(extension)
    return {int(key): name.decode("utf-8", errors="replace") for key, name in found}
