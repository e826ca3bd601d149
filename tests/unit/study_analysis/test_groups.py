"""Groups of people: found again where they were put in, and not where they were not."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from cathxr.core.trials import TrialRecord
from cathxr.study.analysis.data import Condition, Measure, StudyData
from cathxr.study.analysis.groups import groups
from cathxr.study.simulate import Effects, Plan, simulated

CONDITIONS = (Condition("2d", "2D view"), Condition("3d", "3D view"))
PATH = Measure("path_length", "Path length", "mm", log=True)


def grouped(*, level: float, view: float, count: int = 12, seed: int = 1) -> StudyData:
    """Novices and experts by turns of two; experts' log times differ by `level`, and by `view` more in 3D."""
    plan = Plan(participants=count)
    drawn = simulated(plan, Effects(sd_person=0.1, sd_trial=0.1), np.random.default_rng(seed))
    names = {each.code: ("novice", "expert")[at // 2 % 2] for at, each in enumerate(drawn.participants)}

    def moved(trial: TrialRecord) -> TrialRecord:
        if names[trial.participant] == "novice":
            return trial
        factor = math.exp(level + (view if trial.condition == "3d" else 0.0))
        measures = {**trial.measures, "path_length": trial.measures["path_length"] * factor}
        return replace(trial, active_s=trial.active_s * factor, measures=measures)

    people = tuple(replace(each, group=names[each.code]) for each in drawn.participants)
    return StudyData("g", CONDITIONS, people, tuple(map(moved, drawn.trials)), secondary=(PATH,))


def test_a_study_without_groups_has_none() -> None:
    data = grouped(level=0.0, view=0.0)
    assert groups(replace(data, participants=tuple(replace(each, group="") for each in data.participants))) is None
    assert groups(replace(data, participants=tuple(replace(each, group="x") for each in data.participants))) is None


def test_levels_and_changes_are_found_as_they_were_put_in() -> None:
    found = groups(grouped(level=math.log(0.6), view=math.log(0.7), count=24))
    assert found is not None
    assert [(each.name, each.participants) for each in found.results] == [("novice", 12), ("expert", 12)]
    level, change, path = found.differences
    assert (level.kind, level.reference, level.subject, level.sizes) == ("level", "novice", "expert", (12, 12))
    # the level is the mean over both views, so half of the change counts; people spread by 0.1: a mean of 12 by 0.04
    assert level.effect.value == pytest.approx(math.log(0.6) + math.log(0.7) / 2, abs=0.15)
    assert level.effect.high < 0.0
    assert level.rank_sum.p < 0.001
    assert "In group expert, completion time was" in level.reading
    assert change.effect.value == pytest.approx(math.log(0.7), abs=0.15)
    assert change.effect.excludes_zero
    assert "Completion time with 3D view relative to that with 2D view was" in change.reading
    assert (path.measure.key, path.kind, path.holm_p) == ("path_length", "level", path.p)
    # in each group by itself the view does what it was made to do
    views = [each.model.view for each in found.results]
    assert [each.effect.value for each in views if each] == pytest.approx([math.log(0.75), math.log(0.525)], abs=0.12)


def test_the_difference_is_welch_s_of_people_s_own_means() -> None:
    data = grouped(level=0.2, view=0.0)
    found = groups(data)
    assert found is not None
    by_group: dict[str, list[float]] = {"novice": [], "expert": []}
    for person in data.participants:
        mine = [each for each in data.trials if each.participant == person.code]
        by_view = [[math.log(each.active_s) for each in mine if each.condition == view] for view in ("2d", "3d")]
        by_group[person.group].append(float(np.mean([np.mean(each) for each in by_view])))
    expected = stats.ttest_ind(by_group["expert"], by_group["novice"], equal_var=False)
    assert found.differences[0].p == pytest.approx(expected.pvalue)


def test_a_group_that_is_too_small_is_said_and_not_compared() -> None:
    data = grouped(level=0.2, view=0.0)
    experts = [each.code for each in data.participants if each.group == "expert"]
    few = replace(data, trials=tuple(each for each in data.trials if each.participant not in experts[1:]))
    nobody = replace(few, participants=tuple(each for each in few.participants if each.code != "SIM001"))
    found = groups(nobody)
    assert found is not None
    assert found.differences == ()
    assert found.too_few == ("expert and novice",)
    assert found.ungrouped == ("SIM001",)
    assert found.results[1].model.why


def test_no_difference_is_found_about_as_often_as_chance_makes_one() -> None:
    made = [groups(grouped(level=0.0, view=0.0, count=8, seed=seed)) for seed in range(20)]
    wrong = sum(each.differences[0].p <= 0.05 for each in made if each is not None)
    # 20 draws at 0.05 are 1 on average; 5 or more have a probability of 0.003
    assert wrong <= 4
