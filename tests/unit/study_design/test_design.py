"""study.toml: what it says is what the design has, and every fault is a sentence."""

from itertools import pairwise

import pytest

from cathxr.core import ConfigError
from cathxr.core.latin_square import williams_orders
from cathxr.core.participant_code import participant_code_fault
from cathxr.core.trials import Answer, Outcome, Participant, TrialRecord
from cathxr.study.design import Asked
from cathxr.study.design_file import design_from_text, sequences_of

from .designs import changed, design


def test_the_template_is_a_balanced_crossover() -> None:
    made = design()
    assert made.sequences == (("2d", "3d"), ("3d", "2d"))
    assert made.balanced
    assert made.trials_a_condition == 3
    assert made.primary == "t"
    assert [each.key for each in made.exclusions] == ["unseen", "ended", "too_few"]
    assert made.seed is None
    plans = {(each.survey, each.asked) for each in made.surveys}
    assert ("tlx", Asked.EACH) in plans
    assert made.occasions(made.surveys[1], ("3d", "2d")) == ("after:3d", "after:2d")


@pytest.mark.parametrize("count", range(1, 9))
def test_williams_orders_are_balanced(count: int) -> None:
    orders = williams_orders(count)
    assert len(orders) == (count if count % 2 == 0 or count == 1 else 2 * count)
    assert len(set(orders)) == len(orders)
    for column in zip(*orders, strict=True):
        assert sorted(column) == sorted(list(range(count)) * (len(orders) // count))
    neighbours = [pair for order in orders for pair in pairwise(order)]
    times = {neighbours.count(pair) for pair in neighbours}
    assert len(set(neighbours)) == count * (count - 1)
    assert len(times) <= 1


def test_kinds_of_sequences() -> None:
    assert sequences_of("crossover", ("a", "b")) == (("a", "b"), ("b", "a"))
    assert len(sequences_of("latin", ("a", "b", "c"))) == 6
    assert len(sequences_of("permutations", ("a", "b", "c", "d"))) == 24
    for kind, count in (("crossover", 3), ("permutations", 5)):
        with pytest.raises(ValueError, match=kind):
            sequences_of(kind, tuple("abcdef"[:count]))


def test_two_d_first_for_all_is_not_balanced() -> None:
    made = design(('kind = "crossover" ', 'kind = "listed"\nlisted = [["2d", "3d"]] '))
    assert made.sequences == (("2d", "3d"),)
    assert not made.balanced


def test_several_tasks_take_turns() -> None:
    made = design(('tasks = ["six_targets"]', 'tasks = ["six_targets", "roll"]'))
    assert made.trials_a_condition == 6
    assert [made.task_of(each) for each in (1, 2, 3)] == ["six_targets", "roll", "six_targets"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('schema = "cathxr-study/1"', 'schema = "cathxr-study/2"', 'schema: expected "cathxr-study/1"'),
        ("planned = 16", "planned = 0", "participants.planned: .*greater than or equal to 1, got 0"),
        ("planned = 16", 'planned = "16"', "participants.planned: .*valid integer"),
        ("planned = 16", "planed = 16", r"participants.planned: expected this key, got none"),
        ("planned = 16", "planned = 16\nplaned = 3", r"participants.planed: not a key of this file"),
        ('view = "3d"', 'view = "4d"', "conditions.3d.view"),
        ('kind = "crossover"', 'kind = "listed"', "sequences: give `listed`"),
        ('kind = "crossover"', 'kind = "listed"\nlisted = [["2d", "2d"]]', "expected each to hold"),
        ("above = 0.25", "", "unseen: the measure unseen_share takes `above` or `below`"),
        ("above = 0.25", "above = nan", "exclusions.0.above: .*finite number"),
        ('"aborted", "interrupted"', '"aborted", "intrrupted"', "ended: is: expected of .*, got intrrupted"),
        ('name = "3D view"', 'name = "2D view"', "conditions: names: expected each once, got 2D view twice"),
        ('["six_targets"]', '["roll", "roll"]', "trials.tasks: expected each once, got roll twice"),
        ('["nT", "tT"', '["t", "tT"', "outcomes: expected each once, got t twice"),
        ("planned = 16", 'planned = 16\ngroups = ["a", "a"]', "groups: expected each once, got a twice"),
        ('title = "Views"', 'title = "a\\u0000b"', r"title: expected letters and signs, got the control .*U\+0000"),
        ('question = "Does', 'question = "\\u001bDoes', r"question: .*U\+001B"),
        ('is = ["aborted", "interrupted"]', "above = 3.0", "ended: the measure outcome takes `is`"),
        ('measure = "valid_trials"', 'measure = "unseen_share"', "too_few: participants are judged by"),
        ('key = "ended"', 'key = "unseen"', "exclusions: expected different keys"),
        ("blocks = [1, 2]", "blocks = []", "allocation.blocks"),
        ("planned = 16", "planned = ", "expected TOML, got a mistake in it"),
    ],
)  # fmt: skip
def test_faults_are_sentences(old: str, new: str, told: str) -> None:
    with pytest.raises(ConfigError, match=rf"^views/study.toml: .*{told}") as error:
        design_from_text(changed((old, new)), name="views/study.toml")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("code", ["P01", "S1", "EXP12", "N-07", "SIM001", "01-12", "A-B-3", "99"])
def test_codes(code: str) -> None:
    assert participant_code_fault(code) is None
    assert Participant(code).code == code


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("ANNA", "looks like a name"), ("MARIE1", "looks like a name"), ("AB", "looks like a name"),
        ("19800504", "date or a person's number"), ("1980-05-04", "date or"), ("04-05-80", "date or"),
        ("AB1980", "date or"), ("123456", "date or"), ("P1234567", "date or"),
        ("anna", "expected 2 to 12 capitals"), ("p01", "write P01"), ("", "expected 2 to 12"),
        ("P 01", "expected 2 to"),
        ("P01-", "expected 2 to"), ("É1", "expected 2 to"), ("P01\n", "expected 2 to"), ("P٣", "expected 2 to"),
        ("ABC-DEF-GHI-1", "expected 2 to"),
    ],
)  # fmt: skip
def test_codes_that_tell_who_it_is(code: str, told: str) -> None:
    assert told in str(participant_code_fault(code))
    for make in (lambda: Participant(code), lambda: Answer(code, "s", "i", "end", "", 1.0)):
        with pytest.raises(ValueError, match="participant"):
            make()


@pytest.mark.parametrize(
    "wrong",
    [{"active_s": -1.0}, {"active_s": float("nan")}, {"unseen_share": 1.1}, {"measures": {"t": float("inf")}},
     {"number": 0}, {"period": -1}, {"id": ""}],
)  # fmt: skip
def test_trials_that_cannot_be(wrong: dict[str, object]) -> None:
    fields = {"id": "a", "participant": "P01", "task": "t", "condition": "2d", "number": 1, "period": 1, "began": "",
              "outcome": Outcome.COMPLETED, "active_s": 1.0}  # fmt: skip
    TrialRecord(**fields)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="expected"):
        TrialRecord(**(fields | wrong))  # type: ignore[arg-type]


def test_measures_cannot_be_changed_afterwards() -> None:
    given = {"t": 1.0}
    made = TrialRecord("a", "P01", "t", "2d", 1, 1, "", Outcome.COMPLETED, 1.0, measures=given)
    given["t"] = 2.0
    assert made.measures["t"] == 1.0
    with pytest.raises(TypeError):
        made.measures["t"] = 3.0  # type: ignore[index]
