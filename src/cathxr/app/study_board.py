"""`cathxr study board`: how far everybody is."""

from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.study_folder import WIDTH, StudyAtHand, open_study, study_options
from cathxr.app.study_next import step_words
from cathxr.study.board import Board, board


@click.command("board")
@study_options
@told_in_a_sentence
def board_(folder: Path, store: str | None) -> None:
    """Show how far every participant is, how the sequences are filled, and which trials were cut off.

    Outcomes are not shown: who runs a study had better not see them before its end.

    \b
    Examples:
      cathxr study board
      cathxr study board --study my_study
    """
    with open_study(folder, store) as study:
        opened = study.store
        found = board(
            study.design, study.surveys, opened.participants(), trials=opened.trials(), answers=opened.answers()
        )
        console = Console()
        if not console.is_terminal:
            console = Console(width=WIDTH)
        console.print(_table(study, found))
        for line in _lines(study, found):
            console.print(line, markup=False, highlight=False)


def _table(study: StudyAtHand, found: Board) -> Table:
    table = Table(title=study.design.title, title_justify="left", title_style="bold")
    for name in ("code", "group", "sequence", "practice", "trials", "surveys", "next"):
        table.add_column(name)
    for row in found.rows:
        trials = ", ".join(
            f"{each.condition} {each.valid}/{each.wanted}" + (f" (+{each.invalid} invalid)" if each.invalid else "")
            for each in row.conditions
        )
        table.add_row(
            row.participant.code, row.participant.group, row.participant.sequence, row.practice.replace("_", " "),
            trials, f"{row.surveys_done}/{row.surveys_asked}", step_words(study, row.next),
        )  # fmt: skip
    return table


def _lines(study: StudyAtHand, found: Board) -> list[str]:
    lines = [
        f"{found.done} of {found.planned} planned participants are done; {len(found.rows)} are enrolled.",
        "By sequence: " + ", ".join(f"{sequence} {count}" for sequence, count in found.by_sequence) + ".",
    ]
    lines += [
        f"Trial {each.id} of {each.participant} ({each.condition}, {each.number}) began at {each.began} and has no "
        "end: running, or cut off."
        for each in study.store.unfinished()
    ]
    return lines
