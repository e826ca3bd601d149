"""Simulated studies with effects that are known: numbers only, to prove the statistics and to try out a report.

A trial's time is drawn as log(time) = level + person + view + practice + noise. Practice acts on the ordinal number of
a person's trials, whatever the view; so a period's effect is trials-a-view times that of one trial.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from cathxr.core.trials import Outcome, Participant, TargetResult, TrialRecord


@dataclass(frozen=True)
class Effects:
    """What is true in a simulated study, on the log of the time.

    level: of a first trial with the first view, s. view: log ratio of the second view (and, times k, of the k-th) to
    the first. practice: log ratio of each further trial to the one before. sd_person, sd_trial: spread between people,
    and of a person's trials. sd_view: how much people differ in the view's effect; above 0, the mixed model's
    assumption is not met. limit_s: the time limit; None: there is none. carry_over: log ratio that the first view, once
    done, leaves on all trials of the next period.
    """

    level_s: float = 120.0
    view: float = math.log(0.75)
    practice: float = math.log(0.93)
    sd_person: float = 0.30
    sd_trial: float = 0.25
    sd_view: float = 0.0
    limit_s: float | None = None
    carry_over: float = 0.0


@dataclass(frozen=True)
class Plan:
    """The shape of a simulated study: people are dealt to the sequences in turn. conditions: keys in order."""

    participants: int = 8
    trials: int = 3
    conditions: tuple[str, ...] = ("2d", "3d")
    sequences: tuple[tuple[str, ...], ...] = (("2d", "3d"), ("3d", "2d"))
    task: str = "six-targets"
    targets: int = 6
    practice: int = 0
    """How many practice trials each person does first."""


EVERYBODY_2D_FIRST = (("2d", "3d"),)
"""The sequences of a study in which view and practice cannot be told apart."""


@dataclass(frozen=True)
class SimulatedStudy:
    """Participants and trials as a store would give them; the seed is the generator's."""

    participants: tuple[Participant, ...]
    trials: tuple[TrialRecord, ...]


_FIRST_DAY = datetime(2026, 1, 5, 9, 0, tzinfo=UTC)


def simulated(plan: Plan, effects: Effects, rng: np.random.Generator) -> SimulatedStudy:
    """Return a study's participants (SIM001, …) and trials, drawn by `rng`."""
    people, trials = [], []
    for at in range(plan.participants):
        order = plan.sequences[at % len(plan.sequences)]
        code = f"SIM{at + 1:03d}"
        start = _FIRST_DAY + timedelta(days=at // 4, hours=at % 4 * 2)
        people.append(Participant(code, ">".join(order), "", _utc(start)))
        trials += _of_person(code, order, start, plan, effects, rng)
    return SimulatedStudy(tuple(people), tuple(trials))


def _of_person(
    code: str, order: Sequence[str], start: datetime, plan: Plan, effects: Effects, rng: np.random.Generator
) -> list[TrialRecord]:
    person = rng.normal(0.0, effects.sd_person)
    own_view = effects.view + rng.normal(0.0, effects.sd_view)
    trials, when = [], start
    for number in range(1, plan.practice + 1):
        trials.append(_trial(code, order[0], number, 0, when, 0.4 * effects.level_s, plan, None, rng))
        when += timedelta(seconds=trials[-1].active_s + 30.0)
    done = 0
    for period, condition in enumerate(order, start=1):
        carried = effects.carry_over if period > 1 and order[period - 2] == plan.conditions[0] else 0.0
        for number in range(1, plan.trials + 1):
            log_s = math.log(effects.level_s) + person + own_view * plan.conditions.index(condition)
            log_s += carried + effects.practice * done + rng.normal(0.0, effects.sd_trial)
            trials.append(_trial(code, condition, number, period, when, math.exp(log_s), plan, effects.limit_s, rng))
            when += timedelta(seconds=trials[-1].active_s + 60.0)
            done += 1
        when += timedelta(minutes=10.0)
    return trials


def _trial(
    code: str,
    condition: str,
    number: int,
    period: int,
    when: datetime,
    full_s: float,
    plan: Plan,
    limit_s: float | None,
    rng: np.random.Generator,
) -> TrialRecord:
    """Return a trial of full_s seconds, cut at the limit: its targets are reached at random shares of that time."""
    shares = np.cumsum(rng.dirichlet(np.full(plan.targets, 8.0)))
    cut = limit_s is not None and full_s > limit_s
    active_s = float(limit_s) if cut and limit_s is not None else full_s
    speed = 14.0 * math.exp(rng.normal(0.0, 0.15))  # mm/s: the tip's, so that longer trials have longer paths
    targets, offered_s = [], 0.0
    for at, share in enumerate(shares):
        reached = float(share) * full_s
        known = reached <= active_s + 1e-9
        if offered_s < active_s:
            last = reached if known else active_s
            targets.append(TargetResult(f"t{at + 1}", offered_s, last if known else None, speed * (last - offered_s)))
        else:
            targets.append(TargetResult(f"t{at + 1}", active_s, None, 0.0))
        offered_s = min(reached, active_s)
    reached_count = sum(each.reached_s is not None for each in targets)
    measures = {
        "t": active_s,
        "nT": float(reached_count),
        "path_length": speed * active_s,
        "sparc": -2.0 - 0.004 * active_s + rng.normal(0.0, 0.2),
        "idle_time": active_s * float(rng.beta(4.0, 16.0)),
        "breach_count": float(rng.poisson(active_s / 60.0)),
    }
    if reached_count:
        measures["tT"] = active_s / reached_count
    return TrialRecord(
        f"{code}-{period}-{condition}-{number}",
        code,
        "practice" if period == 0 else plan.task,
        condition,
        number,
        period,
        _utc(when),
        Outcome.TIMED_OUT if cut else Outcome.COMPLETED,
        active_s,
        tuple(targets),
        measures,
        unseen_share=float(rng.beta(1.0, 60.0)),
        practice=period == 0,
        software="simulated",
    )


def _utc(when: datetime) -> str:
    return when.strftime("%Y-%m-%dT%H:%M:%SZ")
