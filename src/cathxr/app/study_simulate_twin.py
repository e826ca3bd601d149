"""A whole study on the digital twin: allocation, practice, trials and surveys of simulated people, all recorded."""

import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from cathxr import __version__
from cathxr.app.heart_registration import registration_of
from cathxr.app.register_heart import chosen_heart
from cathxr.app.score_inputs import wall_depth
from cathxr.app.study_folder import StudyAtHand
from cathxr.core import DataError, Rig
from cathxr.core.trials import TrialRecord, TrialStart
from cathxr.registration import registration_toml
from cathxr.runtime.simulated_eye import Eye, PictureEye, TruthEye
from cathxr.runtime.simulated_hand import Skill, SteeringHand
from cathxr.runtime.simulated_trial import SimulatedRun, simulated_run
from cathxr.runtime.training_numbers import measures_of, record_of
from cathxr.runtime.training_recordings import recorded_trial, write_label
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionWriter
from cathxr.study.allocation import drawn_sequence
from cathxr.study.board import Step, StepKind, next_step
from cathxr.study.design import sequence_text
from cathxr.study.simulate_answers import simulated_answers
from cathxr.training import PlacedTask, Task, find_task, order_of, place_task, task_sha256
from cathxr.training.metrics import Depth
from cathxr.twin import TwinWorld, true_rig

TWIN_BOX = "digital twin"
_FIRST_DAY = datetime(2026, 1, 5, 9, 0, tzinfo=UTC)
_START_NS = 1_000_000_000
_SD_PERSON = 0.2
_GIVES_UP = 0.03
"""The share of trials that a person ends before their time, and does again."""


@dataclass(frozen=True)
class Hands:
    """How people are simulated.

    view: looks and misses in the second condition over those in the first. practice: looks, misses and times of a
    person's trial over those of the one before. rendered: how many trials are tracked in rendered pictures.
    """

    view: float = 0.75
    practice: float = 0.93
    rendered: int = 0
    seed: int = 0


@dataclass(frozen=True, eq=False)
class _Place:
    """What every trial is done in."""

    rig: Rig
    registration: dict[str, Any]
    tasks: dict[str, tuple[Task, PlacedTask]]
    depth: Depth | None
    recordings: Path


def simulated_on_twin(study: StudyAtHand, recordings: Path, hands: Hands) -> int:
    """Return how many trials were done, after everybody the design plans for has done what it asks for.

    Raises:
        CathxrError: a disk refuses, or a trial done again from its recording is not the same.
    """
    place = _place(study, recordings, hands)
    planned = study.design.planned
    done = 0
    with _shown(planned * study.design.trials_a_condition * len(study.design.conditions)) as advance:
        for at in range(planned):
            person = _Person(study, place, hands, at, rendered=max(0, hands.rendered - done), advance=advance)
            done += person.take_part()
    return done


def _place(study: StudyAtHand, recordings: Path, hands: Hands) -> _Place:
    heart = chosen_heart(None)
    registration = registration_of(heart)
    rig = true_rig(example_rig(), hands.seed)
    practice = () if study.design.practice is None else (study.design.practice.task,)
    tasks = {}
    for key in (*study.design.tasks, *practice):
        task = find_task(key)
        placed = place_task(
            task, ct_from_box=registration.matrix, points_ct=heart.points_ct, roi=rig.roi, sha256=task_sha256(task)
        )
        tasks[key] = (task, placed)
    copied = tomllib.loads(registration_toml(registration))
    return _Place(rig, copied, tasks, wall_depth(heart, registration), recordings)


