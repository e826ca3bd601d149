"""`cathxr study next`: what a participant does next."""

import json
from dataclasses import asdict
from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.study_folder import StudyAtHand, checked_code, open_study, require_enrolled, study_options
from cathxr.study.board import Step, StepKind, next_step


@click.command("next")
@click.argument("code")
@study_options
@click.option("--json", "as_json", is_flag=True, help="As JSON, for programs.")
@told_in_a_sentence
def next_(code: str, folder: Path, store: str | None, as_json: bool) -> None:
    """Say what participant CODE does next by the design: a survey, practice, a trial, or nothing more.

    \b
    Examples:
      cathxr study next P01
      cathxr study next P01 --json
    """
    with open_study(folder, store) as study:
        chosen = checked_code(code)
        require_enrolled(study, chosen)
        participant = next(each for each in study.store.participants() if each.code == chosen)
        answers = study.store.answers()
        trials = study.store.trials(participant=chosen)
        step = next_step(study.design, study.surveys, participant, trials=trials, answers=answers)
        cut_off = [each for each in study.store.unfinished() if each.participant == chosen]
        if as_json:
            click.echo(json.dumps(asdict(step) | {"unfinished": [each.id for each in cut_off]}))
            return
        for each in cut_off:
            click.echo(
                f"Trial {each.id} began at {each.began} and has no end: go on with it, or give "
                f"`cathxr study mark {each.id} --interrupted`."
            )
        click.echo(f"{chosen}: {step_words(study, step)}.")


def step_words(study: StudyAtHand, step: Step) -> str:
    """Return a step in words."""
    if step.kind is StepKind.ALLOCATE:
        return "to be allocated"
    if step.kind is StepKind.DONE:
        return "done"
    if step.kind is StepKind.SURVEY:
        return f"survey {step.survey}, {step.occasion}"
    name = study.design.condition(step.condition).name
    if step.kind is StepKind.PRACTICE:
        return f"practice in {name}, task {step.task}"
    return f"trial {step.of} of {study.design.trials_a_condition} in {name}, task {step.task}"
