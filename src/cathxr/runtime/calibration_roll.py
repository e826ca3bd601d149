"""The roll being measured in the jig: its zero, the gears' play, one turn; readings and a person's word in. No threads.

Nothing is written, here or on the board, before a person accepts.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cathxr.calibration.roll import (
    JIG_STD_DEG,
    LEAST_TURN,
    JigCalibration,
    TurnCheck,
    changes,
    check_turn,
    counts_per_degree,
    jig_calibration,
)
from cathxr.calibration.roll_rocking import STOPS_EACH, WIDEST_DEG, Play, Rocking
from cathxr.calibration.roll_sentences import clock_angle_rad, number
from cathxr.core import CalibrationError, Health, Reading, Roll
from cathxr.devices.encoder_stream import INVALID, SAME_RUN
from cathxr.runtime.calibration_roll_words import progress_figures, result_figures, step_advice
from cathxr.runtime.calibration_task import CANCELLED, CommandTable, Ending, Job
from cathxr.wire.calibration_messages import CalibrationStage, RockingState, RollCalibrationState, RollStep

STILL_COUNTS = 1
"""A count at rest may flicker between two."""
_STILL_NS = 500_000_000
_RATE_NS = 1_000_000_000
_PAUSE_NS = 1_000_000_000
"""Readings further apart than this: who knows what the encoder did meanwhile."""
_COUNTS_PER_ILLEGAL = 4
"""How far an impossible transition may put the count off: so many may come as make a degree."""
_HALF = 2**31

Save = Callable[[JigCalibration, int], Ending]
"""Given what was measured and the count that the board shows now: sets the board and writes the rig, or raises."""
OnStep = Callable[[RollStep], None]


@dataclass(frozen=True)
class RollSteps:
    """What is done in a run, and what is assumed. backlash, turn: with these steps; jig_std_deg: see JIG_STD_DEG."""

    backlash: bool = True
    turn: bool = True
    jig_std_deg: float = JIG_STD_DEG

    @property
    def names(self) -> list[RollStep]:
        """The steps in order."""
        steps: list[RollStep] = ["zero"]
        steps += ["backlash"] if self.backlash else []
        steps += ["turn"] if self.turn else []
        return [*steps, "review"]


class RollSession:
    """Measures a rig's [roll] in the jig. A ReadingsTask.

    save: sets the board's zero and writes the rig, in the worker's thread. on_step: hears of every step that begins,
    for a simulated hand.
    """

    def __init__(self, roll: Roll, *, steps: RollSteps, date: str, save: Save, on_step: OnStep | None = None) -> None:
        self.ending: Ending | None = None
        self._roll, self._steps, self._date, self._save, self._is_simulated = (
            roll,
            steps,
            date,
            save,
            on_step is not None,
        )
        self._on_step = on_step or _nobody
        self._most_illegal = max(1, int(counts_per_degree(roll) / _COUNTS_PER_ILLEGAL))
        self._job: Job[Any] | None = None
        self._recent: deque[Reading] = deque()
        self._last: Reading | None = None
        self._illegal = 0
        self.stage: CalibrationStage = "collecting"
        self.step: RollStep = "zero"
        self._trouble = self._sentence = ""
        self._turned = 0  # counts from where this run began, then from where the handle was confirmed
        self._rocking = Rocking()
        self._play: Play | None = None
        self._turn: TurnCheck | None = None
        self._result: JigCalibration | None = None
        self._commands = CommandTable(
            {
                "calibration_confirm": ((), self._confirm),
                "calibration_repeat": ((), self._repeat),
                "calibration_accept": ((), self._accept),
                "calibration_cancel": ((), self._cancel),
            }
        )
        self._begin_anew()

    def take(self, readings: Sequence[Reading]) -> None:
        """Take the encoder's readings since the last time."""
        for reading in readings:
            if self._last is None and self.stage != "failed":
                self._trouble = ""
            self._follow(reading)

    def note_health(self, sources: Mapping[str, Health]) -> None:
        """Take note of an encoder that has gone: what it does meanwhile nobody counts."""
        for health in sources.values():
            if not health.running and health.last_error:
                if self._last is not None:
                    self._lose(health.last_error)
                elif self.stage != "failed":
                    self._trouble = health.last_error

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Carry out a command. Raises as `Steps.handle`."""
        return self._commands.handle(name, args)

    def take_job(self) -> Job[Any] | None:
        """Return the saving that was asked for."""
        job, self._job = self._job, None
        return job

    @property
    def result(self) -> JigCalibration | None:
        """What was measured, once all steps are done."""
        return self._result

    def state(self) -> RollCalibrationState:
        """Return what the page shows."""
        why = self._why_not()
        last, result = self._last, self._result
        return RollCalibrationState(
            stage=self.stage,
            step=self.step,
            steps=self._steps.names,
            advice=self._advice(),
            is_simulated=self._is_simulated,
            connected=last is not None,
            count=None if last is None else last.count,
            turned_rad=None if last is None else self._angle_rad(self._turned),
            zero_rad=clock_angle_rad(self._roll.zero_direction),
            rate_hz=self._rate_hz(),
            is_still=self._is_still,
            is_valid=last is not None and last.flags & INVALID == 0,
            rocking=self._rocking_state() if self.step == "backlash" else None,
            can_confirm=not why and self.step != "review" and self.stage == "collecting",
            why=why,
            writes="" if result is None else _written(self._roll, result.roll),
            can_save=self.ending is None and self.stage == "done",
            figures=(
                result_figures(self._roll, result)
                if result is not None
                else progress_figures(self._roll, self._play, is_past_zero=self.step != "zero")
            ),
        )

    # --- readings ----------------------------------------------------------------------------------------------------

    def _follow(self, reading: Reading) -> None:
        last = self._last
        if last is not None and self.stage != "solving":
            if (reading.flags ^ last.flags) & SAME_RUN or reading.t_ns - last.t_ns > _PAUSE_NS:
                self._lose("The encoder's board has restarted or fell silent, and turns may have been missed")
            elif self.step != "zero" and (reading.illegal - self._illegal) % (1 << 16) >= self._most_illegal:
                self._lose("The encoder's signal is disturbed and its count in doubt: check its cable and plugs")
            else:
                # The board counts in 32 bits and around.
                self._turned += (reading.count - last.count + _HALF) % (2 * _HALF) - _HALF
        self._last = reading
        self._illegal = reading.illegal if self.step == "zero" else self._illegal
        self._recent.append(reading)
        while reading.t_ns - self._recent[0].t_ns > _RATE_NS:
            self._recent.popleft()
        if self.step == "backlash" and self.stage == "collecting":
            self._rocking.add(self._turned)

    def _lose(self, sentence: str) -> None:
        """Give up what was measured: the count does not go on from where it was."""
        if self.stage == "solving":
            return
        began = self.step != "zero"
        self._last = None
        self._recent.clear()
        self._begin_anew()
        if began:
            self.stage, self._trouble = "failed", f"{sentence.rstrip('.')}. Begin again."

    @property
    def _is_still(self) -> bool:
        """Whether the count has rested for half a second."""
        last = self._last
        if last is None or last.t_ns - self._recent[0].t_ns < _STILL_NS:
            return False
        counts = [each.count for each in self._recent if last.t_ns - each.t_ns <= _STILL_NS]
        return max(counts) - min(counts) <= STILL_COUNTS

    def _rate_hz(self) -> float | None:
        if len(self._recent) < 2:
            return None
        span_ns = self._recent[-1].t_ns - self._recent[0].t_ns
        return round((len(self._recent) - 1) * 1e9 / span_ns) if span_ns > 0 else None

    # --- steps -------------------------------------------------------------------------------------------------------

    def _begin_anew(self) -> None:
        self.stage, self._trouble, self._turned, self._rocking = "collecting", "", 0, Rocking()
        self._play = self._turn = self._result = None
        self._go_to("zero")

    def _go_to(self, step: RollStep) -> None:
        self.step = step
        self._sentence = ""
        self._on_step(step)

    def _why_not(self) -> str:
        """Return why the present step cannot be confirmed; empty: it can."""
        if self._last is None:
            return "The encoder does not report."
        if self.step == "review" or self.stage != "collecting":
            return ""
        if self.step == "backlash":
            stops = self._rocking.progress().stops
            return f"{stops} of {STOPS_EACH} stops on each side so far." if stops < STOPS_EACH else ""
        if not self._is_still:
            return "The handle is moving: lock it and let go."
        if self.step == "turn" and abs(self._turned) < LEAST_TURN * self._roll.counts_per_turn * self._roll.gear_ratio:
            return "The handle has not been turned yet."
        return ""

    def _confirm(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self.stage != "collecting" or self.step == "review":
            raise CalibrationError("There is nothing to confirm now.")
        if self._last is None:
            raise CalibrationError(self._trouble or "The encoder does not report: check its cable.")
        # A person who rocks asks for the result: what is wrong with the rocking is said by the evaluation.
        if self.step != "backlash" and (why := self._why_not()):
            raise CalibrationError(why)
        self._finish_step()
        names = self._steps.names
        following = names[names.index(self.step) + 1]
        if following == "review":
            self._result = jig_calibration(
                self._roll,
                rested=0,
                play=self._play,
                turn=self._turn,
                date=self._date,
                jig_std_deg=self._steps.jig_std_deg,
            )
            self.stage = "done"
        self._go_to(following)
        return {}

    def _finish_step(self) -> None:
        """Evaluate the present step.

        Raises:
            CalibrationError: it gives no result; its sentence stays on the page.
        """
        try:
            if self.step == "zero":
                self._turned, self._rocking = 0, Rocking()
            elif self.step == "backlash":
                self._play = self._rocking.play(counts_per_degree=counts_per_degree(self._roll))
            else:
                middle = 0.0 if self._play is None else self._play.middle
                self._turn = check_turn(self._roll, self._turned - middle, play=self._play)
        except CalibrationError as error:
            self._sentence = str(error)
            raise

    def _repeat(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self.stage == "solving":
            raise CalibrationError("It is being saved: wait a moment.")
        if self.stage in ("failed", "done"):
            self._begin_anew()
        else:
            self._rocking, self._sentence = Rocking(), ""
            self._on_step(self.step)
        return {}

    def _accept(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        result, last = self._result, self._last
        if self.stage != "done" or result is None:
            raise CalibrationError("There is nothing to save yet: go through the steps first.")
        if last is None:
            raise CalibrationError("The encoder does not report: its zero cannot be set.")
        if not self._is_still:
            raise CalibrationError("The handle is moving: lock it and let go, then save.")
        target = result.board_count(self._turned)

        def failed(sentence: str) -> None:
            self.stage, self._trouble = "failed", sentence

        def done(ending: Ending) -> None:
            self.ending = ending

        self._job = Job(lambda: self._save(result, target), done, failed)
        self.stage = "solving"
        return {"saved": False}  # the end is told by the event calibration_ended

    def _cancel(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self.stage == "solving":
            raise CalibrationError("It is being saved: wait a moment.")
        self.ending = CANCELLED
        return self.ending.result

    # --- what is shown -----------------------------------------------------------------------------------------------

    def _angle_rad(self, counts: float) -> float:
        roll = self._roll if self._result is None else self._result.roll
        per_turn = roll.counts_per_turn * roll.gear_ratio
        return roll.direction * 2.0 * math.pi * counts / per_turn

    def _rocking_state(self) -> RockingState:
        progress = self._rocking.progress()
        ends = [self._angle_rad(each or 0) for each in (progress.low, progress.high)]
        return RockingState(
            low_rad=min(ends),
            high_rad=max(ends),
            limit_rad=math.radians(WIDEST_DEG),
            stops=progress.stops,
            wanted=STOPS_EACH,
        )

    def _advice(self) -> str:
        """Return one sentence: what to do next."""
        if self.ending is not None:
            return self.ending.sentence
        if self.stage == "solving":
            return "Being saved: leave the handle locked."
        if self._trouble:
            return self._trouble
        if self._last is None:
            return "Looking for the encoder: this takes some seconds."
        if self._sentence:
            return self._sentence
        if self._result is not None and self._turn is not None and not self._turn.is_as_stated:
            again = "If it was exactly one turn, save that; otherwise begin again."
            return f"{self._turn.sentence} {again}"
        return step_advice(self.step, self._roll)


def _nobody(step: RollStep) -> None:
    """Leave the step to a person."""


def _written(before: Roll, after: Roll) -> str:
    """Return what is changed of the gears, as in rig.toml."""
    changed = {key: new for key, (_, new) in changes(before, after).items() if key != "backlash_deg"}
    return ", ".join(f"{key} {new if isinstance(new, int) else number(new)}" for key, new in changed.items())
