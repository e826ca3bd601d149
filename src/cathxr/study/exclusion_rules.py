"""Rules that exclude trials or participants, stated before the data."""

import math
from dataclasses import dataclass
from enum import StrEnum

from cathxr.core.trials import Outcome


class RuleOf(StrEnum):
    """What a rule excludes."""

    TRIAL = "trial"
    PARTICIPANT = "participant"


VALID_TRIALS = "valid_trials"
"""For participants: the number of trials that are left in the condition that has fewest."""
PRACTICE = "practice"
"""For participants: the outcome of the last practice, `missing` where there was none."""
MISSING = "missing"
"""What `practice` is where there was none."""
OUTCOME = "outcome"
"""For trials: how it ended."""
FIELDS = ("active_s", "reached", "unseen_share")
"""For trials, beside the metrics: numbers of the record itself."""


def _words_of(measure: str) -> tuple[str, ...]:
    """Return the words that a measure of words can be."""
    return tuple(Outcome) if measure == OUTCOME else (*Outcome, MISSING)


@dataclass(frozen=True)
class Rule:
    """One rule: what `of` is excluded when its `measure` is above or below a limit, or is one of some words.

    measure: for trials `outcome`, `active_s`, `reached`, `unseen_share` or a metric's key; for participants
    `valid_trials` or `practice`. reason: why, in words for the report. A metric that a trial does not have excludes
    nothing.
    """

    key: str
    reason: str
    of: RuleOf
    measure: str
    above: float | None = None
    below: float | None = None
    among: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        words = self.measure in (PRACTICE, OUTCOME)
        limits = [each for each in (self.above, self.below) if each is not None]
        if words != bool(self.among) or words == bool(limits):
            told = "`is`, a list of words" if words else "`above` or `below`, a number"
            raise ValueError(f"{self.key}: the measure {self.measure} takes {told}")
        known = _words_of(self.measure)
        odd = next((each for each in self.among if each not in known), None)
        if odd is not None:
            raise ValueError(f"{self.key}: is: expected of {', '.join(known)}, got {odd}")
        if any(not math.isfinite(each) for each in limits):
            raise ValueError(f"{self.key}: expected finite limits, got {limits}")
        if (self.of is RuleOf.PARTICIPANT) != (self.measure in (PRACTICE, VALID_TRIALS)):
            raise ValueError(
                f"{self.key}: participants are judged by {VALID_TRIALS} or {PRACTICE}, trials by {OUTCOME}, "
                f"{', '.join(FIELDS)} or a metric; got {self.measure} of a {self.of}"
            )

    @property
    def sentence(self) -> str:
        """The rule in words."""
        if self.among:
            test = f"is {' or '.join(self.among)}"
        else:
            tests = (("is above", self.above), ("is below", self.below))
            test = " or ".join(f"{word} {limit:g}" for word, limit in tests if limit is not None)
        return f"A {self.of} is excluded when {self.measure.replace('_', ' ')} {test}: {self.reason}"
