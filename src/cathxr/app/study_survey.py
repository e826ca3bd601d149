"""`cathxr study survey`: asks a survey on the console."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.study_folder import (
    StudyAtHand,
    checked_code,
    now,
    open_study,
    require_enrolled,
    study_options,
    surveys_of,
)  # fmt: skip
from cathxr.core import ConfigError
from cathxr.core.trials import Answer
from cathxr.study.surveys import Item, Kind


@click.command("survey")
@click.argument("code", required=False)
@click.argument("survey", required=False)
@study_options
@click.option(
    "--occasion", help="When it is asked: before, after:CONDITION, end.  [default: the design's, where only one]"
)
@click.option("--replace", is_flag=True, help="Ask again, and put the new answers in place of the old ones.")
@click.option("--list", "only_list", is_flag=True, help="Show which surveys there are.")
@told_in_a_sentence
def survey(
    code: str | None, survey: str | None, folder: Path, store: str | None, occasion: str | None, replace: bool,
    only_list: bool,
) -> None:  # fmt: skip
    """Ask participant CODE the survey SURVEY. The answers are kept when the last one is given; Ctrl-C keeps none.

    \b
    Examples:
      cathxr study survey P01 tlx --occasion after:2d
      cathxr study survey --list
    """
    if only_list:
        for each in surveys_of(folder).values():
            click.echo(f"{each.key}: {each.name}, {len(each.items)} items. {each.source}")
        return
    if code is None or survey is None:
        raise ConfigError("Give a participant's code and a survey, or --list.")
    with open_study(folder, store) as study:
        participant = checked_code(code)
        require_enrolled(study, participant)
        chosen = study.survey(survey)
        when = occasion_of(study, survey, participant, occasion)
        click.echo(f"{chosen.name}. {chosen.instruction}")
        answers = []
        for place, item in enumerate(chosen.items, 1):
            value, text = _asked(item, f"{place}/{len(chosen.items)}")
            if value is not None or text:
                answers.append(Answer(participant, survey, item.key, when, now(), value, text))
        study.store.answer(answers, at=now(), replace=replace)
        click.echo(f"Kept {len(answers)} answers of {participant} to {survey}, {when}.")


def occasion_of(study: StudyAtHand, survey: str, participant: str, given: str | None) -> str:
    """Return the occasion of a survey: the one given, or the only one that the design has for it.

    Raises:
        ConfigError: the design does not ask the survey then, or on several occasions and none is given.
    """
    who = next((each for each in study.store.participants() if each.code == participant), None)
    sequence = who.conditions if who is not None and who.conditions else tuple(c.key for c in study.design.conditions)
    asked = [
        occasion
        for plan in study.design.surveys
        if plan.survey == survey
        for occasion in study.design.occasions(plan, sequence)
    ]
    if given is None and len(asked) == 1:
        return asked[0]
    if given not in asked:
        told = f"one of {', '.join(asked)}" if asked else "nothing: the design does not ask this survey"
        raise ConfigError(f"--occasion: expected {told}, got {given or 'none'}.")
    return given


def _asked(item: Item, place: str) -> tuple[float | None, str]:
    """Return the answer to one item, as often asked as it takes."""
    if item.kind is Kind.WORDS:
        return None, click.prompt(
            f"{place} {item.text} (words, Enter for none)", default="", show_default=False
        ).strip()
    ends = "; ".join(f"{value:g} {word}" for value, word in _ends(item))
    while True:
        raw = click.prompt(f"{place} {item.text} ({ends})", default="" if item.optional else None, show_default=False)
        if item.optional and not str(raw).strip():
            return None, ""
        try:
            value = float(str(raw).strip().replace(",", "."))
            fault = item.fault(value, "")
        except ValueError:
            value, fault = 0.0, item.fault(None, str(raw))
        if fault is None:
            return value, ""
        click.echo(f"  {fault}.")


def _ends(item: Item) -> list[tuple[float, str]]:
    if item.labels:
        return [(item.minimum + place * item.step, label) for place, label in enumerate(item.labels)]
    return [(item.minimum, item.low), (item.maximum, item.high)]
