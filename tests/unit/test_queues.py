"""Queues: the newest wins, the bound holds, losses are counted, and whoever waits is woken."""

import threading

import pytest

from cathxr.runtime.queues import Deadline, Queue

LONG_S = 30.0
"""Only ever waited for by a test that fails."""


def test_the_newest_wins_and_losses_are_counted() -> None:
    slot: Queue[int] = Queue(1)
    for number in range(5):
        slot.put(number)
    assert slot.get(0.0) == 4
    assert slot.get(0.0) is None
    assert slot.losses == 4


def test_a_waiting_thread_gets_what_comes() -> None:
    slot: Queue[str] = Queue(1)
    got: list[str | None] = []
    thread = threading.Thread(target=lambda: got.append(slot.get(LONG_S)))
    thread.start()
    slot.put("now")
    thread.join(LONG_S)
    assert got == ["now"]


@pytest.mark.parametrize("bound", [1, 3])
def test_closing_wakes_whoever_waits(bound: int) -> None:
    box: Queue[int] = Queue(bound)
    got: list[int | None] = []
    thread = threading.Thread(target=lambda: got.append(box.get(LONG_S)))
    thread.start()
    box.close()
    thread.join(LONG_S)
    assert got == [None]
    box.put(1)
    assert box.get(0.0) is None


def test_a_queue_keeps_order_and_drops_the_oldest() -> None:
    queue: Queue[int] = Queue(3)
    assert [queue.put(number) for number in range(5)] == [True] * 5
    assert [queue.get(0.0) for _ in range(4)] == [2, 3, 4, None]
    assert queue.losses == 2


def test_a_queue_that_keeps_the_oldest_refuses_the_new() -> None:
    queue: Queue[int] = Queue(2, keep_oldest=True)
    assert [queue.put(number) for number in range(3)] == [True, True, False]
    assert len(queue) == 2
    assert queue.losses == 1
    queue.close()
    assert not queue.finished  # what is inside can still be taken
    assert [queue.get(0.0), queue.get(0.0), queue.get(LONG_S)] == [0, 1, None]
    assert queue.finished


def test_nothing_is_lost_or_doubled_between_threads() -> None:
    queue: Queue[int] = Queue(10_000)
    threads = [
        threading.Thread(target=lambda first=first: [queue.put(first + number) for number in range(1000)])
        for first in (0, 1000, 2000)
    ]
    for thread in threads:
        thread.start()
    got = [queue.get(LONG_S) for _ in range(3000)]
    assert sorted(each for each in got if each is not None) == list(range(3000))
    assert queue.losses == 0


def test_wrong_bounds_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 1"):
        Queue(0)


def test_a_deadline_never_goes_below_zero() -> None:
    assert Deadline(-1.0).left_s == 0.0
    assert 0.0 < Deadline(LONG_S).left_s <= LONG_S
