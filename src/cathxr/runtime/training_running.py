"""Which trials run: a trial that another program runs into the same recordings was not cut off."""

import os
import re
import socket
import threading
from collections.abc import Callable
from pathlib import Path

from cathxr.core import ConfigError
from cathxr.storage.held_file import HeldFile, Holder, holder_of

FOLDER = ".running"
"""Below that of the recordings: a file for each trial that runs, held by whoever runs it."""


class RunningTrials:
    """Holds the trials of this program, and knows those of others. Any thread may call.

    recordings: the path of their folder; "" where nothing is recorded, and then nothing is held either. utc: the
    instant in UTC, ISO 8601.
    """

    def __init__(self, recordings: str, *, utc: Callable[[], str]) -> None:
        self._folder = Path(recordings) / FOLDER if recordings else None
        self._utc, self._host = utc, socket.gethostname()
        self._lock = threading.Lock()
        self._mine: dict[str, HeldFile] = {}

    def take(self, trial: str) -> None:
        """Hold a trial that begins.

        Raises:
            ConfigError: it runs elsewhere.
            DataError: it cannot be held: the disk is full, or the folder refuses.
        """
        with self._lock:
            if trial in self._mine or self._folder is None:
                return
            held = HeldFile.held(self._path(trial), Holder(self._host, os.getpid(), self._utc()))
            if held is not None:
                self._mine[trial] = held
                return
        raise ConfigError(f"This trial cannot begin here: {self.words(trial) or 'it has just begun elsewhere.'}")

    def let_go(self, trial: str) -> None:
        """Hold a trial no more: its numbers are stored, or it did not begin after all."""
        with self._lock:
            held = self._mine.pop(trial, None)
            if held is not None:
                held.let_go()

    def close(self) -> None:
        """Hold nothing any more."""
        for trial in tuple(self._mine):
            self.let_go(trial)

    def elsewhere(self, trial: str) -> Holder | None:
        """Return which other program runs a trial; None where none does."""
        with self._lock:
            if trial in self._mine or self._folder is None:
                return None
        return holder_of(self._path(trial), host=self._host)

    def words(self, trial: str) -> str:
        """Return where a trial runs, as a sentence; "" where it does nowhere."""
        holder = self.elsewhere(trial)
        if holder is None:
            return ""
        if not holder.certain:
            return (
                f"It was begun on the computer {holder.host}, and may run there, which cannot be seen from here: if it "
                "does not, mark it invalid."
            )
        where = "this computer" if holder.host == self._host else f"the computer {holder.host}"
        number = f" (process {holder.process})" if holder.process else ""
        return f"It is running now, in another program on {where if holder.host else 'this computer'}{number}."

    def _path(self, trial: str) -> Path:
        assert self._folder is not None
        return self._folder / re.sub(r"[^A-Za-z0-9_-]", "_", trial)[:80]
