"""`cathxr study export`: everything as CSV, with a data dictionary."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.app.study_folder import StudyAtHand, open_study, study_options
from cathxr.study.exclusion import judged
from cathxr.study.surveys import scores_of

if TYPE_CHECKING:
    from cathxr.storage.study_store.export import ExportTable


@click.command("export")
@click.argument("out", type=PATH)
@study_options
@told_in_a_sentence
def export(out: Path, folder: Path, store: str | None) -> None:
    """Write the study into the new folder OUT: participants, trials, targets, answers, scores, draws, designs and the
    log, each a CSV file, and dictionary.csv, which explains every column.

    \b
    Examples:
      cathxr study export my_study_data
      cathxr study export data --study my_study
    """
    with open_study(folder, store) as study:
        from cathxr.storage.study_store.export import MeasureWords, export_tables, write_export
        from cathxr.training.metrics import METRICS

        opened = study.store
        trials = opened.trials()
        answers = opened.answers()
        verdict = judged(study.design, trials)
        counts = {each.trial.id: each.reason for each in verdict.excluded}
        counts |= {each.id: "practice" for each in verdict.practice}
        tables = export_tables(
            participants=opened.participants(),
            trials=trials,
            answers=answers,
            draws=opened.draws(),
            designs=opened.designs(),
            log=opened.log(),
            measures={each.key: MeasureWords(each.name, each.unit, each.formula) for each in METRICS},
            counts=counts,
        )
        files = write_export(out, (*tables, _scores(study)))
        click.echo(f"Wrote {len(files)} files into {out}; dictionary.csv explains every column.")


def _scores(study: StudyAtHand) -> "ExportTable":
    from cathxr.storage.study_store.export import Column, ExportTable

    answers = study.store.answers()
    rows = tuple(
        (each.participant, each.survey, each.score, each.occasion, each.value, " ".join(each.missing))
        for survey in study.surveys.values()
        for each in scores_of(survey, answers)
    )
    columns = (
        Column("participant", "text", "", "the participant's code"),
        Column("survey", "text", "", "key of the survey"),
        Column("score", "text", "", "key of the score"),
        Column("occasion", "text", "", "when it was asked: before, after:CONDITION, end"),
        Column("value", "number", "", "the score; empty where an answer is missing, as nothing is filled in"),
        Column("missing", "text", "", "the items without answer"),
    )
    return ExportTable("scores", columns, rows)
