"""Pictures of results, as PNG in memory: what a calibration has measured, for its page."""

import hashlib
import re
import threading

_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}\Z")


class Results:
    """PNGs by name, at /calibration/NAME.png. From any thread; a newer one of a name replaces the earlier."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._pictures: dict[str, tuple[bytes, str]] = {}

    def put(self, name: str, png: bytes) -> str:
        """Keep a picture and return its path on the server.

        Raises:
            ValueError: a name that is not lower-case letters, digits, - and _.
        """
        if not _NAME.match(name):
            raise ValueError(f"name: expected lower-case letters, digits, - and _, got {name!r}")
        with self._lock:
            self._pictures[name] = (png, f'"{hashlib.sha256(png).hexdigest()[:32]}"')
        return f"/calibration/{name}.png"

    def get(self, name: str) -> tuple[bytes, str] | None:
        """Return a picture with its entity tag, None where there is none of that name."""
        with self._lock:
            return self._pictures.get(name)
