"""Files that are either complete or not there: written beside their place, then moved into it."""

import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from cathxr.core import DataError


def os_reason(error: OSError) -> str:
    """Return why the operating system refused, as a short phrase such as "No space left on device"."""
    return error.strerror or str(error) or type(error).__name__


class AtomicFile:
    """A path to write to (`part`) that becomes `target` on `commit` and vanishes on `abort`."""

    def __init__(self, target: Path) -> None:
        self.target = Path(os.path.realpath(target))
        self.part = self.target.with_name(f".{self.target.name}.{uuid.uuid4().hex[:12]}.part")

    def commit(self, *, backup: bool = False) -> None:
        """Put `part` in the place of `target`; with `backup`, an earlier target is kept beside it.

        Raises:
            DataError: the operating system refuses; `part` is removed then.
        """
        try:
            if self.target.exists():
                shutil.copymode(self.target, self.part)
                if backup:
                    shutil.copy2(self.target, _free_backup(self.target))
            os.replace(self.part, self.target)
        except OSError as error:
            self.abort()
            raise DataError(
                f"{self.target}: cannot write it ({os_reason(error)}); check the folder and the disk."
            ) from error

    def abort(self) -> None:
        """Remove `part`, where there is one."""
        with suppress(OSError):
            self.part.unlink(missing_ok=True)


@contextmanager
def written_whole(target: Path, *, backup: bool = False) -> Iterator[Path]:
    """Yield a temporary path that becomes `target` when the block ends well and is removed when it does not.

    Raises:
        DataError: the operating system refuses to write.
    """
    file = AtomicFile(target)
    try:
        yield file.part
    except OSError as error:
        file.abort()
        raise DataError(f"{target}: cannot write it ({os_reason(error)}); check the folder and the disk.") from error
    except BaseException:
        file.abort()
        raise
    file.commit(backup=backup)


def check_writable(target: Path, *, what: str) -> None:
    """Return when a file can be made at `target`.

    Raises:
        DataError: the folder is missing or refuses, or `target` is a folder. `what` names the file in the sentence.
    """
    if target.is_dir():
        raise DataError(f"{target}: expected a file name for {what}, got a folder; add a name to the path.")
    folder = target.absolute().parent
    if not folder.is_dir():
        raise DataError(f"{target}: the folder for {what} does not exist; make {folder} first or choose another.")
    probe = AtomicFile(target)
    try:
        probe.part.touch(exist_ok=False)
    except OSError as error:
        raise DataError(
            f"{target}: cannot write {what} there ({os_reason(error)}); choose a folder you may write to."
        ) from error
    finally:
        probe.abort()


def _free_backup(target: Path) -> Path:
    """Return a backup name that is not taken: rig.toml.bak, rig.toml.bak2, ..."""
    number = 1
    while True:
        path = target.with_name(f"{target.name}.bak{number if number > 1 else ''}")
        if not path.exists():
            return path
        number += 1
