"""The flow of participants and trials: how many there were at each step, and why the others are not analysed."""

from collections import Counter
from dataclasses import dataclass

from cathxr.core.trials import Outcome
from cathxr.study.analysis.data import StudyData, counted, why_not


@dataclass(frozen=True)
class Arm:
    """Those of one sequence. name: as a person reads it. analysed: have trials that count, `trials` of them in all."""

    sequence: str
    name: str
    allocated: int
    began: int
    analysed: int
    trials: int


@dataclass(frozen=True)
class Flow:
    """not_counted: trials by reason, practice among them, most frequent first. trials: all that began, practice too."""

    participants: int
    not_allocated: int
    arms: tuple[Arm, ...]
    practised: int
    trials: int
    analysed: int
    completed: int
    timed_out: int
    not_counted: tuple[tuple[str, int], ...]
    unknown: tuple[str, ...]
    reading: str


def flow(data: StudyData) -> Flow:
    """Return the counts. unknown: codes with trials that are no participants of the study."""
    known = {each.code: each for each in data.participants}
    unknown = tuple(sorted({each.participant for each in data.trials} - set(known)))
    people = [*data.participants]
    good = counted(data.trials)
    arms = []
    for sequence in sorted({each.sequence for each in people if each.sequence}):
        codes = {each.code for each in people if each.sequence == sequence}
        arms.append(
            Arm(
                sequence,
                data.order_of(sequence),
                len(codes),
                len({each.participant for each in data.trials} & codes),
                len({each.participant for each in good} & codes),
                sum(each.participant in codes for each in good),
            )
        )
    reasons = Counter(why for each in data.trials if (why := why_not(each)))
    analysed = len({each.participant for each in good})
    cut = sum(each.outcome is Outcome.TIMED_OUT for each in good)
    bad = sum(count for why, count in reasons.items() if why != "practice")
    told = (
        f"{len(people)} participants joined, {analysed} have trials that count. Of {len(data.trials)} trials "
        f"{reasons['practice']} were practice; {len(good)} are analysed ({len(good) - cut} completed, {cut} cut by the "
        f"time limit)" + (f", {bad} are not, for the reasons in the table." if bad else ".")
    )
    return Flow(
        len(people),
        sum(not each.sequence for each in people),
        tuple(arms),
        len({each.participant for each in data.trials if each.practice}),
        len(data.trials),
        len(good),
        len(good) - cut,
        cut,
        tuple(reasons.most_common()),
        unknown,
        told,
    )
