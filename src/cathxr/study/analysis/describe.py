"""What was measured, before any model: by view, and by participant and view."""

import math
from dataclasses import dataclass

import numpy as np

from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.observations import observations


@dataclass(frozen=True)
class Described:
    """One view's trials of one measure, in its own unit (no logarithms). sd: the sample's; None for one trial.

    geometric: the geometric mean, for measures that are compared as ratios.
    """

    condition: str
    participants: int
    trials: int
    mean: float
    sd: float | None
    median: float
    low: float
    high: float
    geometric: float | None


@dataclass(frozen=True)
class PersonValues:
    """One participant's trials in one view, in order, in the measure's own unit; cut: which the time limit ended."""

    participant: str
    condition: str
    values: tuple[float, ...]
    cut: tuple[bool, ...]


def described(data: StudyData, measure: Measure) -> tuple[Described, ...]:
    """Return the description of each view that has trials, in the study's order."""
    observed = observations(data, measure)
    rows = []
    for condition in data.conditions:
        at = [i for i, each in enumerate(observed.trials) if each.condition == condition.key]
        if not at:
            continue
        scale = observed.y[at]
        values = np.exp(scale) if measure.log else scale
        rows.append(
            Described(
                condition.key,
                len({observed.trials[i].participant for i in at}),
                len(at),
                float(values.mean()),
                float(values.std(ddof=1)) if len(at) > 1 else None,
                float(np.median(values)),
                float(values.min()),
                float(values.max()),
                math.exp(float(scale.mean())) if measure.log else None,
            )
        )
    return tuple(rows)


def by_person(data: StudyData, measure: Measure) -> tuple[PersonValues, ...]:
    """Return each participant's values by view, sorted by code and in the study's order of views."""
    observed = observations(data, measure)
    places: dict[tuple[str, str], list[int]] = {}
    for i, each in enumerate(observed.trials):
        places.setdefault((each.participant, each.condition), []).append(i)
    rows = []
    for code in observed.participants:
        for condition in data.conditions:
            at = places.get((code, condition.key), [])
            if at:
                values = np.exp(observed.y[at]) if measure.log else observed.y[at]
                cut = observed.censored[at]
                rows.append(
                    PersonValues(code, condition.key, tuple(map(float, values)), tuple(bool(each) for each in cut))
                )
    return tuple(rows)
