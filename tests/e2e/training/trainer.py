"""What stands in for the server's side of training: it shows the page any state, and notes what the page asks for.

The real one is tried in `test_training_live.py`; here what the page and the headset make of its messages.
"""

import threading
import time
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from cathxr.core import ConfigError, Pose, Status, Track
from cathxr.wire.hub import Hub
from cathxr.wire.messages import Command
from cathxr.wire.training_messages import (
    CardLineMessage,
    RunPath,
    SurveyDescription,
    SurveyItem,
    TrainingNow,
    TrainingOffer,
    TrainingParticipant,
    TrainingResult,
    TrainingRun,
    TrainingState,
    TrainingTarget,
    TrainingTask,
    UnfinishedTrial,
)

Phase = Literal["idle", "ready", "countdown", "running", "paused", "ended"]
CAN: Mapping[str, tuple[str, ...]] = {
    "idle": ("training_prepare", "training_continue", "training_mark"),
    "ready": ("training_prepare", "training_begin", "training_close"),
    "countdown": ("training_abort",),
    "running": ("training_pause", "training_abort", "training_mark"),
    "paused": ("training_resume", "training_abort", "training_mark"),
    "ended": ("training_prepare", "training_repeat", "training_close", "training_mark"),
}
NAMES = ("Fossa ovalis", "Coronary sinus", "Mitral valve", "Left atrial appendage")
PLACES = ((60.0, -15.0, 10.0), (75.0, 20.0, -5.0), (85.0, -10.0, 25.0), (95.0, 12.0, 18.0))


def targets(*, reached: int = 0, offered: bool = True) -> list[TrainingTarget]:
    """Return four targets (two for the tip, a beam, a plane), so many of them reached and the next one offered."""
    kinds: tuple[Literal["tip", "beam", "plane"], ...] = ("tip", "tip", "beam", "plane")
    states: list[Literal["later", "now", "reached", "missed"]] = ["reached"] * reached + ["later"] * (4 - reached)
    if offered and reached < 4:
        states[reached] = "now"
    return [
        TrainingTarget(
            key=f"t{at}",
            name=NAMES[at],
            kind=kind,
            position_mm=PLACES[at],
            radius_mm=5.0,
            angle_deg=None if kind == "tip" else 15.0,
            direction=(0.0, 0.6, 0.8) if kind == "plane" else None,
            up=(0.0, -0.8, 0.6) if kind == "plane" else None,
            dwell_s=1.0,
            state=states[at],
        )
        for at, kind in enumerate(kinds)
    ]


def lines() -> list[CardLineMessage]:
    """Return a score card: a new best, a worse value, one that neither is, and one that could not be computed."""

    def line(key: str, name: str, unit: str, better: Literal["lower", "higher", "neither"], **more: Any) -> Any:
        start = {"value": None, "reason": "", "history": [], "best_before": None, "is_best": False}
        return CardLineMessage(
            key=key, name=name, unit=unit, better=better, **{**start, "percentile": None, "others": 0, **more}
        )

    return [
        line(
            "t", "Time on task", "s", "lower", value=41.3, history=[(1, 78.2), (2, 60.5), (3, 63.9), (4, 41.3)],
            best_before=60.5, is_best=True, percentile=72.0, others=11,
        ),
        line("nT", "Targets reached", "", "higher", value=4.0, history=[(1, 2.0), (2, 3.0), (3, 4.0), (4, 4.0)],
             best_before=4.0, is_best=True),
        line(
            "path_length", "Path length", "mm", "lower", value=812.0, best_before=701.0,
            history=[(1, 990.0), (2, 744.0), (3, 701.0), (4, 812.0)], percentile=40.0, others=11,
        ),
        line(
            "sparc", "Smoothness (SPARC)", "", "higher", value=-3.21, history=[(3, -3.9), (4, -3.21)],
            best_before=-3.9, is_best=True,
        ),
        line("breach_count", "Wall breaches", "", "lower", value=3.0, history=[(3, 2.0), (4, 3.0)], best_before=2.0),
        line("axial_motion", "Motion along the tip", "mm", "neither", value=402.0, history=[(3, 455.0), (4, 402.0)]),
        line("dtw", "Distance to the expert's path", "mm", "lower", reason="There is no expert's path for this task."),
    ]  # fmt: skip


