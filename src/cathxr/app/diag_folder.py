"""Where measurements of devices are kept: one JSON file each, in the folder `diag` beside the recordings."""

import datetime
from pathlib import Path

from cathxr.core import DataError
from cathxr.storage.atomic import os_reason, written_whole

MOST_FILES = 1000
"""Files that the folder may hold before no more are written: nobody needs as many, and a disk has an end."""


class DiagFolder:
    """Keeps measurements. Made with the first of them."""

    def __init__(self, recordings: Path) -> None:
        self._folder = recordings / "diag"

    def save(self, kind: str, text: str) -> str:
        """Write a measurement's text and return the name of its file.

        Raises:
            DataError: it cannot be written, or the folder is full.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            count = sum(1 for _ in self._folder.glob("*.json"))
        except OSError as error:
            raise DataError(f"The folder {self._folder.name} cannot be used ({os_reason(error)}).") from error
        if count >= MOST_FILES:
            raise DataError(f"The folder {self._folder.name} holds {count} measurements: take some away first.")
        instant = datetime.datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
        name, number = f"{instant}_{kind}.json", 1
        while (self._folder / name).exists():
            number += 1
            name = f"{instant}_{kind}-{number}.json"
        with written_whole(self._folder / name) as part:
            part.write_text(text, encoding="utf-8", newline="\n")
        return name
