"""`cathxr calibrate roll` and `cathxr doctor` as real processes: in memory everywhere, over a real port on POSIX."""

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cathxr.app.calibrate_roll_hand import SimulatedHand, hand_truth
from cathxr.core import Roll
from cathxr.devices.clock import ManualClock, MonotonicClock
from cathxr.devices.encoder_fake import FakeBoard, FakePort
from cathxr.devices.encoder_fake_terminal import FakeTerminal
from cathxr.devices.encoder_protocol import guarded, mark_of
from cathxr.runtime.calibration_roll import STILL_COUNTS
from cathxr.storage.rig_file import example_rig_text, read_rig

HANG_S = 300.0
"""A limit on hanging, not a measurement."""
Start = Callable[..., Any]
posix = pytest.mark.skipif(os.name == "nt", reason="Windows has no pseudo-terminals")


@pytest.fixture
def rig_path(tmp_path: Path) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(example_rig_text(), encoding="utf-8")
    return path


def cathxr(*arguments: str, said: str = "") -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "cathxr", *arguments],
        input=said, capture_output=True, text=True, encoding="utf-8", timeout=HANG_S, check=False,
    )  # fmt: skip


def roll_of(path: Path) -> Roll:
    roll = read_rig(path).roll
    assert roll is not None
    return roll


def assert_found(found: Roll, seed: int) -> None:
    truth = hand_truth(roll_of_example(), seed)
    std = float(found.provenance.std["backlash_deg"])
    assert found.backlash_deg is not None
    assert abs(found.backlash_deg - truth.backlash_deg) < 4.0 * std  # the error that it states itself
    assert 0.0 < std < 0.15  # the hand's gears resolve 0.15 degrees at worst, and two stops are rounded
    assert (found.gear_ratio, found.direction) == (truth.gear_ratio, truth.direction)
    assert found.provenance.date is not None
    assert "jig" in str(found.provenance.method)
    assert found.zero_count == roll_of_example().zero_count


def roll_of_example() -> Roll:
    from cathxr.storage.rig_file import example_rig

    roll = example_rig().roll
    assert roll is not None
    return roll


@pytest.mark.parametrize("seed", [2, 3])
def test_the_simulation_finds_its_truth_and_writes_the_rig(rig_path: Path, seed: int) -> None:
    before = rig_path.read_text(encoding="utf-8")
    done = cathxr("calibrate", "roll", "--rig", str(rig_path), "--source", "twin", "--seed", str(seed), "--yes")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "This is a simulation, without hardware" in done.stdout
    assert "The simulation's truth" in done.stdout
    assert_found(roll_of(rig_path), seed)
    assert rig_path.with_name("rig.toml.bak").read_text(encoding="utf-8") == before


def test_an_input_that_ends_leaves_the_rig_alone(rig_path: Path) -> None:
    before = rig_path.read_text(encoding="utf-8")
    done = cathxr("calibrate", "roll", "--rig", str(rig_path), "--source", "twin")
    assert done.returncode == 1
    assert "The input ended before roll was measured" in done.stderr
    assert "Traceback" not in done.stderr
    assert rig_path.read_text(encoding="utf-8") == before
    assert list(rig_path.parent.iterdir()) == [rig_path]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--source", "twin", "--device", "COM3"], "leave --device and --config out"),
        (["--yes"], "--yes is for --source twin"),
        (["--device", "no-such-port"], "There is no roll encoder on no-such-port: there is no such port."),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(rig_path: Path, arguments: list[str], sentence: str) -> None:
    if "no-such-port" in arguments:
        done = cathxr("doctor", "encoder", "--once", "--port", "no-such-port")
    else:
        done = cathxr("calibrate", "roll", "--rig", str(rig_path), *arguments)
    assert done.returncode == 1
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_rig_without_roll_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    text = example_rig_text()
    path.write_text(re.sub(r"\[roll\][^\[]*(?:\[[^\]\n]*\][^\[]*)*", "", text, count=1), encoding="utf-8")
    assert read_rig(path).roll is None
    done = cathxr("calibrate", "roll", "--rig", str(path), "--source", "twin")
    assert done.returncode == 1
    assert "has no [roll]: add counts_per_turn" in done.stderr


# --- over a port of the system ----------------------------------------------------------------------------------------


class Bench:
    """A simulated hand and board behind a pseudo-terminal."""

    def __init__(self, seed: int) -> None:
        self.clock = MonotonicClock()
        self.hand = SimulatedHand(hand_truth(roll_of_example(), seed), seed=seed, clock=self.clock)
        self.board = FakeBoard(self.hand.count_at, start_ns=self.clock.now_ns())
        self.terminal = FakeTerminal(FakePort(self.board, self.clock), clock=self.clock)

    def await_the_jig(self) -> None:
        """Wait until the hand has the transducer in the jig: before it moves it is as still as when it is there."""
        deadline = time.monotonic() + HANG_S
        while abs((self.hand.angle_deg(self.clock.now_ns()) + 180.0) % 360.0 - 180.0) > 1.0:
            assert time.monotonic() < deadline
            time.sleep(0.02)


