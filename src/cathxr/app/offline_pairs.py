"""Recorded pictures of both cameras as pairs with instants, decoded ahead by one thread for each camera."""

import queue
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Generic, TypeVar

from cathxr.core import DataError, Image, PixelArray
from cathxr.storage.pictures import Pictures
from cathxr.storage.tables import PictureTimes

_AHEAD = 4
_LOOK_S = 0.1
Item = TypeVar("Item")


def pair_count(top: Pictures, front: Pictures, times: PictureTimes | None) -> int | None:
    """Return how many pairs there are, None when only the end of a video tells.

    Raises:
        DataError: the two cameras or the table of times are known to differ in number.
    """
    counts = {top.name: top.count, front.name: front.count}
    known = [each for each in counts.values() if each is not None]
    if len(known) == 2 and known[0] != known[1]:
        raise _unequal(top, known[0], front, known[1])
    if known and times is not None and len(times.top_ns) != known[0]:
        raise _times_differ(len(times.top_ns), known[0])
    return known[0] if known else None


def read_pairs(
    top: Pictures, front: Pictures, *, rate_hz: float, times: PictureTimes | None = None
) -> Iterator[tuple[Image, Image]]:
    """Yield the pairs; `seq` is the pair's index. Without `times` both pictures are taken to be at seq / rate_hz.

    Raises:
        DataError: a picture is damaged, or the numbers of pictures or times turn out to differ at the end.
    """
    with decoded_ahead(top) as tops, decoded_ahead(front) as fronts:
        seq = 0
        while True:
            first, second = next(tops, None), next(fronts, None)
            if first is None and second is None:
                break
            if first is None or second is None:
                longer = fronts if first is None else tops
                total = seq + 1 + sum(1 for _ in longer)
                raise _unequal(top, seq if first is None else total, front, seq if second is None else total)
            if times is not None and seq >= len(times.top_ns):
                raise _times_differ(len(times.top_ns), seq + 1 + sum(1 for _ in tops))
            top_ns = round(seq * 1e9 / rate_hz) if times is None else int(times.top_ns[seq])
            front_ns = top_ns if times is None else int(times.front_ns[seq])
            yield Image("top", seq, top_ns, first), Image("front", seq, front_ns, second)
            seq += 1
        if times is not None and seq != len(times.top_ns):
            raise _times_differ(len(times.top_ns), seq)


@contextmanager
def decoded_ahead(pictures: Iterable[PixelArray]) -> Iterator[Iterator[PixelArray]]:
    """Give the pictures out of a thread that stays up to four ahead; leaving the block ends it."""
    ahead = _Ahead(pictures)
    try:
        ahead.start()
        yield iter(ahead)
    finally:
        ahead.stop()


class _Ahead(Generic[Item]):
    """Runs an iterable in a thread. What it raises is raised again where the items are taken."""

    def __init__(self, items: Iterable[Item]) -> None:
        self._items = items
        self._queue: queue.Queue[Item | None] = queue.Queue(_AHEAD)
        self._stopping = threading.Event()
        self._error: BaseException | None = None
        # No daemon: one that is inside a decoder when the interpreter ends takes the process down with it.
        self._thread = threading.Thread(target=self._run, name="decoder")

    def __iter__(self) -> Iterator[Item]:
        while (item := self._taken()) is not None:
            yield item
        if self._error is not None:
            raise self._error

    def start(self) -> None:
        """Begin to decode."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread and wait for it; it may not have begun, where Ctrl-C came in the middle of `start`."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        try:
            for item in () if self._stopping.is_set() else self._items:
                if not self._put(item):
                    return
        except BaseException as error:  # a thread's top: stored, and raised again by whoever takes the items
            self._error = error
        self._put(None)

    def _taken(self) -> Item | None:
        """Return the next item, None at the end. Waits in short steps, which Ctrl-C can break on every system."""
        while True:
            with suppress(queue.Empty):
                return self._queue.get(timeout=_LOOK_S)

    def _put(self, item: Item | None) -> bool:
        """Return whether the item found a place before `stop`."""
        while not self._stopping.is_set():
            with suppress(queue.Full):
                self._queue.put(item, timeout=_LOOK_S)
                return True
        return False


def _unequal(top: Pictures, tops: int, front: Pictures, fronts: int) -> DataError:
    return DataError(
        f"{top.name} holds {tops} pictures and {front.name} {fronts}: expected the same number, one of each for every "
        "pair; leave out the pictures without a partner."
    )


def _times_differ(rows: int, pairs: int) -> DataError:
    return DataError(
        f"the table of times has {rows} rows and there are {pairs} picture pairs: expected one row for each pair; "
        "correct --times."
    )
