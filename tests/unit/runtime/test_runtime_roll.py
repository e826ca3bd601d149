"""The roll's validity in the live system, with the real driver on a board that restarts, vanishes and raves."""

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cathxr.app.record_command import _wait_for_roll
from cathxr.app.twin_encoder import FAULTS, TwinPort, fault_command, twin_encoder
from cathxr.core import CathxrError, ConfigError, Reading, RollStatus, Status, Track
from cathxr.devices.clock import MonotonicClock
from cathxr.devices.encoder_stream import MISCOUNTED, NO_ZERO, UNCONFIRMED
from cathxr.runtime.live import LiveOptions, LiveSystem
from cathxr.runtime.moment import RollReport
from cathxr.runtime.optical import OpticalSource
from cathxr.runtime.recording import session_opener
from cathxr.runtime.roll import LiveRoll
from cathxr.runtime.supervisor import RetryPolicy
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionReader
from cathxr.twin import TwinWorld

Eventually = Callable[[Callable[[], bool]], None]
NS = 1_000_000_000
PERIOD_NS = 5_000_000
VALID = RollStatus(True, True)


class Keeper:
    """An encoder that keeps a zero, as the serial driver does. Counts what it was told."""

    warnings: tuple[str, ...] = ()

    def __init__(self) -> None:
        self.told: list[object] = []

    def __enter__(self) -> "Keeper":
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def read(self, timeout_s: float) -> Reading | None:
        return None

    def confirm(self) -> None:
        self.told.append("confirm")

    def set_zero(self, count: int) -> None:
        self.told.append(count)


def live_roll(encoder: Any, flags: int = 0, *, seconds: float = 1.0) -> LiveRoll:
    live = LiveRoll(example_rig().roll, encoder)
    for seq in range(round(seconds * 200)):
        live.add(Reading(seq, NS + seq * PERIOD_NS, 8 * seq, flags=flags))
    return live


