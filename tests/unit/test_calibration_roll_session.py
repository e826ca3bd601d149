"""The jig procedure as a state machine: the steps, what is refused, and what makes it begin again."""

from collections.abc import Callable

import pytest

from cathxr.calibration.roll import JigCalibration
from cathxr.core import CalibrationError, Health, Reading, Roll
from cathxr.runtime.calibration_roll import RollSession, RollSteps
from cathxr.runtime.calibration_task import Ending

ROLL = Roll(2400.0, 2.0, zero_count=7.0)
PERIOD_NS = 5_000_000


class Bench:
    """A session with an encoder whose count a test moves."""

    def __init__(self, steps: RollSteps | None = None, *, start: int = 1000) -> None:
        self.saved: list[tuple[JigCalibration, int]] = []
        self.begun: list[str] = []
        self.session = RollSession(
            ROLL, steps=steps or RollSteps(), date="2026-02-03", save=self._save, on_step=self.begun.append
        )
        self.count, self._seq, self.flags, self.illegal = start, 0, 0x10, 0

    def _save(self, result: JigCalibration, count: int) -> Ending:
        self.saved.append((result, count))
        return Ending("Saved.", True)

    def wait(self, seconds: float = 0.7) -> None:
        for _ in range(round(seconds * 200)):
            self._give()

    def move(self, by: int, *, steps: int = 20) -> None:
        start = self.count
        for step in range(1, steps + 1):
            self.count = start + round(by * step / steps)
            self._give()

    def rock(self, width: int = 6, strokes: int = 12) -> None:
        self.move(width // 2)
        for stroke in range(strokes):
            self.move(-width if stroke % 2 == 0 else width)
        self.move(-width // 2)

    def do(self, name: str) -> None:
        self.session.handle(f"calibration_{name}", {})

    def work(self) -> None:
        job = self.session.take_job()
        assert job is not None
        job.done(job.work())

    def _give(self) -> None:
        wrapped = (self.count + 2**31) % 2**32 - 2**31
        self.session.take([Reading(self._seq, self._seq * PERIOD_NS, wrapped, self.illegal, self.flags)])
        self._seq += 1


def through(bench: Bench, turn: int = 4800) -> None:
    """Go through all steps up to the review."""
    bench.wait()
    bench.do("confirm")
    bench.rock()
    bench.do("confirm")
    bench.move(turn, steps=400)
    bench.wait()
    bench.do("confirm")


@pytest.mark.parametrize("start", [1000, 2**31 - 2000])
def test_the_procedure_gives_zero_play_and_turn(start: int) -> None:
    bench = Bench(start=start)
    through(bench)
    state = bench.session.state()
    assert (state.stage, state.step, state.can_save, state.writes) == ("done", "review", True, "")
    assert bench.begun == ["zero", "backlash", "turn", "review"]
    bench.do("accept")
    assert bench.session.state().stage == "solving"
    bench.work()
    assert bench.session.ending == Ending("Saved.", True)
    ((result, count),) = bench.saved
    assert result.play is not None
    assert result.play.counts == 6.0
    assert result.roll.zero_count == ROLL.zero_count
    assert count == 7


def test_wrong_gears_stand_on_the_page_and_are_written_only_when_accepted() -> None:
    bench = Bench()
    through(bench, turn=-2400)
    state = bench.session.state()
    assert state.writes == "gear_ratio 1.0, direction -1"
    assert "gear_ratio 1.0 fits, the rig says 2.0" in state.advice
    assert bench.saved == []
    bench.do("accept")
    bench.work()
    assert (bench.saved[0][0].roll.gear_ratio, bench.saved[0][0].roll.direction) == (1.0, -1)


def test_a_handle_that_moves_confirms_nothing() -> None:
    bench = Bench()
    with pytest.raises(CalibrationError, match="does not report"):
        bench.do("confirm")
    bench.wait(1.0)
    bench.move(40)
    assert not bench.session.state().can_confirm
    with pytest.raises(CalibrationError, match="is moving"):
        bench.do("confirm")
    bench.wait()
    assert bench.session.state().can_confirm
    bench.do("confirm")
    bench.rock(strokes=3)
    with pytest.raises(CalibrationError, match="Rock on"):
        bench.do("confirm")
    assert bench.session.state().advice.startswith("Rock on")
    bench.do("repeat")
    bench.rock()
    bench.do("confirm")
    bench.wait()
    with pytest.raises(CalibrationError, match="not been turned"):
        bench.do("confirm")
    with pytest.raises(CalibrationError, match="nothing to save"):
        bench.do("accept")


def restart(bench: Bench) -> None:
    bench.flags = 0x20


def unplug(bench: Bench) -> None:
    bench.session.note_health({"encoder": Health(0, "encoder", False, None, 0.0, 0, "The roll encoder has gone.")})


def disturb(bench: Bench) -> None:
    bench.illegal = 5


@pytest.mark.parametrize(("fault", "sentence"), [(restart, "restarted"), (unplug, "gone"), (disturb, "disturbed")])
def test_what_breaks_the_count_makes_it_begin_again(fault: Callable[[Bench], None], sentence: str) -> None:
    bench = Bench()
    bench.wait()
    bench.do("confirm")
    bench.rock()
    fault(bench)
    bench.wait()
    state = bench.session.state()
    assert (state.stage, state.step) == ("failed", "zero")
    assert sentence in state.advice
    assert state.advice.endswith("Begin again.")
    bench.do("repeat")
    bench.wait()
    assert bench.session.state().stage == "collecting"
    through(bench)
    assert bench.session.state().can_save


def test_a_failed_saving_begins_again_and_a_cancelled_run_saves_nothing() -> None:
    bench = Bench()
    through(bench)
    bench.do("accept")
    job = bench.session.take_job()
    assert job is not None
    with pytest.raises(CalibrationError, match="being saved"):
        bench.do("cancel")
    job.failed("The board has not answered.")
    assert bench.session.state().stage == "failed"
    with pytest.raises(CalibrationError, match="nothing to save"):
        bench.do("accept")
    bench.do("cancel")
    assert bench.saved == []
    assert bench.session.ending is not None
    assert not bench.session.ending.saved


def test_steps_can_be_left_out() -> None:
    bench = Bench(RollSteps(backlash=False, turn=False))
    assert bench.session.state().steps == ["zero", "review"]
    bench.wait()
    bench.do("confirm")
    assert bench.session.state().can_save
    bench.do("accept")
    bench.work()
    assert bench.saved[0][1] == 7
    assert bench.saved[0][0].roll.backlash_deg is None
