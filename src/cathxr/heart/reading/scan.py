"""Looks through a folder: which files are DICOM pictures, and what else is there."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cathxr.core import DataError
from cathxr.heart.reading.elements import UNREADABLE
from cathxr.heart.reading.frames import Frame, read_frames
from cathxr.heart.volume import Progress, silent

VOLUME_ENDINGS = (".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd")
MAX_FILES = 200_000


@dataclass(frozen=True)
class Scan:
    """What a folder holds. damaged: numbers (from 1, in name order) of files that begin as DICOM and break off.

    without_pictures: DICOM files such as reports; others: files that are not DICOM.
    """

    frames: tuple[Frame, ...]
    damaged: tuple[int, ...]
    without_pictures: int
    others: int
    volumes: tuple[Path, ...]


def scan(folder: Path, *, progress: Progress = silent) -> Scan:
    """Return what is in the folder and in those below it.

    Raises:
        DataError: the folder cannot be looked through, or holds more files than a CT could have.
    """
    return scan_paths(files_of(folder), progress=progress)


def scan_paths(paths: Sequence[Path], *, progress: Progress = silent) -> Scan:
    """Return what the files are; their numbers count from 1 in the order given."""
    frames: list[Frame] = []
    damaged, empty, others, volumes = [], 0, 0, []
    for number, path in enumerate(paths, start=1):
        if number % 50 == 1:
            progress("Looking through the files", number / len(paths))
        if path.name.lower().endswith(VOLUME_ENDINGS):
            volumes.append(path)
            continue
        try:
            found = read_frames(path, number)
        except (*UNREADABLE, OSError):
            damaged.append(number)
            continue
        if found is None:
            others += 1
        elif not found:
            empty += 1
        else:
            frames += found
    return Scan(tuple(frames), tuple(damaged), empty, others, tuple(volumes))


def files_of(folder: Path) -> list[Path]:
    """Return every file in the folder and below it, in name order, hidden ones left out."""
    paths: list[Path] = []

    def refuse(error: OSError) -> None:
        raise DataError(f"{folder} cannot be looked through ({error.strerror}); check its permissions.") from None

    for here, below, names in os.walk(folder, onerror=refuse):
        below[:] = sorted(each for each in below if not each.startswith("."))
        paths += [Path(here) / each for each in sorted(names) if not each.startswith(".")]
        if len(paths) > MAX_FILES:
            raise DataError(f"{folder} holds more than {MAX_FILES} files; give the folder of the one study.")
    return [each for each in paths if each.is_file()]
