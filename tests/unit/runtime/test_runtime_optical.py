"""The optical source among failing devices: cameras that die, stall, are missing, and come back."""

import threading
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from cathxr.core import DeviceError, DeviceLost, DeviceNotFound, EndOfStream, Reading, Status, Track
from cathxr.runtime.supervisor import RetryPolicy

Eventually = Callable[[Callable[[], bool]], None]


def tracked(track: Track) -> bool:
    return track.status is Status.TRACKED


def lost_to(camera: str) -> Callable[[Track], bool]:
    return lambda track: track.reason == f"no picture from {camera}"


def test_it_tracks_with_roll_and_latency(bench: Any) -> None:
    with bench.source:
        track = bench.until(lambda each: tracked(each) and each.roll_rad is not None)
        moments = [bench.source.read_moment(1.0) for _ in range(10)]
    assert track.latency_ns > 0
    # The roll is that of the picture's instant, which is before the encoder's newest count.
    assert 0 < track.roll_rad <= bench.rig.roll.angle_rad(bench.encoder.seq)
    assert [b.track.seq - a.track.seq for a, b in pairwise(moments)] == [1] * 9
    for moment in moments:
        assert set(moment.images) == {"top", "front"}
        assert moment.track.t_ns == moment.images["top"].t_ns == moment.observation.t_ns
        assert moment.observation.skew_ns == moment.images["front"].t_ns - moment.images["top"].t_ns
        assert moment.observation.seq == moment.track.seq


def test_the_views_are_detected_in_two_threads(bench: Any) -> None:
    with bench.source:
        bench.until(tracked)
        bench.until(tracked)
    assert bench.detectors["top"].threads == {threading.get_ident()}
    assert threading.get_ident() not in bench.detectors["front"].threads


def test_a_camera_that_dies_is_named_and_returns(bench: Any) -> None:
    with bench.source:
        bench.until(tracked)
        bench.front.missing = DeviceNotFound("The front camera is not there.")
        bench.front.error = DeviceLost("The front camera has gone.")
        lost = bench.until(lost_to("front"))
        assert lost.tip_box is None
        assert bench.health("front") == "The front camera is not there."
        assert bench.health("top") is None
        bench.front.missing = None
        bench.until(tracked)
        assert bench.health("front") is None
    assert bench.front.openings >= 3
    assert not bench.top.opened
    assert not bench.front.opened


def test_a_missing_camera_does_not_stop_the_other(bench: Any) -> None:
    bench.top.missing = DeviceNotFound("The top camera is not there.")
    with bench.source:
        bench.until(lost_to("top"))
        moment = bench.source.read_moment(5.0)
        assert set(moment.images) == {"front"}
        assert moment.track.t_ns == moment.images["front"].t_ns


def test_a_stalled_camera_is_named_after_the_stated_wait(bench: Any) -> None:
    with bench.source:
        bench.until(tracked)
        bench.top.stalled = True
        bench.until(lost_to("top"))
        bench.top.stalled = False
        bench.until(tracked)


def test_silence_of_both_cameras_is_not_taken_for_the_present(bench: Any) -> None:
    with bench.source:
        bench.until(tracked)
        bench.top.stalled = bench.front.stalled = True
        last = bench.until(lambda track: not tracked(track) and track.latency_ns is None)
        assert last.status is Status.LOST


def test_an_encoder_that_dies_takes_the_roll_with_it_and_nothing_else(bench: Any) -> None:
    with bench.source:
        bench.until(lambda track: track.roll_rad is not None)
        bench.encoder.error = DeviceLost("The encoder has gone.")
        bench.until(lambda track: tracked(track) and track.roll_rad is None)
        bench.until(lambda track: tracked(track) and track.roll_rad is not None)


@pytest.mark.parametrize("part", ["top", "front", "tracker"])
def test_an_error_in_our_own_parts_costs_one_pair_and_is_shown(
    bench: Any, part: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    resets: list[int] = []
    bench.source.resets.add("test", resets.append)
    with bench.source:
        bench.until(tracked)
        if part == "tracker":
            update, failing = bench.tracker.update, [ZeroDivisionError("of ours")]

            def fails_once(observation: Any) -> Track:
                if failing:
                    raise failing.pop()
                return update(observation)

            monkeypatch.setattr(bench.tracker, "update", fails_once)
        else:
            bench.detectors[part].error = ZeroDivisionError("of ours")
        lost = bench.until(lambda track: track.reason.startswith("internal error"))
        assert "ZeroDivisionError: of ours" in lost.reason
        assert bench.health("tracker") == "ZeroDivisionError: of ours"
        after = bench.until(tracked)
        assert bench.health("tracker") is None
    assert resets[-1] == lost.seq + 1  # begun anew with the very next pair
    assert after.seq > lost.seq


def test_a_reset_happens_between_two_pairs_and_is_told(bench: Any) -> None:
    resets: list[int] = []
    bench.source.resets.add("test", resets.append)
    with bench.source:
        before = bench.until(tracked)
        bench.source.request_reset()
        after = bench.until(tracked)
    assert resets[0] == 0  # each opening begins with one
    assert before.seq < resets[-1] <= after.seq
    assert bench.tracker.resets == bench.detectors["top"].resets == len(resets)


def test_it_ends_when_both_cameras_have_and_says_so_again(bench: Any) -> None:
    bench.top.ends_after = bench.front.ends_after = 20

    def read_to_the_end() -> int:
        count = 0
        while True:
            count += bench.source.read(1.0) is not None
            assert count < 100

    with bench.source:
        with pytest.raises(EndOfStream):
            read_to_the_end()
        with pytest.raises(EndOfStream):
            bench.source.read(0.0)


def test_it_can_be_closed_twice_and_opened_again(bench: Any) -> None:
    with bench.source:
        bench.until(tracked)
    bench.source.__exit__(None, None, None)
    with pytest.raises(DeviceError, match="before it is opened"):
        bench.source.read(0.0)
    with bench.source:
        assert bench.until(tracked).seq >= 0
        with pytest.raises(DeviceError, match="open already"):
            bench.source.__enter__()


def test_readings_go_to_their_takers_even_when_one_fails(bench: Any, eventually: Eventually) -> None:
    got: list[Reading] = []

    def fails(_: Reading) -> None:
        raise OSError("full")

    bench.source.readings.add("bad", fails)
    bench.source.readings.add("good", got.append)
    with bench.source:
        eventually(lambda: len(got) > 10)
        assert bench.health("bad") == "OSError: full"
    assert [b.seq - a.seq for a, b in pairwise(got)] == [1] * (len(got) - 1)


def test_when_tracking_is_slow_pairs_are_skipped_and_counted(bench: Any, eventually: Eventually) -> None:
    with bench.source:
        bench.until(tracked)
        seen = bench.top.seq
        eventually(lambda: bench.top.seq > seen + 60)  # nobody reads meanwhile
        first, second = bench.until(tracked), bench.until(tracked)
        tracker = next(each for each in bench.source.health(1) if each.source == "tracker")
    assert tracker.losses >= 30
    assert second.seq == first.seq + 1  # the running number is the Observations', not the pictures'
    # Whatever waited, the newest of it was taken: the bound is 16 pictures, 8 pairs.
    assert second.t_ns - first.t_ns < 16 * 10_000_000


def test_the_policy_doubles_up_to_its_bound() -> None:
    policy = RetryPolicy()
    assert [policy.wait_s(failures) for failures in (1, 2, 3, 4, 5, 6, 100)] == [0.5, 1.0, 2.0, 4.0, 5.0, 5.0, 5.0]
