"""A folder that is whole or not there: made beside its place, then moved into it."""

import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cathxr.core import DataError
from cathxr.storage.atomic import os_reason

_SIGN = "params.toml"
_SCHEMA = "cathxr-hardware/"


def check_place(out: Path) -> None:
    """Return when a folder can be made at `out`: nothing is there, an empty folder, or an earlier export.

    Raises:
        DataError: something else is there, or the folder above does not exist or refuses.
    """
    if out.exists() and not out.is_dir():
        raise DataError(f"{out}: expected a folder for the export, got a file; choose another name.")
    if out.is_dir() and any(out.iterdir()) and not _is_export(out):
        raise DataError(f"{out}: this folder holds other things than an export; choose another or an empty one.")
    above = out.absolute().parent
    if not above.is_dir():
        raise DataError(f"{out}: the folder {above} does not exist; make it first or choose another.")
    if not os.access(above, os.W_OK):
        raise DataError(f"{out}: nothing can be written into {above}; choose a folder you may write to.")


@contextmanager
def folder_made_whole(out: Path) -> Iterator[Path]:
    """Yield an empty folder that takes the place of `out` when the block ends well, and is removed when it does not.

    Raises:
        DataError: the operating system refuses; what was at `out` is as it was.
    """
    place = Path(os.path.realpath(out))
    part = place.with_name(f".{place.name}.{uuid.uuid4().hex[:12]}.part")
    try:
        part.mkdir()
        yield part
        _swap(part, place)
    except OSError as error:
        raise DataError(f"{out}: cannot write it ({os_reason(error)}); check the folder and the disk.") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _swap(part: Path, place: Path) -> None:
    if not place.exists():
        part.rename(place)
        return
    old = part.with_suffix(".old")
    place.rename(old)
    try:
        part.rename(place)
    except OSError:
        old.rename(place)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _is_export(folder: Path) -> bool:
    try:
        return _SCHEMA in (folder / _SIGN).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False
