"""`cathxr study init`: begins a study, or adopts the design that its study.toml says now."""

import re
import secrets
from pathlib import Path

import click

from cathxr import __version__
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.app.study_folder import (
    DESIGN_FILE,
    STORE_VARIABLE,
    check_surveys,
    design_text,
    now,
    place_of,
    stores_module,
    surveys_of,
)
from cathxr.core import ConfigError, DataError
from cathxr.study.design import StudyDesign, sequence_text
from cathxr.study.design_file import design_from_text
from cathxr.study.design_template import design_template

_RECORD_FIELDS = {"active_s", "reached", "unseen_share", "outcome", "valid_trials", "practice"}
_OF_AN_EXPERT = ("frechet", "hausdorff", "dtw")
"""Metrics that compare with another recording."""


@click.command("init")
@click.argument("folder", type=PATH)
@click.option("--key", help="The study's key.  [default: from the folder's name]")
@click.option("--title", help="The study's title.  [default: the key]")
@click.option("--task", default="six_targets", show_default=True, help="The task of every trial.")
@click.option("--practice", default="practice", show_default=True, help="The task of the familiarisation.")
@click.option("--planned", type=click.IntRange(min=1), default=16, show_default=True, help="How many participants.")
@click.option("--reason", default="", help="Why the design changes after participants were allocated.")
@click.option("--store", envvar=STORE_VARIABLE, help="The store.  [default: study.sqlite in the folder]")
@told_in_a_sentence
def init(
    folder: Path, key: str | None, title: str | None, task: str, practice: str, planned: int, reason: str,
    store: str | None,
) -> None:  # fmt: skip
    """Begin a study in FOLDER; where it has a study.toml, adopt what that says.

    Change study.toml and give the command again, as often as you like, until the first participant is allocated. From
    then on the design, its exclusion rules above all, is fixed; a later change takes a --reason, which is kept.

    \b
    Examples:
      cathxr study init my_study --planned 24
      cathxr study init my_study
      cathxr study init my_study --reason "trial limit raised after a pilot"
    """
    made = _made(folder, key, title, task, practice, planned)
    text = design_text(folder)
    design = design_from_text(text, name=str(folder / DESIGN_FILE))
    check_surveys(design, surveys_of(folder))
    _check_tasks(design, folder)
    _check_metrics(design)
    seed = design.seed if design.seed is not None else secrets.randbits(63)
    stores = stores_module()
    with stores.create(place_of(folder, store), study=design.key, seed=seed, software=__version__, at=now()) as opened:
        if design.seed is not None and opened.seed() != design.seed:
            raise ConfigError(
                f"{folder / DESIGN_FILE}: allocation.seed: the store keeps another seed since the study was made; take "
                "the key out, or begin a study with another key."
            )
        before = opened.designs()
        adopted = opened.adopt(text, at=now(), reason=reason)
    if made:
        click.echo(f"Wrote {folder / DESIGN_FILE}: change it to your study, then give this command again.")
    new = not before or before[-1].version != adopted.version
    click.echo(f"Design version {adopted.version} of study {design.key} {'adopted' if new else 'is adopted already'}.")
    for line in described(design):
        click.echo(line)


def described(design: StudyDesign) -> list[str]:
    """Return a design in a few lines."""
    sequences = ", ".join(sequence_text(each) for each in design.sequences)
    lines = [
        f"{len(design.conditions)} conditions; sequences: {sequences}.",
        f"{design.planned} participants, each {design.trials_a_condition} trials a condition.",
        f"Primary outcome: {design.primary}.",
        *(f"Rule {each.key}: {each.sentence}." for each in design.exclusions),
    ]
    if not design.balanced:
        lines.append(
            "Note: not every condition stands equally often in every place, so that practice and condition mix."
        )
    if design.planned % len(design.sequences):
        lines.append(
            f"Note: {design.planned} participants cannot be equally many in {len(design.sequences)} sequences."
        )
    if not design.exclusions:
        lines.append("Note: there are no exclusion rules; none can be added later without saying why.")
    return lines


def _made(folder: Path, key: str | None, title: str | None, task: str, practice: str, planned: int) -> bool:
    """Write a first study.toml where there is none, and return whether."""
    file = folder / DESIGN_FILE
    if file.exists():
        if key or title:
            raise ConfigError(f"{file} is there already; change the key or title in it.")
        return False
    chosen = key or re.sub(r"[^a-z0-9]+", "-", folder.resolve().name.lower()).strip("-")[:40] or "study"
    text = design_template(key=chosen, title=title or chosen, task=task, practice=practice, planned=planned)
    design = design_from_text(text, name="--key, --title, --task, --practice")
    _check_tasks(design, folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with file.open("x", encoding="utf-8", newline="\n") as opened:
            opened.write(text)
    except OSError as error:
        raise DataError(f"{file}: cannot write it ({error.strerror}); choose another folder.") from error
    return True


def _check_tasks(design: StudyDesign, folder: Path) -> None:
    """Return when there is every task, KEY.toml in the folder's tasks/ or a built-in one, and fit for what it is for.

    Raises:
        CathxrError: there is not, or its file is wrong.
    """
    from cathxr.training import builtin_tasks, read_task

    own = {each.stem: each for each in (folder / "tasks").glob("*.toml")}
    known = {each.key: each for each in builtin_tasks()}
    practice = () if design.practice is None else (design.practice.task,)
    for key in (*design.tasks, *practice):
        task = read_task(own[key]) if key in own else known.get(key)
        if task is None:
            names = ", ".join(sorted({*own, *known}))
            raise ConfigError(
                f"{DESIGN_FILE}: no task {key}; there are {names}, and own ones go into the folder tasks."
            )
        if task.key != key:
            raise ConfigError(f"{own[key]}: key: expected {key}, as the file is called, got {task.key}; make them one.")
        if key in design.tasks and task.practice is not None:
            raise ConfigError(
                f"{DESIGN_FILE}: trials.tasks: {key} is practice and nothing else; name it in [practice], and another "
                "task here."
            )


def _check_metrics(design: StudyDesign) -> None:
    """Return when every outcome and rule names a metric that there is."""
    from cathxr.training.metrics import METRICS

    known = [each.key for each in METRICS]
    for key in (design.primary, *design.secondary):
        if key in _OF_AN_EXPERT:
            raise ConfigError(
                f"{DESIGN_FILE}: outcomes: {key} needs an expert's run, which a study's trials are not compared with; "
                "`cathxr score SESSION --expert RUN` measures it of single recordings."
            )
    named = (design.primary, *design.secondary, *(each.measure for each in design.exclusions))
    for key in named:
        if key not in known and key not in _RECORD_FIELDS:
            raise ConfigError(f"{DESIGN_FILE}: no metric {key}; there are {', '.join(known)}.")
