"""Deletes the session folders of a participant, and nothing else."""

import shutil
import uuid
from collections.abc import Iterable
from pathlib import Path

from cathxr.core import DataError
from cathxr.storage.atomic import os_reason

_MARK = "session.toml"


def session_folders(root: Path, sessions: Iterable[str]) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Return the folders of sessions below `root`, and the names of those that are not there (any more).

    Raises:
        DataError: a session lies outside `root`, or its folder is no session's: nothing of it is to be deleted.
    """
    there, missing = [], []
    base = root.resolve()
    for name in sessions:
        path = (base / name).resolve()
        if path == base or not path.is_relative_to(base):
            raise DataError(f"{name}: this recording is not below {root}; give the folder of the recordings.")
        if not path.exists():
            missing.append(name)
        elif not (path / _MARK).is_file():
            raise DataError(f"{path}: expected a session with a {_MARK}, got something else; nothing was deleted.")
        else:
            there.append(path)
    return tuple(there), tuple(missing)


def delete_folders(folders: Iterable[Path]) -> None:
    """Delete session folders. Each is renamed first, so that none stays that looks whole and is not.

    Raises:
        DataError: one cannot be deleted; the sentence names it, and doing it again goes on.
    """
    for folder in folders:
        aside = folder.with_name(f".{folder.name}.{uuid.uuid4().hex[:8]}.deleted")
        try:
            folder.rename(aside)
            shutil.rmtree(aside)
        except OSError as error:
            left = aside if aside.exists() else folder
            raise DataError(
                f"{left}: the recording cannot be deleted ({os_reason(error)}); delete it by hand or change its "
                "permissions, then do it again: the participant's rows are still there."
            ) from error
