"""What joins the threads: bounded queues that count what they lose. One with a bound of one is a slot."""

import time
from collections import deque
from threading import Condition
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Queue(Generic[Item]):
    """Holds up to `bound` items in order. When full, the oldest goes, or the new one is refused (`keep_oldest`).

    With a bound of one the newest wins: for whoever wants the present and not the past.
    """

    def __init__(self, bound: int, *, keep_oldest: bool = False) -> None:
        if bound < 1:
            raise ValueError(f"bound: expected at least 1, got {bound}")
        self._changed = Condition()
        self._items: deque[Item] = deque()
        self._bound = bound
        self._keep_oldest = keep_oldest
        self._losses = 0
        self._closed = False

    def put(self, item: Item) -> bool:
        """Append `item`; return whether it was taken. Never blocks."""
        with self._changed:
            if self._closed:
                return False
            full = len(self._items) >= self._bound
            self._losses += full
            if full and self._keep_oldest:
                return False
            if full:
                self._items.popleft()
            self._items.append(item)
            self._changed.notify()
            return True

    def get(self, timeout_s: float) -> Item | None:
        """Return and remove the oldest item, None when none came in `timeout_s` or the queue is closed and empty."""
        with self._changed:
            if not self._items and not self._closed:
                self._changed.wait_for(lambda: bool(self._items) or self._closed, max(0.0, timeout_s))
            return self._items.popleft() if self._items else None

    def close(self) -> None:
        """Take nothing more; what is inside can still be taken."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def finished(self) -> bool:
        """Whether it is closed and empty."""
        with self._changed:
            return self._closed and not self._items

    @property
    def losses(self) -> int:
        """How many items were lost for want of room."""
        with self._changed:
            return self._losses

    def __len__(self) -> int:
        with self._changed:
            return len(self._items)


class Deadline:
    """How much of a wait is left, in real time: whatever clock stamps the data, a thread waits in this one."""

    def __init__(self, timeout_s: float) -> None:
        self._end = time.monotonic() + max(0.0, timeout_s)

    @property
    def left_s(self) -> float:
        """Seconds left, at least 0."""
        return max(0.0, self._end - time.monotonic())
