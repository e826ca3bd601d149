"""Designs and trials to test with."""

from cathxr.core.trials import Outcome, TargetResult, TrialRecord
from cathxr.study.design import StudyDesign
from cathxr.study.design_file import design_from_text
from cathxr.study.design_template import design_template

TEXT = design_template(key="views", title="Views", task="six_targets", practice="practice", planned=16)


def design(*changes: tuple[str, str]) -> StudyDesign:
    """Return the template's design with parts of its text replaced."""
    return design_from_text(changed(*changes))


def changed(*changes: tuple[str, str]) -> str:
    """Return the template's text with parts replaced."""
    text = TEXT
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def trial(number: int, condition: str = "2d", participant: str = "P01", **more: object) -> TrialRecord:
    """Return a trial that counts; `more` are other fields."""
    fields: dict[str, object] = {
        "id": f"{participant}-{condition}-{number}-{len(more)}", "participant": participant, "task": "six_targets",
        "condition": condition, "number": number, "period": 1, "began": f"2026-01-01T10:{number:02d}:00Z",
        "outcome": Outcome.COMPLETED, "active_s": 30.0, "targets": (TargetResult("a", 0.0, 3.0, 50.0),),
        "measures": {"t": 30.0},
    }  # fmt: skip
    return TrialRecord(**(fields | more))  # type: ignore[arg-type]
