"""The seeds file that the seeds' page writes."""

from collections.abc import Sequence
from pathlib import Path

from cathxr.core import DataError
from cathxr.heart.seeds import Seed, write_seeds
from cathxr.storage.atomic import os_reason, written_whole


class SeedsWriter:
    """Writes the seeds file. What was there before the page began is kept beside it."""

    def __init__(self, out: Path) -> None:
        self._out = out
        self._has_backup = False

    def save(self, seeds: Sequence[Seed]) -> None:
        """Write the seeds.

        Raises:
            DataError: the operating system refuses. The sentence is for the page, and names no path.
        """
        try:
            with written_whole(self._out, backup=not self._has_backup) as part:
                write_seeds(part, seeds)
        except DataError as error:
            cause = error.__cause__
            why = os_reason(cause) if isinstance(cause, OSError) else "see the console"
            raise DataError(f"The seeds could not be written ({why}): check the folder and the disk.") from error
        self._has_backup = True
