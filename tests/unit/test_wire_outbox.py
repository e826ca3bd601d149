"""One client's outbox: what is replaced, what is queued, and the window of messages in flight."""

import asyncio

import pytest

from cathxr.wire.outbox import Outbox


def _drain(outbox: Outbox) -> list[str]:
    return list(iter(outbox.take, None))


def test_the_newest_track_wins_and_the_others_are_counted() -> None:
    outbox = Outbox()
    for seq in range(5):
        outbox.offer_track(seq, f"track {seq}")
    assert _drain(outbox) == ["track 4"]
    assert outbox.skipped == 4


def test_queued_messages_come_first_and_in_order() -> None:
    outbox = Outbox()
    outbox.offer_track(0, "track")
    outbox.replace("health", "old health")
    outbox.replace("health", "health")
    outbox.put("a")
    outbox.put("b")
    assert _drain(outbox) == ["a", "b", "health", "track"]


def test_the_queue_is_bounded() -> None:
    outbox = Outbox(queue_limit=3)
    for name in "abcde":
        outbox.put(name)
    assert _drain(outbox) == ["c", "d", "e"]
    assert outbox.skipped == 2


def test_without_acknowledgements_nothing_is_held_back() -> None:
    outbox = Outbox(window=2)
    for seq in range(50):
        outbox.offer_track(seq, str(seq))
        assert outbox.take() == str(seq)
    assert outbox.in_flight == 0


def test_the_window_opens_with_each_acknowledgement() -> None:
    outbox = Outbox(window=3)
    outbox.offer_track(0, "0")
    assert outbox.take() == "0"
    outbox.acknowledge(0)
    for seq in (1, 2, 3, 4, 5):
        outbox.offer_track(seq, str(seq))
        assert outbox.take() == (str(seq) if seq <= 3 else None)
    assert outbox.in_flight == 3
    outbox.acknowledge(2)  # and with it 1
    assert outbox.in_flight == 1
    assert _drain(outbox) == ["5"]
    assert outbox.skipped == 1


@pytest.mark.parametrize("seq", [-1, 99, 2**70])
def test_acknowledging_what_was_not_sent_opens_nothing(seq: int) -> None:
    outbox = Outbox(window=1)
    outbox.offer_track(5, "5")
    outbox.take()
    outbox.acknowledge(seq)
    outbox.offer_track(6, "6")
    assert outbox.take() is None
    outbox.acknowledge(5)
    assert outbox.take() == "6"


def test_a_seq_that_starts_over_is_no_problem() -> None:
    outbox = Outbox(window=2)
    for seq in (8, 9, 0, 1, 2):
        outbox.offer_track(seq, str(seq))
        assert outbox.take() == str(seq)
        outbox.acknowledge(seq)
    assert outbox.in_flight == 0


def test_next_waits_until_something_may_be_sent() -> None:
    async def play() -> list[str]:
        outbox = Outbox(window=1)
        outbox.offer_track(0, "0")
        got = [await outbox.next()]
        outbox.acknowledge(7)
        outbox.offer_track(1, "1")
        waiting = asyncio.ensure_future(outbox.next())
        await asyncio.sleep(0)
        assert not waiting.done()
        outbox.acknowledge(0)
        return [*got, await waiting]

    assert asyncio.run(play()) == ["0", "1"]