def survey() -> SurveyDescription:
    """Return a survey with a scale of five, one of 21 steps, one with names, and one to be answered in words."""

    def item(key: str, text: str, **more: Any) -> SurveyItem:
        start = {"kind": "rating", "minimum": 1.0, "maximum": 5.0, "step": 1.0, "low": "strongly disagree"}
        rest = {"high": "strongly agree", "labels": [], "optional": False}
        return SurveyItem(key=key, text=text, **{**start, **rest, **more})

    return SurveyDescription(
        participant="P01",
        survey="own",
        name="After the trials",
        instruction="Please say how far you agree with each sentence. Answer at once, without long thought.",
        source="made for this test",
        occasion="after 3d",
        items=[
            item("q1", "I think that I would like to use this system frequently."),
            item(
                "q2", "How mentally demanding was the task?", minimum=0.0, maximum=100.0, step=5.0,
                low="very low", high="very high",
            ),
            item(
                "q3", "Eyestrain", minimum=0.0, maximum=3.0, labels=["none", "slight", "moderate", "severe"],
                low="none", high="severe",
            ),
            item(
                "why", "What was hardest, and why?", kind="words", minimum=0.0, maximum=0.0, low="", high="",
                optional=True,
            ),
        ],
        answers={},
    )  # fmt: skip


def run_path() -> RunPath:
    """Return a run of six seconds: the tip goes round an arc, is lost for a moment, and reaches two targets."""
    t = np.arange(0.0, 6.0, 0.05)
    tips = np.stack([60.0 + 5.0 * t, 25.0 * np.sin(t), 20.0 * np.cos(t)], axis=1)
    seen = (t < 3.0) | (t > 3.4)
    shapes = [np.linspace(tip, (0.0, 0.0, 0.0), 12) for tip in tips]
    rows = list(zip(tips, shapes, seen, strict=True))
    return RunPath(
        id="run-1",
        participant="P01",
        task="six_targets",
        t=[float(each) for each in t],
        tip=[_three(tip) if known else None for tip, _, known in rows],
        beam=[(0.0, -1.0, 0.0) if known else None for *_, known in rows],
        shape=[[_three(point) for point in shape] if known else None for _, shape, known in rows],
        targets=targets(reached=2, offered=False),
        reached=[("t0", 1.5), ("t1", 4.5)],
    )


def _three(point: Any) -> tuple[float, float, float]:
    return float(point[0]), float(point[1]), float(point[2])


