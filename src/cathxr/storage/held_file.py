"""A file that one program holds: others can see who does, and however that program ends, it is let go of."""

import errno
import json
import os
import sys
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from cathxr.core import DataError
from cathxr.storage.atomic import os_reason

_LOCKED_BYTE = 1 << 30
"""Far behind the text: what is locked on Windows cannot be read by others."""
_TRIES, _PAUSE_S = 5, 0.02
"""Somebody who only looks holds a file for some microseconds too."""


@dataclass(frozen=True)
class Holder:
    """Who holds a file. certain: the operating system says so; else it was held on another host, and may be still."""

    host: str
    process: int
    since: str
    certain: bool = True


class HeldFile:
    """A file that this program holds until `let_go`, or until it ends in any way. Made by `held`."""

    def __init__(self, path: Path, handle: int) -> None:
        self._path, self._handle = path, handle

    @classmethod
    def held(cls, path: Path, holder: Holder) -> Self | None:
        """Return the file at `path`, made and held, with `holder` written into it; None where somebody else holds it.

        Raises:
            DataError: it cannot be made or written.
        """
        for _ in range(_TRIES):
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                handle = os.open(path, os.O_RDWR | os.O_CREAT | _BINARY, 0o666)
            except OSError as error:
                raise _refused(path, error) from error
            try:
                if _lock(handle) and _is_at(path, handle):
                    _write(handle, holder)
                    return cls(path, handle)
            except OSError as error:
                os.close(handle)
                raise _refused(path, error) from error
            os.close(handle)
            time.sleep(_PAUSE_S)
        return None

    def let_go(self) -> None:
        """Remove the file, and let others hold one of its name. Once more does nothing."""
        if self._handle < 0:
            return
        if sys.platform != "win32":
            with suppress(OSError):
                self._path.unlink()  # while it is held: nobody can have taken it in between
        os.close(self._handle)
        self._handle = -1
        if sys.platform == "win32":
            with suppress(OSError):
                self._path.unlink()


def holder_of(path: Path, *, host: str) -> Holder | None:
    """Return who holds the file at `path`; None where nobody does, or somebody of this host did who has ended.

    host: the name of this one. A file of another host whose lock is not seen here is held by nobody, or on a drive
    whose locks do not go through the network: `certain` is false then.
    """
    try:
        handle = os.open(path, os.O_RDWR | _BINARY)
    except OSError:
        return None
    try:
        free = _lock(handle)
        written = os.read(handle, 4096)
    except OSError:
        return Holder("", 0, "")
    finally:
        os.close(handle)
    try:
        values: dict[str, Any] = json.loads(written)
        holder = Holder(str(values["host"]), int(values["process"]), str(values["since"]), certain=not free)
    except (ValueError, KeyError, TypeError):  # not written yet, or no text of ours
        return None if free else Holder("", 0, "")
    return None if free and holder.host == host else holder


def _write(handle: int, holder: Holder) -> None:
    values = asdict(holder)
    del values["certain"]
    os.ftruncate(handle, 0)
    os.write(handle, (json.dumps(values) + "\n").encode())
    os.fsync(handle)


def _is_at(path: Path, handle: int) -> bool:
    """Return whether a file that is held is still the one of that name: whoever held it before may have removed it."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(handle))
    except FileNotFoundError:
        return False


def _refused(path: Path, error: OSError) -> DataError:
    return DataError(f"{path}: cannot be held ({os_reason(error)}); check the folder and the disk.")


if sys.platform == "win32":
    import msvcrt

    _BINARY = os.O_BINARY

    def _lock(handle: int) -> bool:
        os.lseek(handle, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        finally:
            os.lseek(handle, 0, os.SEEK_SET)
        return True

else:
    import fcntl

    _BINARY = 0
    _NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)

    def _lock(handle: int) -> bool:
        """Return whether a file is held now; on a drive that knows no locks everybody may hold it."""
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError as error:
            return error.errno in _NO_LOCKS
        return True
