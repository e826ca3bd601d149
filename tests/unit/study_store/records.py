"""Trials and answers to put into stores."""

from cathxr.core.trials import Answer, Outcome, TargetResult, TrialRecord

AT = "2026-01-02T00:00:00Z"


def trial(
    identifier: str, participant: str = "P01", *, condition: str = "2d", number: int = 1, **more: object
) -> TrialRecord:
    """Return a trial; `more` are other fields."""
    fields: dict[str, object] = {
        "id": identifier, "participant": participant, "task": "six_targets", "condition": condition, "number": number,
        "period": 1, "began": f"2026-01-01T10:00:{number:02d}Z", "outcome": Outcome.COMPLETED,
        "active_s": 12.5 + number,
        "targets": (TargetResult("a", 0.0, 3.1, 100.25, 1), TargetResult("b", 3.1, None, 1 / 3)),
        "measures": {"t": 0.1 + 0.2, "nT": 1.0, "tiny": 5e-324, "huge": 1.7976931348623157e308, "minus": -0.0},
        "unseen_share": 1 / 7, "session": f"recordings/{identifier}", "box": "box-2", "software": "1.2.3",
        "task_sha256": "ab" * 32,
    }  # fmt: skip
    return TrialRecord(**(fields | more))  # type: ignore[arg-type]


def answer(participant: str = "P01", item: str = "q1", value: float | None = 3.0, **more: str) -> Answer:
    """Return an answer; `more` are other fields."""
    fields = {"survey": "paper", "occasion": "end", "answered": AT} | more
    return Answer(participant=participant, item=item, value=value, **fields)
