"""Reads NIfTI, NRRD and MetaImage files with ITK: as volumes of HU, or as they are, for label maps."""

import gzip
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import SimpleITK as sitk

from cathxr.core import DataError, FloatArray
from cathxr.heart.reading.contrast import Contrast, contrast_of
from cathxr.heart.reading.pixels import FILL_HU
from cathxr.heart.reading.summary import SeriesSummary, orientation_of
from cathxr.heart.volume import Grid, Progress, Technical, Volume

MAX_VOXELS = 1 << 30
"""Six times a 512x512x600 scan. A file that declares more is damaged, or a bomb."""

_STEP = 1 << 22
_ORTHOGONAL = 1e-3
_NO_AIR_HU = -200.0
_NO_ORIENTATION = "The file says nothing about its orientation: taken as it is stored."


@dataclass(frozen=True)
class _Header:
    """Size and placement of a file, before its voxels are read. times: volumes in it."""

    size: tuple[int, ...]
    times: int
    components: int
    is_oriented: bool


def read_volume_file(file: Path, path: Path, *, phase: str | float | None, progress: Progress) -> Volume:
    """Return the CT of a file. path: what errors name, the folder or archive that the file was found in.

    Raises:
        DataError: it is damaged, too large, sheared, holds several volumes, or holds no Hounsfield units.
    """
    progress("Reading the file", None)
    header = _header(file, path)
    time = _time(path, header, phase)
    values, grid = read_grid(file, path, time=time)
    hu = _hounsfield(values, path)
    contrast = contrast_of(hu, grid.spacing_mm.tolist())
    words = "" if header.times == 1 else f"volume {time + 1} of {header.times}, as asked"
    remarks = () if header.is_oriented else (_NO_ORIENTATION,)
    return Volume(hu, grid, Technical("CT", phase=words, contrast=contrast.is_bright, remarks=remarks))


def summary_of_file(file: Path, path: Path) -> list[SeriesSummary]:
    """Return the summary of a file: one series; its volumes as phases "1", "2", … where it holds several.

    Raises:
        DataError: it is damaged, too large or sheared.
    """
    header = _header(file, path)
    values, grid = read_grid(file, path, time=0)
    problem, contrast = "", None
    try:
        contrast = contrast_of(_hounsfield(values, path), grid.spacing_mm.tolist())
    except DataError as error:
        problem = str(error)
    depth, rows, columns = grid.shape
    spacing = grid.spacing_mm.tolist()
    return [_summary(header, (columns, rows, depth), spacing, grid, problem=problem, contrast=contrast)]


def _summary(
    header: _Header,
    size: tuple[int, int, int],
    spacing: list[float],
    grid: Grid,
    *,
    problem: str,
    contrast: Contrast | None,
) -> SeriesSummary:
    several = header.times > 1
    remarks = () if header.is_oriented else (_NO_ORIENTATION,)
    return SeriesSummary(
        number=1,
        problem=problem,
        slices=size[2],
        size=size[:2],
        spacing_mm=(spacing[0], spacing[1], spacing[2]),
        extent_mm=(spacing[0] * size[0], spacing[1] * size[1], spacing[2] * size[2]),
        orientation=orientation_of(grid.ct_from_voxel[:3, :2] / grid.spacing_mm[:2]),
        phases=tuple(str(each + 1) for each in range(header.times)) if several else (),
        chosen="",
        contrast=contrast,
        technical=Technical(
            "CT" if contrast is not None else "unknown",
            contrast=None if contrast is None else contrast.is_bright,
            remarks=remarks,
        ),
    )


def read_grid(file: Path, path: Path, *, time: int = 0) -> tuple[npt.NDArray[Any], Grid]:
    """Return the voxels (K, J, I) as stored, and their grid, right-handed and in `ct`.

    Raises:
        DataError: the file is damaged, too large, of colours, or its axes are not orthogonal.
    """
    header = _header(file, path)
    if header.components != 1:
        raise DataError(
            f"{path} holds {header.components} values in each voxel, where one is needed; give another file."
        )
    _check_whole(file, path)
    try:
        image = sitk.ReadImage(str(file))
    except RuntimeError:
        raise DataError(f"{path} is damaged, cut off or not what its name says; copy or export it again.") from None
    if len(header.size) == 4:
        image = image[:, :, :, time]
    if image.GetDimension() != 3:
        raise DataError(f"{path} is a single picture, not a volume; give the whole scan.")
    spacing, direction = np.array(image.GetSpacing()), np.array(image.GetDirection()).reshape(3, 3)
    if np.abs(direction.T @ direction - np.eye(3)).max() > _ORTHOGONAL:
        raise DataError(f"{path} has axes that are not orthogonal; resample it to a regular grid first.")
    matrix: FloatArray = np.eye(4)
    matrix[:3, :3] = _orthonormal(direction) * spacing
    matrix[:3, 3] = image.GetOrigin()
    values = sitk.GetArrayFromImage(image)
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        values, matrix = _turned(values, matrix)
    depth, rows, columns = values.shape
    return values, Grid((depth, rows, columns), matrix)