def test_a_roll_is_given_where_every_reading_is_good() -> None:
    live = live_roll(Keeper())
    roll = example_rig().roll
    assert roll is not None
    assert live.at(NS + PERIOD_NS * 3 // 2).roll_rad == pytest.approx(roll.angle_rad(12.0), abs=1e-12)
    assert not live.at(NS + PERIOD_NS).predicted
    assert live.at(NS + 199 * PERIOD_NS + PERIOD_NS // 2).predicted
    assert live.status(2 * NS, running=True, error=None) == VALID


@pytest.mark.parametrize(
    ("flags", "needs", "words"),
    [
        (UNCONFIRMED, "confirm", "Confirm that roll is right"),
        (UNCONFIRMED | NO_ZERO, "jig", "Set roll zero with the jig"),
        (MISCOUNTED, "jig", "Set roll zero with the jig"),
    ],
)
def test_one_bad_neighbour_is_enough_for_no_roll(flags: int, needs: str, words: str) -> None:
    live = live_roll(Keeper())
    last = NS + 199 * PERIOD_NS
    live.add(Reading(200, last + PERIOD_NS, 1600, flags=flags))
    assert live.at(last).roll_rad is not None
    assert live.at(last + 1).roll_rad is None
    assert live.at(last + PERIOD_NS + 1) == live.at(last + PERIOD_NS)  # neither roll nor prediction
    status = live.status(last + 2 * PERIOD_NS, running=True, error=None)
    assert (status.valid, status.needs) == (False, needs)
    assert words in status.sentence
    live.add(Reading(201, last + 2 * PERIOD_NS, 1608))
    assert live.at(last + PERIOD_NS * 3 // 2).roll_rad is None
    assert live.at(last + 2 * PERIOD_NS).roll_rad is not None


def test_the_status_says_what_is_wrong_and_what_to_do() -> None:
    running: dict[str, Any] = {"running": True, "error": None}
    assert LiveRoll(example_rig().roll, None).status(NS, running=False, error=None) == RollStatus(False, False)
    assert "rig.toml" in LiveRoll(None, Keeper()).status(NS, **running).sentence
    assert live_roll(Keeper()).status(NS, running=False, error="It has gone.") == RollStatus(
        False, False, "", "It has gone."
    )
    assert "USB cable" in live_roll(Keeper()).status(10 * NS, **running).sentence
    driver = Keeper()
    driver.warnings = ("Turn it back.",)
    assert live_roll(driver, UNCONFIRMED).status(2 * NS, **running).sentence == "Turn it back."


def test_readings_of_another_time_than_the_pictures_are_told_of() -> None:
    live = live_roll(Keeper(), seconds=3.0)
    for tenth in range(20):  # pictures whose stamps are two seconds ahead
        assert live.at(5 * NS + 1 + tenth * NS // 10).roll_rad is None
        status = live.status(4 * NS, running=True, error=None)
    assert "calibrate timing" in status.sentence
    live.at(3 * NS)
    assert live.status(4 * NS, running=True, error=None) == VALID


def test_commands_reach_a_driver_that_keeps_a_zero_and_no_other(bench: Any) -> None:
    keeper = Keeper()
    live = live_roll(keeper)
    live.confirm()
    live.zero()
    assert keeper.told == ["confirm", 0]
    for encoder, words in ((None, "no roll encoder"), (bench.encoder, "keeps no zero")):
        with pytest.raises(ConfigError, match=words):
            live_roll(encoder).zero()
    assert live_roll(bench.encoder, UNCONFIRMED).status(2 * NS, running=True, error=None).needs == ""


class OnTheTwin:
    """The fake cameras and tracker of the bench with the twin's encoder, in a live system."""

    def __init__(self, bench: Any, folder: Any, **options: Any) -> None:
        clock = MonotonicClock()
        self.world = TwinWorld(bench.rig, seed=2, start_ns=clock.now_ns())
        encoder, self.port = twin_encoder(self.world, bench.rig, clock=clock, **options)
        self.source = OpticalSource(
            bench.rig,
            {"top": bench.top, "front": bench.front},
            detectors=bench.detectors,
            tracker=bench.tracker,
            clock=clock,
            encoder=encoder,
            policy=RetryPolicy(first_s=0.02, last_s=0.1),
        )
        opener = session_opener(folder, rig=bench.rig, config={}, clock=clock, videos=False)
        commands = {"encoder_fault": fault_command(self.port)}
        self.live = LiveSystem(self.source, clock=clock, options=LiveOptions(open_session=opener, commands=commands))
        self.source.readings.add("live", self.live.take_reading)
        self.tracks: list[Track] = []
        self.reports: list[RollReport] = []
        self.live.moments.add("test", lambda moment: self.tracks.append(moment.track))
        self.live.rolls.add("test", self.reports.append)

    @property
    def status(self) -> RollStatus:
        return self.reports[-1].status if self.reports else RollStatus(False, False)

    def rolls(self) -> bool:
        """Return whether the newest Track has a roll."""
        return bool(self.tracks) and self.tracks[-1].roll_rad is not None

    def worst_deg(self) -> float:
        """Return how far any Track's roll is from every true one of the 20 ms before and after.

        A busy machine wakes the encoder's thread up late, and while it always does, stamps are late by as much. The
        exact comparison is made in simulated time (tests/property/test_roll_validity.py).
        """
        worst = 0.0
        for track in self.tracks:
            if track.roll_rad is not None:
                near = [self.world.controls(track.t_ns + ms * 1_000_000).roll_deg for ms in range(-20, 21, 4)]
                roll_deg = float(np.degrees(track.roll_rad))
                worst = max(worst, min(near) - roll_deg, roll_deg - max(near))
        return worst


@pytest.fixture
def twin(bench: Any, tmp_path: Any) -> OnTheTwin:
    return OnTheTwin(bench, tmp_path)


def test_a_restart_takes_the_roll_until_it_is_confirmed(twin: OnTheTwin, eventually: Eventually, tmp_path: Any) -> None:
    with twin.live:
        eventually(lambda: twin.rolls() and twin.status == VALID)
        twin.live.handle("record_start", {"name": "restart"})
        twin.live.handle("encoder_fault", {"kind": "reset"})
        eventually(lambda: twin.status.needs == "confirm" and not twin.rolls())
        assert "confirm roll" in twin.status.sentence or "confirm that roll" in twin.status.sentence
        count = len(twin.tracks)
        eventually(lambda: len(twin.tracks) > count + 20)
        assert {track.roll_rad for track in twin.tracks[count:]} == {None}
        twin.live.handle("roll_confirm", {})
        eventually(lambda: twin.rolls() and twin.status == VALID)
        twin.live.handle("record_stop", {})
        assert twin.live.wait_written(20.0)
    session = SessionReader(tmp_path / "restart")
    events = [each.kind for each in session.events()]
    assert events.index("roll_status") < events.index("roll_confirmed")
    assert None in {each.roll_rad for each in session.observations()}
    for observation, track in zip(session.observations(), session.tracks(), strict=True):
        assert (track.roll_rad, track.roll_predicted) == (observation.roll_rad, observation.roll_predicted)


def test_a_loss_of_power_needs_the_jig_and_a_click_is_refused(twin: OnTheTwin, eventually: Eventually) -> None:
    with twin.live:
        eventually(twin.rolls)
        twin.world.steer(time.monotonic_ns(), insertion_mm=60.0, roll_deg=0.0)
        twin.live.handle("encoder_fault", {"kind": "power"})
        eventually(lambda: twin.status.needs == "jig" and not twin.rolls())
        with pytest.raises(CathxrError, match="jig"):
            twin.live.handle("roll_confirm", {})
        eventually(lambda: abs(twin.world.controls(time.monotonic_ns()).roll_deg) < 1e-3)
        twin.live.handle("roll_zero", {})
        eventually(lambda: twin.rolls() and twin.status == VALID)
        twin.world.steer(time.monotonic_ns(), roll_deg=40.0)
        eventually(lambda: np.degrees(twin.tracks[-1].roll_rad or 0.0) > 35.0)
    # A count is 0.075 degrees, half by rounding and half by the zero; the rest is what happens between two readings.
    assert twin.worst_deg() < 0.15


def test_an_encoder_that_is_unplugged_is_told_of_and_found_again(twin: OnTheTwin, eventually: Eventually) -> None:
    with twin.live:
        eventually(twin.rolls)
        twin.live.handle("encoder_fault", {"kind": "unplug"})
        eventually(lambda: not twin.status.present and "cable" in twin.status.sentence and not twin.rolls())
        with pytest.raises(CathxrError, match="before it is opened"):
            twin.live.handle("roll_zero", {})
        twin.live.handle("encoder_fault", {"kind": "none"})
        eventually(lambda: twin.status.needs == "jig")
        assert not twin.rolls()
        assert any(track.status is Status.TRACKED for track in twin.tracks[-3:])  # the pictures go on


def test_garbage_on_the_line_costs_readings_and_nothing_else(twin: OnTheTwin, eventually: Eventually) -> None:
    with twin.live:
        eventually(twin.rolls)
        twin.live.handle("encoder_fault", {"kind": "garbage"})
        count = len(twin.tracks)
        eventually(lambda: len(twin.tracks) > count + 150)
    given = [track for track in twin.tracks[count:] if track.roll_rad is not None]
    assert len(given) > 50
    assert twin.worst_deg() < 0.2  # as above, with longer gaps between the readings


def test_what_is_no_fault_is_refused(twin: OnTheTwin) -> None:
    for args, words in (({"kind": "fire"}, ", ".join(FAULTS)), ({}, "no encoder fault"), ({"what": 1}, "takes kind")):
        with pytest.raises(ConfigError, match=words):
            twin.live.handle("encoder_fault", args)


def test_the_twins_stamps_are_off_by_what_was_asked_for(bench: Any) -> None:
    clock, found = MonotonicClock(), {}
    for error_s in (None, 0.05):
        world = TwinWorld(bench.rig, seed=2, start_ns=clock.now_ns())
        encoder, port = twin_encoder(world, bench.rig, clock=clock, stamp_error_s=error_s)
        assert isinstance(port, TwinPort)
        late_s: list[float] = []
        with encoder:
            for seq in range(4000):
                if seq % 250 == 0:
                    world.steer(clock.now_ns(), roll_deg=300.0 if seq % 500 == 0 else -300.0)
                reading = encoder.read(0.1)
                late_s += [] if reading is None or seq % 5 else _lateness_s(world, reading)
                if len(late_s) >= 40:
                    break
        found[error_s] = float(np.median(late_s))
    # A machine that wakes up late adds some tenths of a millisecond before the least lateness is known; a count is 1 ms
    # at the least speed that is looked at.
    assert found[None] == pytest.approx(0.0, abs=0.003)
    assert found[0.05] == pytest.approx(0.05, abs=0.003)


def _lateness_s(world: TwinWorld, reading: Reading) -> list[float]:
    """Return how late a reading's stamp is, where the catheter turns fast enough to tell."""
    t_ns = reading.t_ns + np.arange(-70, 21, 5) * 1_000_000
    deg = np.array([world.controls(int(each)).roll_deg for each in t_ns])
    if np.diff(deg).min() < 5 * 0.075:
        return []
    was_ns = np.interp(reading.count * 360.0 / 4800.0, deg, t_ns - reading.t_ns)
    return [-float(was_ns) * 1e-9]


def test_a_recording_without_a_page_takes_a_persons_word_on_the_command_line(
    twin: OnTheTwin, eventually: Eventually, capsys: pytest.CaptureFixture[str]
) -> None:
    stopping = threading.Event()
    with twin.live:
        eventually(twin.rolls)
        twin.live.handle("encoder_fault", {"kind": "reset"})
        eventually(lambda: twin.status.needs == "confirm")
        _wait_for_roll(twin.live, stopping, confirmed=False)
        said = capsys.readouterr().err
        assert said.startswith("Recording without roll. The encoder restarted")
        assert "--roll-confirmed" in said
        _wait_for_roll(twin.live, stopping, confirmed=True)
        assert capsys.readouterr().err == ""
        assert twin.live.roll_status() == VALID
