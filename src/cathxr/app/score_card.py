"""A trainee's score card on the console: a trial against the own best, the own progress and the cohort."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cathxr.core import DataError
from cathxr.core.trials import TrialRecord

if TYPE_CHECKING:
    from cathxr.training import ScoreCard
    from cathxr.training.card import CardLine

_BARS = "▁▂▃▄▅▆▇█"
_LAST = 10
"""How many of the own trials the progress shows."""


def stored_trials(folder: Path, store: str | None) -> tuple[TrialRecord, ...]:
    """Return all trials of the study in a folder.

    Raises:
        CathxrError: the study or its store cannot be read.
    """
    from cathxr.app.study_folder import open_study

    with open_study(folder, store) as study:
        return study.store.trials()


def card_of(trial: str, records: tuple[TrialRecord, ...]) -> "ScoreCard":
    """Return the card of a stored trial.

    Raises:
        DataError: the store has no such trial.
    """
    from cathxr.training import score_card

    found = next((each for each in records if each.id == trial), None)
    if found is None:
        raise DataError(
            f"The study's store has no trial {trial or 'of this recording'} that has ended; give the recording of a "
            "trial of this study, or leave --study out."
        )
    return score_card(found, records)


def show_card(card: "ScoreCard") -> None:
    """Print a card: what was better than ever before first, then every measure."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    if not console.is_terminal:
        console = Console(width=110)
    for sentence in card_sentences(card):
        console.print(sentence, markup=False, highlight=False)
    table = Table(title="Score card", title_justify="left")
    table.add_column("metric")
    for name in ("this trial", "best before", "progress", "better than"):
        table.add_column(name, justify="right")
    for line in card.lines:
        table.add_row(*_row(line))
    console.print(table)


def card_sentences(card: "ScoreCard") -> list[str]:
    """Return what a card says, in words."""
    record, earlier = card.record, card.earlier
    told = f"{record.participant}: trial {earlier + 1} of this task in this view"
    if record.invalid:
        return [f"{told}. It does not count: {record.invalid}."]
    best = [line.metric.name for line in card.lines if line.is_best]
    if not earlier:
        told += ", the first one: there is nothing of your own to compare it with yet"
    elif best:
        told += f". Better than ever before: {', '.join(best)}"
    else:
        told += ". Nothing was better than ever before"
    others = max((line.others for line in card.lines), default=0)
    cohort = "Nobody else has done it" if not others else f"{others} other{'s have' if others > 1 else ' has'} done it"
    if not any(line.percentile is not None for line in card.lines):
        from cathxr.training.card import FEWEST_OTHERS

        cohort += f"; they are shown from {FEWEST_OTHERS} on"
    return [f"{told}.", f"{cohort}."]


def card_document(card: "ScoreCard") -> dict[str, Any]:
    """Return a card for JSON."""
    return {
        "participant": card.record.participant,
        "earlier": card.earlier,
        "lines": [
            {
                "metric": line.metric.key,
                "value": line.value,
                "best_before": line.best_before,
                "is_best": line.is_best,
                "percentile": line.percentile,
                "others": line.others,
                "history": [list(each) for each in line.history],
            }
            for line in card.lines
        ],
    }


def _row(line: "CardLine") -> tuple[str, ...]:
    unit = f" {line.metric.unit}" if line.metric.unit else ""
    value = "–" if line.value is None else f"{line.value:.2f}{unit}{' *' if line.is_best else ''}"
    best = "–" if line.best_before is None else f"{line.best_before:.2f}"
    better = "–" if line.percentile is None else f"{line.percentile:.0f} % of {line.others}"
    return line.metric.name, value, best, _progress(line), better


def _progress(line: "CardLine") -> str:
    """Return the last values as bars, the longest for the greatest; "–" for fewer than two."""
    values = [value for _, value in line.history][-_LAST:]
    if len(values) < 2:
        return "–"
    low, high = min(values), max(values)
    if high == low:
        return _BARS[3] * len(values)
    return "".join(_BARS[round((value - low) / (high - low) * (len(_BARS) - 1))] for value in values)
