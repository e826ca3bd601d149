"""Reads ready masks: label maps, DICOM segmentations, folders of masks (TotalSegmentator) or of surfaces (STL)."""

from pathlib import Path

from cathxr.core import DataError
from cathxr.heart.reading.archive import unpacked
from cathxr.heart.reading.dicom_seg import is_segmentation, read_segmentation
from cathxr.heart.reading.label_maps import named_files, read_label_map, read_mask_folder
from cathxr.heart.reading.parts import named_parts, read_parts
from cathxr.heart.reading.quiet import quiet
from cathxr.heart.reading.scan import VOLUME_ENDINGS, files_of
from cathxr.heart.reading.structure_names import key_of, vessel_of_wall
from cathxr.heart.volume import Grid, LabelVolume, Progress, Volume, silent

_PARTS = (".stl", ".ply")


def read_labels(
    path: Path, *, like: Volume | None, names: Path | None = None, progress: Progress = silent
) -> LabelVolume:
    """Return ready masks with the catalogue's labels, on the grid of `like` where given, each voxel by the nearest.

    path: a label map (NIfTI, NRRD, MetaImage), a DICOM segmentation, or a folder or ZIP archive of masks or of STL
    surfaces whose file names say what they are, as TotalSegmentator writes them. names: a TOML or CSV file that names
    the values of a label map.

    Raises:
        DataError: it cannot be read, or nothing says what the parts are.
        ConfigError: the names file is wrong.
    """
    grid = None if like is None else like.grid
    with quiet():
        if path.is_dir():
            return _of_folder(path, path, grid, names, progress)
        if not path.is_file():
            raise DataError(f"{path} is not there; give a label map, a DICOM segmentation, a folder of masks or STL.")
        if path.suffix.lower() == ".zip":
            with unpacked(path, progress=progress, name_of=_safe_name) as folder:
                return _of_folder(folder, path, grid, names, progress)
        if path.name.lower().endswith(VOLUME_ENDINGS):
            return read_label_map(path, path, like=grid, names=names)
        if path.suffix.lower() in _PARTS:
            return _of_files([path], path, grid, names, progress)
        if is_segmentation(path):
            return read_segmentation(path, path, like=grid, progress=progress)
    raise DataError(
        f"{path} is no label map (NIfTI, NRRD) and no DICOM segmentation; give one, or a folder of masks or STL."
    )


def _of_folder(folder: Path, path: Path, like: Grid | None, names: Path | None, progress: Progress) -> LabelVolume:
    return _of_files(files_of(folder), path, like, names, progress)


def _of_files(files: list[Path], path: Path, like: Grid | None, names: Path | None, progress: Progress) -> LabelVolume:
    maps = [each for each in files if each.name.lower().endswith(VOLUME_ENDINGS)]
    if masks := named_files(maps):
        _tell_left_out(len(maps) - len(masks), progress)
        return read_mask_folder(masks, path, like=like, progress=progress)
    if len(maps) == 1:
        return read_label_map(maps[0], path, like=like, names=names)
    surfaces = [each for each in files if each.suffix.lower() in _PARTS]
    if parts := named_parts(surfaces):
        _tell_left_out(len(surfaces) - len(parts), progress)
        return read_parts(parts, path, like=like, progress=progress)
    segmentations = [each for each in files if not maps and not surfaces and is_segmentation(each)]
    if len(segmentations) == 1:
        return read_segmentation(segmentations[0], path, like=like, progress=progress)
    if segmentations:
        raise DataError(f"{path} holds {len(segmentations)} DICOM segmentations; give one of the files.")
    if maps or surfaces:
        raise DataError(
            f"{path} holds {len(maps) + len(surfaces)} masks or surfaces and none has a structure's name; name them as "
            "left_ventricle.nii.gz or lv_cavity.stl (docs/heart-data.md lists the names)."
        )
    raise DataError(f"{path} holds no masks; give a folder of NIfTI masks, of STL parts, or with a DICOM segmentation.")


def _tell_left_out(count: int, progress: Progress) -> None:
    if count:
        progress(f"Leaving out {count} file{'s' * (count > 1)} whose name is no structure's of a heart", None)


def _safe_name(name: str) -> str:
    """Return what may be kept of a file's name in an archive: the structure that it means."""
    last = name.replace("\\", "/").rsplit("/", 1)[-1]
    vessel = vessel_of_wall(last)
    return f"{vessel}_wall" if vessel else key_of(last) or ""
