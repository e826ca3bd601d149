"""Which trials count: practice set apart, a person's marks heeded, and the rules applied that were stated before."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cathxr.core.trials import TrialRecord
from cathxr.study.design import StudyDesign
from cathxr.study.exclusion_rules import MISSING, OUTCOME, VALID_TRIALS, Rule, RuleOf

MARKED = "marked"
"""In place of a rule's key: a person marked the trial as invalid."""


@dataclass(frozen=True)
class Excluded:
    """A trial that does not count, the key of the rule that took it out (or MARKED), and why in words."""

    trial: TrialRecord
    rule: str
    reason: str


@dataclass(frozen=True)
class ExcludedParticipant:
    """A participant none of whose trials count, the rule, and why in words."""

    participant: str
    rule: str
    reason: str


@dataclass(frozen=True)
class Judged:
    """Every trial that was given, in one of three places; and the participants who were excluded as a whole.

    kept: what counts. excluded: what does not, the trials of excluded participants among them. practice: never counts.
    """

    kept: tuple[TrialRecord, ...]
    excluded: tuple[Excluded, ...]
    practice: tuple[TrialRecord, ...]
    participants: tuple[ExcludedParticipant, ...] = ()


def judged(design: StudyDesign, trials: Iterable[TrialRecord]) -> Judged:
    """Return which trials count by the design's rules. Rules about trials come first, then those about participants."""
    everything = tuple(trials)
    practice = tuple(each for each in everything if each.practice)
    excluded: list[Excluded] = []
    kept: list[TrialRecord] = []
    of_trials = [each for each in design.exclusions if each.of is RuleOf.TRIAL]
    for trial in (each for each in everything if not each.practice):
        verdict = _of_trial(trial, of_trials)
        if verdict is None:
            kept.append(trial)
        else:
            excluded.append(verdict)
    of_participants = [each for each in design.exclusions if each.of is RuleOf.PARTICIPANT]
    out = _participants_out(design, kept, everything, of_participants)
    reasons = {each.participant: each for each in out}
    excluded += [Excluded(each, reasons[each.participant].rule, reasons[each.participant].reason)
                 for each in kept if each.participant in reasons]  # fmt: skip
    left = tuple(each for each in kept if each.participant not in reasons)
    return Judged(left, tuple(excluded), practice, out)


def is_valid(design: StudyDesign, trial: TrialRecord) -> bool:
    """Return whether a trial counts by itself; one that does not is to be repeated."""
    rules = [each for each in design.exclusions if each.of is RuleOf.TRIAL]
    return not trial.practice and _of_trial(trial, rules) is None


def _of_trial(trial: TrialRecord, rules: Sequence[Rule]) -> Excluded | None:
    if trial.invalid:
        return Excluded(trial, MARKED, trial.invalid)
    for rule in rules:
        if _holds(rule, _measure(trial, rule.measure)):
            return Excluded(trial, rule.key, rule.sentence)
    return None


def _measure(trial: TrialRecord, measure: str) -> float | str | None:
    if measure == OUTCOME:
        return trial.outcome.value
    if measure == "reached":
        return float(trial.reached)
    if measure in ("active_s", "unseen_share"):
        return float(getattr(trial, measure))
    return trial.measures.get(measure)


def _holds(rule: Rule, value: float | str | None) -> bool:
    if value is None:
        return False
    if isinstance(value, str):
        return value in rule.among
    over = rule.above is not None and value > rule.above
    return over or (rule.below is not None and value < rule.below)


def _participants_out(
    design: StudyDesign, kept: Sequence[TrialRecord], everything: Sequence[TrialRecord], rules: Sequence[Rule]
) -> tuple[ExcludedParticipant, ...]:
    if not rules:
        return ()
    counts: dict[tuple[str, str], int] = {}
    for each in kept:
        counts[each.participant, each.condition] = counts.get((each.participant, each.condition), 0) + 1
    practice = {
        each.participant: each.outcome.value
        for each in sorted(everything, key=lambda trial: (trial.began, trial.number))
        if each.practice and not each.invalid
    }
    out = []
    for code in sorted({each.participant for each in everything}):
        fewest = min(counts.get((code, each.key), 0) for each in design.conditions)
        for rule in rules:
            value = float(fewest) if rule.measure == VALID_TRIALS else practice.get(code, MISSING)
            if _holds(rule, value):
                out.append(ExcludedParticipant(code, rule.key, rule.sentence))
                break
    return tuple(out)
