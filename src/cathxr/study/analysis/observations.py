"""One row for each trial that counts: the columns that models take, and what was left out and why."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from cathxr.core.arrays import FloatArray
from cathxr.core.trials import Outcome, TrialRecord
from cathxr.study.analysis.data import Measure, StudyData, counted


@dataclass(frozen=True, eq=False)
class Observations:
    """N trials of one measure. y: (N,) on the measure's scale (log taken); censored: (N,) bool, cut by the time limit.

    missing: how many counted trials have no value, and so are not among them.
    """

    measure: Measure
    trials: tuple[TrialRecord, ...]
    sequences: tuple[str, ...]
    y: FloatArray
    missing: int

    @property
    def participants(self) -> tuple[str, ...]:
        """The participants' codes, each once, sorted."""
        return tuple(sorted({each.participant for each in self.trials}))

    @property
    def censored(self) -> np.ndarray:
        """Which trials the time limit cut, for a time; none for other measures, which are then of what was done."""
        cut = [self.measure.key == "t" and each.outcome is Outcome.TIMED_OUT for each in self.trials]
        return np.array(cut, dtype=bool)

    def where(self, keep: np.ndarray) -> "Observations":
        """Return the trials where `keep` (N,) bool is true."""
        at = np.flatnonzero(keep)
        return Observations(
            self.measure,
            tuple(self.trials[i] for i in at),
            tuple(self.sequences[i] for i in at),
            self.y[at],
            self.missing,
        )


def observations(data: StudyData, measure: Measure) -> Observations:
    """Return the trials of the study's conditions that count and have a value of `measure`, in order of their start."""
    known = {each.key for each in data.conditions}
    trials = sorted((each for each in counted(data.trials) if each.condition in known), key=lambda each: each.began)
    sequence_of = {each.code: each.sequence for each in data.participants}
    values = [(each, measure.value_of(each)) for each in trials]
    full = [(trial, value) for trial, value in values if value is not None]
    return Observations(
        measure,
        tuple(trial for trial, _ in full),
        tuple(sequence_of.get(trial.participant, "") for trial, _ in full),
        np.array([value for _, value in full], dtype=np.float64),
        len(values) - len(full),
    )


def ordinals(trials: tuple[TrialRecord, ...]) -> tuple[int, ...]:
    """Return each trial's place (1, 2, …) among those of its participant: by period, number, then start."""
    order = sorted(range(len(trials)), key=lambda i: (trials[i].period, trials[i].number, trials[i].began))
    seen: Counter[str] = Counter()
    places = [0] * len(trials)
    for i in order:
        seen[trials[i].participant] += 1
        places[i] = seen[trials[i].participant]
    return tuple(places)