class _Person:
    """One simulated participant: does what comes next until nothing does."""

    def __init__(
        self,
        study: StudyAtHand,
        place: _Place,
        hands: Hands,
        at: int,
        *,
        rendered: int,
        advance: Callable[[str], None],
    ) -> None:
        self._study, self._place, self._hands, self._at = study, place, hands, at
        self._code = f"SIM{at + 1:03d}"
        self._rng = np.random.default_rng([hands.seed, 0x51D, at])
        self._pace = float(self._rng.lognormal(0.0, _SD_PERSON))
        self._rendered, self._advance = rendered, advance
        self._now = _FIRST_DAY + timedelta(days=at // 4, hours=2 * (at % 4))
        self._trials: list[TrialRecord] = []

    def take_part(self) -> int:
        """Return how many trials were done, practice and repeated ones included."""
        study, store = self._study, self._study.store
        seed = store.seed()
        store.draw(
            self._code, lambda number: sequence_text(drawn_sequence(study.design, seed, "", number)), at=self._utc()
        )
        me = next(each for each in store.participants() if each.code == self._code)
        answers: list[Any] = []
        while True:
            step = next_step(study.design, study.surveys, me, trials=self._trials, answers=answers)
            if step.kind is StepKind.DONE:
                return len(self._trials)
            if step.kind is StepKind.SURVEY:
                rank = self._rank(step.condition) if step.condition else 0
                given = simulated_answers(
                    study.survey(step.survey), self._code, self._rng, occasion=step.occasion, at=self._utc(), rank=rank
                )
                store.answer(given, at=self._utc())
                answers += given
                self._now += timedelta(minutes=2)
            else:
                self._advance(f"{self._code}, {step.kind.value} {step.number}, {step.condition}")
                self._trials.append(self._trial(step))

    def _trial(self, step: Step) -> TrialRecord:
        """Return a trial done, recorded, done again from its recording, measured and stored."""
        practice = step.kind is StepKind.PRACTICE
        task, placed = self._place.tasks[step.task]
        kind = "practice" if practice else f"{step.period}"
        name = f"{self._code}-{kind}-{step.condition}-{step.number}"
        start = TrialStart(
            name, self._code, step.task, step.condition, step.number, step.period, self._utc(), practice, name,
            TWIN_BOX, __version__, placed.sha256,
        )  # fmt: skip
        self._study.store.begin(start, at=self._utc())
        row = self._at + len(self._trials)
        gives_up = not practice and float(self._rng.random()) < _GIVES_UP
        run = self._run(step, placed, order_of(task, seed=row, row=row), name, abort_s=8.0 if gives_up else None)
        folder = self._place.recordings / name
        self._record(folder, run, start)
        again = recorded_trial(folder, name)
        if not again.is_same:
            raise DataError(f"{folder}: the trial done again from its recording is not the same; this is our mistake.")
        measures = measures_of(again.result, placed, again.tracks, self._place.depth)
        record = record_of(start, again.result, measures)
        self._now += timedelta(seconds=record.active_s + 60.0)
        self._study.store.record(record, at=self._utc())
        return record

    def _run(
        self, step: Step, placed: PlacedTask, order: tuple[str, ...], name: str, *, abort_s: float | None
    ) -> SimulatedRun:
        rig, rng = self._place.rig, self._rng
        world = TwinWorld(rig, seed=self._hands.seed, start_ns=_START_NS)
        pictures = len(self._trials) < self._rendered
        eye: Eye = PictureEye(world, rig) if pictures else TruthEye(world, rig, rng)
        usual = Skill()
        learnt = self._hands.practice ** sum(not each.practice for each in self._trials)
        easier = learnt * self._hands.view ** self._rank(step.condition)
        skill = Skill(self._pace * learnt, usual.look_s * easier / learnt, usual.aside * easier)
        hand = SteeringHand(world.body, placed, skill, rng)
        return simulated_run(
            placed, order, world=world, eye=eye, hand=hand, trial=name, abort_s=abort_s, with_truth=pictures
        )

    def _record(self, folder: Path, run: SimulatedRun, start: TrialStart) -> None:
        writer = SessionWriter(
            folder,
            rig=self._place.rig,
            config={"source": "twin", "simulated_hand": True, "rendered": bool(run.truths), "seed": self._hands.seed},
            clock_pair=(run.began_ns, start.began),
            videos=False,
            registration=self._place.registration,
        )
        try:
            for track in run.tracks:
                writer.write_track(track)
            for truth in run.truths:
                writer.write_truth(truth)
            for event in run.events:
                writer.write_event(event)
        finally:
            writer.close()
        write_label(folder, start, study=self._study.design.key)

    def _rank(self, condition: str) -> int:
        return [each.key for each in self._study.design.conditions].index(condition)

    def _utc(self) -> str:
        return self._now.isoformat(timespec="milliseconds").replace("+00:00", "Z")


@contextmanager
def _shown(trials: int) -> Iterator[Callable[[str], None]]:
    """Yield what is told of each trial as it begins; a bar on stderr where that is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("Simulating", total=trials)

        def advance(what: str) -> None:
            bar.update(task, description=what, advance=0 if "practice" in what else 1)

        yield advance
