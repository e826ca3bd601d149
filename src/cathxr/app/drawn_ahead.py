"""The twin's cameras draw their empty box while the rest of the system loads: a start is shorter by that."""

import threading
from contextlib import suppress
from types import TracebackType
from typing import Self

from cathxr.core import Image, Source
from cathxr.twin.drivers import TwinCamera


def drawn_ahead(camera: Source[Image]) -> Source[Image]:
    """Return the camera; of the twin: one that gets ready from now on, in a thread of its own, and opens when it is."""
    return _DrawnAhead(camera) if isinstance(camera, TwinCamera) else camera


class _DrawnAhead:
    """A Source[Image]: the camera, which is opened no earlier than it is ready."""

    def __init__(self, camera: TwinCamera) -> None:
        self._camera = camera
        self._thread = threading.Thread(target=self._draw, name=f"draw-{camera.camera}", daemon=True)
        self._thread.start()

    @property
    def losses(self) -> int:
        """As the camera's."""
        return self._camera.losses

    def __enter__(self) -> Self:
        self._thread.join()
        self._camera.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._camera.__exit__(kind, error, trace)

    def read(self, timeout_s: float) -> Image | None:
        """Return the next picture, None when none came in time."""
        return self._camera.read(timeout_s)

    def _draw(self) -> None:
        with suppress(Exception):  # what fails here fails again, and is told, when the camera is opened
            self._camera.get_ready()
