"""Unpacks a ZIP archive into a folder of its own: numbered files, so that no name in it leads anywhere or is shown."""

import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cathxr.core import DataError
from cathxr.heart.volume import Progress, silent

_CHUNK = 1 << 20
_ENCRYPTED = 0x1


@dataclass(frozen=True)
class Limits:
    """What an archive may hold. ratio: unpacked to packed size, over the whole archive; CT packs 2 to 10 times."""

    files: int = 50_000
    total_bytes: int = 32 << 30
    ratio: float = 100.0
    small_bytes: int = 64 << 20
    """Below this total no ratio is too high: little masks pack a thousandfold, and harm nobody."""


@contextmanager
def unpacked(
    path: Path,
    *,
    limits: Limits | None = None,
    name_of: Callable[[str], str] | None = None,
    progress: Progress = silent,
) -> Iterator[Path]:
    """Yield a temporary folder with the archive's files; it is gone at the end.

    Files are numbered in name order and keep their ending only (".nii.gz"), and what `name_of` makes of their names.

    Raises:
        DataError: the archive is damaged, encrypted, or unpacks to more than `limits` allow.
    """
    chosen = limits or Limits()
    with tempfile.TemporaryDirectory(prefix="cathxr-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        try:
            with zipfile.ZipFile(path) as archive:
                _unpack(archive, folder, path, chosen, name_of or _no_name, progress)
        except (zipfile.BadZipFile, zlib.error, EOFError, ValueError, LookupError, UnicodeError):
            raise DataError(f"{path} is a damaged ZIP archive; copy or export it again.") from None
        except NotImplementedError:
            raise DataError(
                f"{path} is packed by a method that is not supported; pack it as an ordinary ZIP archive."
            ) from None
        except OSError as error:
            raise DataError(f"{path} cannot be unpacked ({error.strerror}); check the file and the disk.") from None
        yield folder


def _unpack(
    archive: zipfile.ZipFile,
    folder: Path,
    path: Path,
    limits: Limits,
    name_of: Callable[[str], str],
    progress: Progress,
) -> None:
    entries = [each for each in archive.infolist() if not each.is_dir()]
    entries.sort(key=lambda each: each.filename)
    if any(each.flag_bits & _ENCRYPTED for each in entries):
        raise DataError(f"{path} is encrypted; unpack it with its password and give the folder.")
    declared, packed = sum(each.file_size for each in entries), max(path.stat().st_size, 1)
    _check(path, limits, files=len(entries), total=declared, packed=packed)
    if declared > shutil.disk_usage(folder).free:
        raise DataError(f"{path} needs {declared / 1e9:.1f} GB to unpack and there is less free; unpack it elsewhere.")
    total = 0
    for number, entry in enumerate(entries):
        progress("Unpacking", number / len(entries))
        kept = name_of(entry.filename)
        name = f"{number:06d}{'_' if kept else ''}{kept}{_ending(entry.filename)}"
        with archive.open(entry) as source, (folder / name).open("wb") as target:
            # What the directory of the archive declares may be a lie: what comes out is counted.
            while piece := source.read(_CHUNK):
                total += len(piece)
                _check(path, limits, files=len(entries), total=total, packed=packed)
                target.write(piece)


def _check(path: Path, limits: Limits, *, files: int, total: int, packed: int) -> None:
    if files > limits.files:
        raise DataError(f"{path} holds {files} files, more than {limits.files}; pack the one series that you need.")
    if total > limits.total_bytes or (total > limits.small_bytes and total > limits.ratio * packed):
        raise DataError(
            f"{path} unpacks to far more than a CT could ({total / 1e9:.1f} GB or more from {packed / 1e6:.1f} MB), so "
            "it was not unpacked; if you trust it, unpack it yourself and give the folder."
        )


def _no_name(_name: str) -> str:
    return ""


def _ending(name: str) -> str:
    """Return the ending of a file's name where it says what the file is, else ""."""
    known = (".nii.gz", ".nii", ".nrrd", ".nhdr", ".raw", ".mha", ".stl", ".ply")
    return next((each for each in known if name.lower().endswith(each)), "")
