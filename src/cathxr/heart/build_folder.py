"""Makes a heart folder beside its place and puts it there when it is whole."""

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from cathxr.core import DataError

MARK = "heart.toml"
"""The file that makes a folder a heart folder."""
OURS = (MARK, "heart.glb", "labels.nii.gz", "registration.toml", "quality.html")
OURS_BEGIN = ("acoustic.", "quality_")


def check_place(out: Path) -> None:
    """Return when a heart folder may be put at `out`.

    Raises:
        DataError: `out` is a file, or a folder that holds something else than a heart.
    """
    if out.is_dir():
        if not (out / MARK).is_file() and any(out.iterdir()):
            raise DataError(
                f"{out} holds other things and no {MARK}, so it is not a heart folder and is left alone; "
                "give --out a new folder, or a heart that is to be replaced."
            )
    elif out.exists():
        raise DataError(f"{out} is a file; give --out a folder for the heart.")


@contextlib.contextmanager
def replacing(out: Path, *, keeps: Callable[[Path], tuple[str, ...]]) -> Iterator[Path]:
    """Give a new, empty folder beside `out`, which takes its place when the block ends well.

    keeps: which of a heart's own files the new one takes over, by the old folder. Files that a person has put there
    are taken over too. When the block fails, nothing is left of it and `out` is as it was.

    Raises:
        DataError: `out` cannot be replaced (see `check_place`) or not be written.
    """
    out = Path(os.path.abspath(out))
    check_place(out)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        folder = out.with_name(f".{out.name}.{os.getpid()}.part")
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
    except OSError as error:
        raise _unwritable(out, error) from error
    try:
        try:
            yield folder
            if out.is_dir():
                _take_over(out, folder, keeps(out))
            _swap(folder, out)
        except OSError as error:
            raise _unwritable(out, error) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _take_over(old: Path, new: Path, kept: tuple[str, ...]) -> None:
    """Copy what a person has put into the old folder, and `kept`, which take the place of the new folder's."""
    for each in sorted(old.iterdir()):
        ours = each.name in OURS or each.name.startswith(OURS_BEGIN)
        if ours and each.name not in kept:
            continue
        if (new / each.name).exists():
            # A measured registration counts for more than the placement that a build makes up.
            (new / each.name).unlink()
        if each.is_dir():
            shutil.copytree(each, new / each.name, symlinks=True)
        else:
            shutil.copy2(each, new / each.name, follow_symlinks=False)


def _swap(folder: Path, out: Path) -> None:
    """Put `folder` at `out`; a failure puts back what was there."""
    if not out.exists():
        os.replace(folder, out)
        return
    # A folder that holds something cannot be replaced in one step: for a moment the old one has another name.
    aside = folder.with_suffix(".old")
    os.replace(out, aside)
    try:
        os.replace(folder, out)
    except BaseException:
        os.replace(aside, out)
        raise
    shutil.rmtree(aside, ignore_errors=True)


def _unwritable(out: Path, error: OSError) -> DataError:
    return DataError(
        f"{out} cannot be written ({error.strerror or type(error).__name__}); give --out a place that you may write to "
        "and that has room."
    )