class Trainer:
    """Publishes states and Tracks, and carries out what operators ask for as the real one says it does."""

    def __init__(self, hub: Hub) -> None:
        self.hub = hub
        self.asked: list[tuple[str, dict[str, Any]]] = []
        self.phase: Phase = "idle"
        self.reached, self.progress, self.active_s = 0, 0.0, 0.0
        self.hindrance, self.refusal = "", ""
        self.survey: SurveyDescription | None = None
        self.outcome: Literal["completed", "aborted"] = "completed"
        self.chosen: dict[str, Any] = {}
        self.number = 1
        self.tip = np.array([50.0, 0.0, 0.0])
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._tracks, daemon=True)
        self.offer(study=None)
        self.publish()
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()

    def offer(self, *, study: str | None, unfinished: bool = False) -> None:
        tasks = [
            TrainingTask(key=key, name=name, text=text, view=view, step=step, practice=practice, problem=problem)
            for key, name, text, view, step, practice, problem in (
                ("practice", "Practice", "Reach targets until three in a row were reached.", "free", None, True, ""),
                ("insertion", "Insertion", "Advance and withdraw the catheter, nothing else.", "3d", 1, False, ""),
                ("six", "Six targets", "Reach the six targets with the tip, in any way.", "3d", 4, False, ""),
                (
                    "laa",
                    "Appendage view",
                    "Turn the plane.",
                    "2d",
                    5,
                    False,
                    "This heart has no landmark aortic_valve.",
                ),
            )
        ]
        people = [
            TrainingParticipant(code="P01", next="2D view, trial 2 of 3" if study else "", done=False),
            TrainingParticipant(code="P02", next="practice" if study else "", done=False),
            TrainingParticipant(code="P03", next="", done=study is not None),
        ]
        left = UnfinishedTrial(
            id="old-1",
            participant="P02",
            task="Six targets",
            began="2026-01-31T10:00:00Z",
            sentence="The program ended 31 s into it, with 2 of 6 targets reached.",
            can_continue=True,
        )
        self.hub.publish_training_offer(
            TrainingOffer(study=study, tasks=tasks, participants=people, unfinished=[left] if unfinished else [])
        )

    def publish(self) -> None:
        """Tell everybody how it stands."""
        self.hub.publish_training(self.message())

    def message(self) -> TrainingState:
        """Return how it stands."""
        at_hand = self.phase != "idle"
        now = self._now() if self.phase in ("running", "paused") else None
        return TrainingState(
            phase=self.phase,
            countdown_s=3.0 if self.phase == "countdown" else None,
            run=self._run() if at_hand else None,
            now=now,
            result=self._result() if self.phase == "ended" else None,
            survey=self.survey,
            sentence="",
            can=list(CAN[self.phase]) + ([] if self.survey is None else ["survey_answer"]),
        )

    def show(self, phase: Phase, **change: Any) -> None:
        """Go to a phase, with other figures."""
        self.phase = phase
        for name, value in change.items():
            setattr(self, name, value)
        self.publish()

    def carry_out(self, command: Command) -> Mapping[str, Any]:
        """Do what a page asks for."""
        self.asked.append((command.name, dict(command.args)))
        if self.refusal:
            raise ConfigError(self.refusal)
        if command.name == "survey_answer":
            return self._answer(command.args)
        after: dict[str, Phase] = {
            "training_prepare": "ready",
            "training_begin": "countdown",
            "training_pause": "paused",
            "training_resume": "running",
            "training_abort": "ended",
            "training_repeat": "ready",
            "training_close": "idle",
            "training_continue": "ready",
        }
        if command.name == "training_prepare":
            self.chosen = dict(command.args)
        if command.name == "training_abort":
            self.outcome = "aborted"
        if command.name == "training_repeat":
            self.number += 1
        self.show(after.get(command.name, self.phase))
        return {"phase": self.phase}

    def _answer(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        assert self.survey is not None
        given = {key: float(each) if isinstance(each, int) else each for key, each in args["answers"].items()}
        answers = {**self.survey.answers, **given}
        self.survey = None if args.get("done") else self.survey.model_copy(update={"answers": answers})
        self.publish()
        return {}

    def _run(self) -> TrainingRun:
        view = self.chosen.get("view", "3d")
        return TrainingRun(
            id=f"trial-{self.number}",
            participant=self.chosen.get("participant", "P01"),
            task=self.chosen.get("task", "six"),
            name="Six targets",
            text="Reach the six targets with the tip, in any way.",
            view=view,
            condition="",
            number=self.number,
            practice=False,
            limit_s=120.0,
            targets=targets(reached=self.reached, offered=self.phase != "ended"),
        )

    def _now(self) -> TrainingNow:
        target = None if self.reached >= 4 else f"t{self.reached}"
        away = 0.0 if target is None else float(np.linalg.norm(np.array(PLACES[self.reached]) - self.tip))
        return TrainingNow(
            target=target,
            number=min(4, self.reached + 1),
            of=4,
            reached=self.reached,
            in_a_row=0,
            wanted_in_a_row=None,
            progress=self.progress,
            distance_mm=away,
            angle_deg=None if self.reached < 2 else 23.4,
            up_deg=None if self.reached < 3 else 11.0,
            hindrance=self.hindrance,
            active_s=self.active_s,
            remaining_s=120.0 - self.active_s,
            target_remaining_s=None,
        )

    def _result(self) -> TrainingResult:
        done = self.outcome == "completed"
        return TrainingResult(
            outcome=self.outcome,
            sentence="All four targets were reached." if done else "It was aborted by the operator.",
            reached=4 if done else self.reached,
            of=4,
            active_s=41.3,
            unseen_share=0.02,
            invalid="" if done else "aborted",
            recording="P01-six-1",
            stored="Stored, with its recording.",
            run="/training/runs/run-1.json",
            lines=lines(),
        )

    def _tracks(self) -> None:
        for seq in range(10**6):
            if self._stop.wait(0.08):
                return
            shape = np.linspace(self.tip, (0.0, 0.0, 0.0), 50)
            z = shape[0] / np.linalg.norm(shape[0])
            x = np.array([0.0, -1.0, 0.0]) + z[1] * z
            x /= np.linalg.norm(x)
            rotation = np.stack([x, np.cross(z, x), z], axis=1)
            pose = Pose.from_matrix(rotation, shape[0])
            track = Track(seq, time.monotonic_ns(), Status.TRACKED, "", shape, pose, 0.0, 0.1, 5_000_000)
            self.hub.publish_track(track)
