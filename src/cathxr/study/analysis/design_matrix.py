"""The columns of the model view + period + sequence + trial (+ task), and whether the view stands alone in them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core.arrays import FloatArray
from cathxr.core.trials import TrialRecord
from cathxr.study.analysis.data import StudyData
from cathxr.study.analysis.observations import Observations


@dataclass(frozen=True)
class Column:
    """One fixed effect. kind: "view", "period", "sequence", "trial", "task"; level: which one against the first."""

    kind: str
    level: str
    within: bool

    @property
    def name(self) -> str:
        """The term as a table prints it."""
        if self.kind == "trial":
            return "trial: each further one"
        return f"{self.kind}: {self.level}"


@dataclass(frozen=True, eq=False)
class DesignMatrix:
    """X: (N, 1 + C), the first column is 1; columns: (C,). Factors are centred, so that the intercept is a mean.

    dropped: the terms that cannot be told from those kept, in words. view_alone: whether the view's columns can be told
    from all others that the study varied; else what is called the view holds the others as well.
    """

    matrix: FloatArray
    columns: tuple[Column, ...]
    dropped: tuple[str, ...]
    view_alone: bool


def design_matrix(observed: Observations, data: StudyData, *, without: Sequence[str] = ()) -> DesignMatrix:
    """Return the columns for the observations; `without`: kinds to leave out on purpose.

    A column that is a combination of earlier ones is dropped and named. Their order is view, period, trial, task,
    sequence; where the view cannot be told from the period, view_alone is False and the period is dropped.
    """
    candidates = [(column, values) for column, values in _candidates(observed, data) if column.kind not in without]
    n = len(observed.trials)
    kept: list[tuple[Column, FloatArray]] = []
    dropped: list[str] = []
    basis = np.ones((n, 1))
    for column, values in candidates:
        trial = np.column_stack([basis, values - values.mean()])
        if np.linalg.matrix_rank(trial) == trial.shape[1]:
            basis = trial
            kept.append((column, values - values.mean()))
        else:
            dropped.append(column.name)
    return DesignMatrix(basis, tuple(column for column, _ in kept), tuple(dropped), _view_alone(observed, candidates))


def _view_alone(observed: Observations, candidates: list[tuple[Column, FloatArray]]) -> bool:
    """Return whether the view's columns add rank to all the others, people's own levels included."""
    people = np.unique([each.participant for each in observed.trials], return_inverse=True)[1]
    counts = np.bincount(people)

    def within(values: FloatArray) -> FloatArray:
        return values - (np.bincount(people, values) / counts)[people]

    views = [within(values) for column, values in candidates if column.kind == "view"]
    others = [within(values) for column, values in candidates if column.kind != "view"]
    if not views:
        return False
    rest = int(np.linalg.matrix_rank(np.column_stack(others), tol=1e-8)) if others else 0
    return int(np.linalg.matrix_rank(np.column_stack([*others, *views]), tol=1e-8)) == rest + len(views)


def _candidates(observed: Observations, data: StudyData) -> list[tuple[Column, FloatArray]]:
    trials = observed.trials
    present = {each.condition for each in trials}
    views = [each for each in data.conditions if each.key in present]
    columns = [
        (Column("view", each.name, True), _is([trial.condition for trial in trials], each.key)) for each in views[1:]
    ]
    columns += _factor("period", [str(each.period) for each in trials], within=True)
    if len({each.number for each in trials}) > 1:
        columns.append((Column("trial", "", True), np.array([each.number for each in trials], dtype=np.float64)))
    columns += _factor("task", [each.task for each in trials], within=_varies_within(trials))
    columns += _factor("sequence", [data.order_of(each) for each in observed.sequences], within=False)
    return columns


def _varies_within(trials: Sequence[TrialRecord]) -> bool:
    tasks: dict[str, set[str]] = {}
    for each in trials:
        tasks.setdefault(each.participant, set()).add(each.task)
    return any(len(found) > 1 for found in tasks.values())


def _factor(kind: str, values: Sequence[str], *, within: bool) -> list[tuple[Column, FloatArray]]:
    return [(Column(kind, level, within), _is(values, level)) for level in sorted(set(values))[1:]]


def _is(values: Sequence[str], level: str) -> FloatArray:
    return np.array([each == level for each in values], dtype=np.float64)