def _check_whole(file: Path, path: Path) -> None:
    """Refuse a gzip file that was cut off: ITK would take what is missing for zeros."""
    with file.open("rb") as raw:
        if raw.read(2) != b"\x1f\x8b":
            return
    try:
        with gzip.open(file) as unpacked:
            while unpacked.read(_STEP):
                pass
    except (OSError, EOFError, zlib.error):
        raise DataError(f"{path} is damaged, cut off or not what its name says; copy or export it again.") from None


def _turned(values: npt.NDArray[Any], matrix: FloatArray) -> tuple[npt.NDArray[Any], FloatArray]:
    """Return a left-handed volume with its slices in the other order: right-handed, every voxel where it was."""
    turned = matrix.copy()
    turned[:3, 2] = -matrix[:3, 2]
    turned[:3, 3] = matrix[:3, 3] + matrix[:3, 2] * (values.shape[0] - 1)
    return np.ascontiguousarray(values[::-1]), turned


def _orthonormal(direction: FloatArray) -> FloatArray:
    """Return the nearest orthonormal axes: the file's own are rounded."""
    left, _, right = np.linalg.svd(direction)
    return np.asarray(left @ right)


def _header(file: Path, path: Path) -> _Header:
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(file))
    try:
        reader.ReadImageInformation()
    except RuntimeError:
        raise DataError(f"{path} is damaged, cut off or not what its name says; copy or export it again.") from None
    size = tuple(int(each) for each in reader.GetSize())
    if np.prod([float(each) for each in size]) * reader.GetNumberOfComponents() > MAX_VOXELS:
        raise DataError(f"{path} declares {' x '.join(map(str, size))} voxels, more than a scan has; check the file.")
    codes = [reader.GetMetaData(each) for each in ("qform_code", "sform_code") if reader.HasMetaDataKey(each)]
    return _Header(
        size=size,
        times=size[3] if len(size) == 4 else 1,
        components=int(reader.GetNumberOfComponents()),
        is_oriented=not codes or any(each.strip() not in ("", "0", "NIFTI_XFORM_UNKNOWN") for each in codes),
    )


def _time(path: Path, header: _Header, phase: str | float | None) -> int:
    """Return the index of the volume to read."""
    if header.times == 1:
        if phase is not None:
            raise DataError(f"{path} says nothing about phases, so --phase cannot choose one; leave it out.")
        return 0
    text = "" if phase is None else str(phase).strip().removesuffix(".0")
    if text.isdigit() and 1 <= int(text) <= header.times:
        return int(text) - 1
    raise DataError(
        f"{path} holds {header.times} volumes and does not tell which one is end-diastole; "
        f"choose with --phase a number from 1 to {header.times}."
    )


def _hounsfield(values: npt.NDArray[Any], path: Path) -> npt.NDArray[np.int16]:
    """Return the values as HU, refusing what cannot be."""
    finite = values
    if values.dtype.kind == "f":
        finite = np.nan_to_num(values, nan=FILL_HU, posinf=32767.0, neginf=FILL_HU)
    lowest, highest = float(finite.min()), float(finite.max())
    if lowest > _NO_AIR_HU:
        if lowest >= 0.0 and highest > 1500.0:
            raise DataError(
                f"{path} holds values from {lowest:.0f} to {highest:.0f}, not Hounsfield units, in which air is −1000: "
                "an MR, or a CT without its offset; convert the CT again, with its rescale applied."
            )
        raise DataError(
            f"{path} holds values from {lowest:.0f} to {highest:.0f}, not Hounsfield units, in which air is −1000; "
            "give the CT itself (a mask is given with --labels)."
        )
    if finite.dtype.kind == "f":
        finite = np.rint(finite)
    return np.ascontiguousarray(np.clip(finite, -32768, 32767).astype(np.int16))
