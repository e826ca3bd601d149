"""The newest picture of each camera, as JPEG: made on demand only, once per picture and width, for all clients."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2

from cathxr.core import Image, PixelArray
from cathxr.wire.convert import seconds

JPEG_QUALITY = 70
WIDTH_STEP_PX = 160
"""Widths are rounded up to a multiple of this, so that clients share pictures and cannot ask for a thousand sizes."""
RESTART_GAP = 100
"""A client that asks for pictures after one this far ahead of the newest remembers another run: it gets the newest."""


@dataclass(frozen=True, eq=False)
class Picture:
    """One camera's picture and the index of its pair."""

    image: Image
    seq: int

    @property
    def t_s(self) -> float:
        """Mid-exposure, seconds of the host's monotonic clock."""
        return seconds(self.image.t_ns)


class Pictures:
    """Takes pictures from any thread; gives them to requests in the event loop's thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._newest: dict[str, Picture] = {}
        self._waiting: dict[str, set[asyncio.Future[None]]] = {}
        self._made: dict[tuple[str, int], tuple[tuple[int, int], asyncio.Future[bytes]]] = {}
        self._worker: ThreadPoolExecutor | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    def bind(self, loop: asyncio.AbstractEventLoop) -> None:
        """Serve requests in `loop` from now on."""
        with self._lock:
            self._loop = loop
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="cathxr-jpeg")

    def unbind(self) -> None:
        """End every wait (each request gets no picture), and let the worker go. In the loop's thread."""
        with self._lock:
            self._loop = None
            waiting = [each for futures in self._waiting.values() for each in futures]
        for future in waiting:
            if not future.done():
                future.set_result(None)
        self._made.clear()
        if self._worker is not None:
            self._worker.shutdown(wait=False, cancel_futures=True)
            self._worker = None

    def publish(self, image: Image, *, seq: int) -> None:
        """Make `image` the newest of its camera. `seq`: the index of its pair. From any thread; never blocks."""
        with self._lock:
            self._newest[image.camera] = Picture(image, seq)
            if self._loop is not None and self._waiting.get(image.camera):
                self._loop.call_soon_threadsafe(self._wake, image.camera)

    def waiting(self, camera: str) -> int:
        """Return how many requests wait for a newer picture of `camera`. From any thread."""
        with self._lock:
            return len(self._waiting.get(camera, ()))

    async def newer(self, camera: str, *, after: int, timeout_s: float) -> Picture | None:
        """Return the camera's newest picture as soon as its seq is greater than `after`; None after `timeout_s`."""
        loop = asyncio.get_running_loop()
        deadline = loop.time() + timeout_s
        while True:
            future: asyncio.Future[None] = loop.create_future()
            with self._lock:
                picture = self._newest.get(camera)
                if picture is not None and (picture.seq > after or picture.seq < after - RESTART_GAP):
                    return picture
                left_s = deadline - loop.time()
                if left_s <= 0 or self._loop is None:
                    return None
                self._waiting.setdefault(camera, set()).add(future)
            try:
                await asyncio.wait_for(future, left_s)
            except TimeoutError:
                return None
            finally:
                with self._lock:
                    self._waiting[camera].discard(future)

    async def jpeg(self, picture: Picture, *, width_px: int | None) -> bytes | None:
        """Return `picture` as JPEG, at most `width_px` rounded up to a step wide; None when the server stops."""
        full = picture.image.size_px[0]
        width = full if width_px is None else min(full, -(-width_px // WIDTH_STEP_PX) * WIDTH_STEP_PX)
        key, identity = (picture.image.camera, width), (picture.seq, picture.image.t_ns)
        made = self._made.get(key)
        if made is None or made[0] != identity:
            if self._worker is None:
                return None
            future = asyncio.get_running_loop().run_in_executor(self._worker, encoded_jpeg, picture.image.pixels, width)
            made = self._made[key] = (identity, future)
        try:
            # Shielded: a client that leaves must not take the picture away from those who share it.
            return await asyncio.shield(made[1])
        except asyncio.CancelledError:
            if made[1].cancelled():  # the worker was let go
                return None
            raise

    def _wake(self, camera: str) -> None:
        with self._lock:
            waiting = list(self._waiting.get(camera, ()))
        for future in waiting:
            if not future.done():
                future.set_result(None)


def encoded_jpeg(pixels: PixelArray, width_px: int) -> bytes:
    """Return `pixels` (H, W) or (H, W, 3) BGR as JPEG, `width_px` wide, its shape kept.

    Raises:
        ValueError: the picture cannot be encoded.
    """
    height, width = pixels.shape[:2]
    if width_px != width:
        size = (width_px, max(1, round(height * width_px / width)))
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA).astype(pixels.dtype, copy=False)
    made, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not made:
        raise ValueError(f"pixels: expected a picture that JPEG can hold, got shape {pixels.shape}")
    return data.tobytes()
