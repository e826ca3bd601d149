"""What takes items never blocks whoever gives them, and never raises: whatever is behind it."""

import threading
from collections.abc import Callable

import pytest

from cathxr.core import Detection, Event, Health, Observation, Status, Track
from cathxr.devices.clock import ManualClock
from cathxr.runtime.fanout import Fanout
from cathxr.runtime.moment import Moment
from cathxr.runtime.queues import Queue
from cathxr.runtime.recorder import Recorder
from cathxr.wire.hub import Hub

LONG_S = 60.0
"""Only ever waited for by a test that fails."""
COUNT = 5000


def moment(seq: int) -> Moment:
    missing = tuple(Detection(name, -1, seq, reason=f"no picture from {name}") for name in ("top", "front"))
    return Moment(Track(seq, seq, Status.LOST, reason="test"), Observation(seq, seq, missing))


class HungDisk:
    """A session on a disk that never answers."""

    def __init__(self) -> None:
        self.released = threading.Event()

    def _wait(self, _: object) -> None:
        self.released.wait(LONG_S)

    write_reading = write_observation = write_track = write_truth = write_event = write_health = write_image = _wait

    def flush_if_due(self) -> None:
        pass

    def close(self) -> None:
        pass


def broken_fanout() -> Callable[[Moment], object]:
    fanout: Fanout[Moment] = Fanout()

    def fails(_: Moment) -> None:
        raise OSError("broken")

    fanout.add("broken", fails)
    return fanout.write


def full_slot() -> Callable[[Moment], object]:
    slot: Queue[Moment] = Queue(1)
    return slot.put


def full_queue() -> Callable[[Moment], object]:
    queue: Queue[Moment] = Queue(4)
    return queue.put


def hung_recorder(request: pytest.FixtureRequest) -> Callable[[Moment], object]:
    disk = HungDisk()
    request.addfinalizer(disk.released.set)
    recorder = Recorder(
        lambda: disk, clock=ManualClock(), request_reset=lambda: None, failed=lambda text: None, bound=16
    )
    recorder.start()
    recorder.note_reset(0)
    return recorder.moment


def hub_without_server() -> Callable[[Moment], object]:
    hub = Hub()

    def publish(each: Moment) -> None:
        hub.publish_track(each.track)
        hub.publish_event(Event(each.track.t_ns, "test"))
        hub.publish_health((Health(each.track.t_ns, "top", True, None, 0.0, 0),), t_ns=each.track.t_ns)

    return publish


@pytest.mark.parametrize("kind", ["fanout", "slot", "queue", "recorder", "hub"])
def test_writing_neither_blocks_nor_raises(kind: str, request: pytest.FixtureRequest) -> None:
    makers = {"fanout": broken_fanout, "slot": full_slot, "queue": full_queue, "hub": hub_without_server}
    write = hung_recorder(request) if kind == "recorder" else makers[kind]()
    errors: list[BaseException] = []

    def give() -> None:
        try:
            for seq in range(COUNT):
                write(moment(seq))
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=give, daemon=True)
    thread.start()
    thread.join(LONG_S)
    assert not thread.is_alive()
    assert errors == []