@pytest.fixture
def make_bench() -> Iterator[Callable[[int], Bench]]:
    """A function that gives a running bench."""
    made: list[Bench] = []

    def make(seed: int) -> Bench:
        made.append(Bench(seed))
        made[-1].terminal.__enter__()
        return made[-1]

    yield make
    for each in made:
        each.terminal.unplug()


class Console:
    """`cathxr calibrate roll` with a person at its console."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-m", "cathxr", "calibrate", "roll", *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, encoding="utf-8",
        )  # fmt: skip
        self.said = ""
        self._watchdog = threading.Timer(HANG_S, self.process.kill)
        self._watchdog.start()

    def until(self, words: str) -> None:
        assert self.process.stdout is not None
        while words not in self.said.rsplit("\x00", 1)[-1]:
            line = self.process.stdout.readline()
            assert line, f"never said {words!r}: {self.said}"
            self.said += line
        self.said += "\x00"  # what was said before is not looked at again

    def press(self, line: str = "") -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def insist(self, words: str) -> None:
        """Press Enter, twice a second, until the next step begins: a person tries again when the hand still moved."""
        stop = threading.Event()

        def again() -> None:
            while not stop.wait(0.5):
                self.press()

        thread = threading.Thread(target=again)
        thread.start()
        try:
            self.until(words)
        finally:
            stop.set()
            thread.join()

    def end(self) -> int:
        """Return the exit code; the input stays open until then."""
        assert self.process.stdout is not None
        said = self.process.stdout.read()
        self.process.communicate(timeout=HANG_S)
        self._watchdog.cancel()
        self.said += said
        return self.process.returncode


@posix
def test_a_board_on_a_port_gets_its_zero_and_the_rigs_mark(rig_path: Path, make_bench: Callable[[int], Bench]) -> None:
    """The hand is the test's; the gears are not as the rig says, so that the board's mark must change, too."""
    bench = make_bench(3)
    bench.hand.begin("zero")
    console = Console("--rig", str(rig_path), "--device", bench.terminal.name)
    console.until("[1/4] Slide the transducer")
    bench.await_the_jig()
    console.insist("[2/4] Leave the catheter's gear locked")
    bench.hand.begin("backlash")
    console.insist("[3/4] Unlock")
    bench.hand.begin("turn")
    console.insist("[4/4] 7")
    bench.hand.begin("review")
    console.press()
    assert console.end() == 0, console.said
    assert_found(roll_of(rig_path), 3)
    roll, now_ns = roll_of(rig_path), bench.clock.now_ns()
    assert bench.board._mark == mark_of(roll)
    # One turn was counted, and the zero is at the nearest: the board's roll is that of the hand, but for whole turns.
    turned_deg = (bench.hand.angle_deg(now_ns) + 180.0) % 360.0 - 180.0
    found_deg = roll.angle_rad(bench.board.count(now_ns)) * 57.29577951308232
    # The encoder stands anywhere within half the play of the catheter; the zero's own error comes on top.
    allowed_deg = 0.5 * bench.hand.truth.backlash_deg + 4.0 * 0.1 + 2.0 * bench.hand.truth.counts_per_degree**-1
    assert abs(found_deg - turned_deg) < allowed_deg


@posix
@pytest.mark.parametrize("how", ["cancel", "signal", "unplug"])
def test_a_run_that_does_not_come_to_its_end_changes_nothing(
    rig_path: Path, make_bench: Callable[[int], Bench], how: str
) -> None:
    before = rig_path.read_text(encoding="utf-8")
    bench = make_bench(2)
    bench.hand.begin("zero")
    console = Console("--rig", str(rig_path), "--device", bench.terminal.name)
    console.until("[1/4] Slide the transducer")
    bench.await_the_jig()
    console.insist("[2/4] Leave the catheter's gear locked")
    if how == "signal":
        console.process.send_signal(signal.SIGINT)
    else:
        if how == "unplug":
            bench.terminal.unplug()
            console.until("Begin again.")
        console.press("q")
    assert console.end() == (130 if how == "signal" else 1), console.said
    assert "Traceback" not in console.said
    assert bench.board._mark == 0
    assert rig_path.read_text(encoding="utf-8") == before
    assert list(rig_path.parent.iterdir()) == [rig_path]


# --- the page ---------------------------------------------------------------------------------------------------------


def test_the_page_leads_through_the_steps(start_calibration: Start, rig_path: Path) -> None:
    page = start_calibration("roll", "--rig", str(rig_path), "--source", "twin", "--seed", "3", "--page")
    for step in ("zero", "backlash", "turn"):
        state = page.until(lambda each, step=step: each["step"] == step and each["can_confirm"])
        assert state["type"] == "calibrate_roll"
        assert state["is_simulated"]
        assert page.ask("calibration_confirm")["result"] == {}
    state = page.until(lambda each: each["can_save"])
    assert state["writes"] == "gear_ratio 3.0, direction -1"
    assert page.ask("calibration_accept")["result"] == {"saved": False}
    assert page.ended()["saved"]
    said = page.finish()
    assert page.process.returncode == 0, said
    assert_found(roll_of(rig_path), 3)


def test_the_page_can_be_cancelled(start_calibration: Start, rig_path: Path) -> None:
    before = rig_path.read_text(encoding="utf-8")
    page = start_calibration("roll", "--rig", str(rig_path), "--source", "twin", "--page")
    page.until(lambda each: each["can_confirm"])
    assert page.ask("calibration_fly")["code"] == "command"
    assert page.ask("calibration_cancel")["result"]["saved"] is False
    assert "Cancelled: nothing was written." in page.finish()
    assert page.process.returncode == 1
    assert rig_path.read_text(encoding="utf-8") == before


# --- doctor -----------------------------------------------------------------------------------------------------------


def test_the_doctor_alone_lists_what_can_be_checked(rig_path: Path, tmp_path: Path) -> None:
    done = cathxr("doctor", "--rig", str(rig_path))
    assert done.returncode == 0, done.stderr
    for each in ("cameras", "encoder ports", "rig", "configuration", "page"):
        assert each in done.stdout
    (tmp_path / "bad.toml").write_text("schema = 3\n", encoding="utf-8")
    assert cathxr("doctor", "--rig", str(tmp_path / "bad.toml")).returncode == 1


def test_the_doctor_examines_a_simulated_board(rig_path: Path) -> None:
    done = cathxr("doctor", "encoder", "--source", "twin", "--rig", str(rig_path), "--once")
    assert done.returncode == 0, done.stdout + done.stderr
    for each in (
        "simulated board",
        "firmware",
        "uptime",
        "restarts",
        "impossible",
        "board's clock",
        "not valid",
        "jig",
    ):
        assert each in done.stdout


@posix
def test_the_doctor_examines_a_board_on_a_port(make_bench: Callable[[int], Bench]) -> None:
    bench = make_bench(0)
    done = cathxr("doctor", "encoder", "--port", bench.terminal.name, "--once")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "the roll encoder" in done.stdout
    assert "give --rig" in done.stdout


@posix
@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (guarded("I cathxr-roll 2 3.0.0 0 power"), "its firmware speaks protocol 2 and this program speaks 1"),
        (guarded("I thermometer 1 1.0.0"), "it is a thermometer, not a cathxr-roll"),
        (b"hello world\r\n", "another device, or the board with another sketch"),
    ],
)
def test_the_doctor_says_what_else_is_there(line: bytes, sentence: str) -> None:
    import pty
    import tty

    master, other = pty.openpty()
    tty.setraw(other)
    stop = threading.Event()

    def speak() -> None:
        while not stop.wait(0.1):
            os.write(master, line)

    thread = threading.Thread(target=speak)
    thread.start()
    try:
        done = cathxr("doctor", "encoder", "--port", os.ttyname(other), "--once")
    finally:
        stop.set()
        thread.join()
        os.close(master)
        os.close(other)
    assert done.returncode == 1
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1


@posix
def test_the_doctor_says_that_another_program_has_the_port(make_bench: Callable[[int], Bench]) -> None:
    import serial

    bench = make_bench(0)
    with serial.Serial(bench.terminal.name, 115200, exclusive=True):
        done = cathxr("doctor", "encoder", "--port", bench.terminal.name, "--once")
    assert done.returncode == 1
    assert "another program has it open" in done.stderr


@pytest.mark.parametrize("seed", range(6))
def test_a_hand_that_begins_a_step_is_not_taken_for_one_at_rest(seed: int) -> None:
    """Else its zero could be confirmed where it stands before it moves: 0.5 s of rest are asked for."""
    clock = ManualClock(1_000_000_000)
    hand = SimulatedHand(hand_truth(roll_of_example(), seed), seed=seed, clock=clock)
    hand.begin("zero")
    counts = [hand.count_at(clock.now_ns() + each) for each in range(0, 500_000_000, 5_000_000)]
    assert max(counts) - min(counts) > 3 * STILL_COUNTS
