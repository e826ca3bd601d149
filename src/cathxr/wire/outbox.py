"""What waits for one client: the newest Track and the newest view, and a bounded queue of what must not be replaced."""

import asyncio
from collections import deque

from cathxr.wire.messages import ACK_WINDOW

QUEUE_LIMIT = 256
"""Events and answers that may wait for one client; beyond it the oldest goes, and is counted."""


class Outbox:
    """The messages that wait for one client. For the event loop's thread only.

    A client that acknowledges Tracks has at most `window` of them in flight. One that never does is held back by its
    socket's buffers alone, which the server keeps small.
    """

    def __init__(self, *, window: int = ACK_WINDOW, queue_limit: int = QUEUE_LIMIT) -> None:
        if window < 1 or queue_limit < 1:
            raise ValueError(f"Outbox: expected a window and a limit of at least 1, got {window} and {queue_limit}")
        self.skipped = 0
        """Messages that this client did not get because newer ones had come."""
        self._window = window
        self._limit = queue_limit
        self._queue: deque[str] = deque()
        self._slots: dict[str, str] = {}
        self._track: tuple[int, str] | None = None
        self._view: str | None = None
        self._in_flight: deque[int] = deque(maxlen=window)
        self._acknowledges = False
        self._filled = asyncio.Event()

    @property
    def in_flight(self) -> int:
        """Tracks sent and not acknowledged; 0 for a client that never acknowledges."""
        return len(self._in_flight) if self._acknowledges else 0

    def put(self, text: str) -> None:
        """Queue a message that newer ones do not replace."""
        if len(self._queue) >= self._limit:
            self._queue.popleft()
            self.skipped += 1
        self._queue.append(text)
        self._filled.set()

    def replace(self, kind: str, text: str) -> None:
        """Set the one waiting message of a kind of which only the newest matters (health, session)."""
        self._slots[kind] = text
        self._filled.set()

    def offer_track(self, seq: int, text: str) -> None:
        """Set the waiting Track; one that still waits is skipped."""
        if self._track is not None:
            self.skipped += 1
        self._track = (seq, text)
        self._filled.set()

    def offer_view(self, text: str) -> None:
        """Set the waiting view of another client; one that still waits is replaced.

        It waits while too many Tracks are in flight: a client that has stalled must not find old views afterwards.
        """
        self._view = text
        self._filled.set()

    def drop_view(self) -> None:
        """Forget the view that waits: whom it is of is followed no more."""
        self._view = None

    def acknowledge(self, seq: int) -> None:
        """Take note that the client has handled the Track `seq`, and with it all that were sent before."""
        self._acknowledges = True
        if seq in self._in_flight:
            while self._in_flight.popleft() != seq:
                pass
        self._filled.set()

    async def next(self) -> str:
        """Return the next message to send, as soon as there is one that may be sent."""
        while (text := self.take()) is None:
            self._filled.clear()
            await self._filled.wait()
        return text

    def take(self) -> str | None:
        """Return the next message that may be sent now, None when there is none."""
        if self._queue:
            return self._queue.popleft()
        if self._slots:
            return self._slots.pop(next(iter(self._slots)))
        if self._acknowledges and len(self._in_flight) >= self._window:
            return None
        if self._view is not None:
            view, self._view = self._view, None
            return view
        if self._track is None:
            return None
        seq, text = self._track
        self._track = None
        self._in_flight.append(seq)
        return text
