"""`cathxr study simulate`: a whole study of simulated participants, numbers only, to try out what comes after."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from cathxr import __version__
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.app.study_folder import DESIGN_FILE, STORE_FILE, is_there, now, stores_module, surveys_of
from cathxr.core import ConfigError
from cathxr.core.trials import Answer
from cathxr.study.design import StudyDesign
from cathxr.study.design_file import design_from_text
from cathxr.study.design_template import design_template
from cathxr.study.surveys import Kind

if TYPE_CHECKING:
    from cathxr.study.simulate import SimulatedStudy

_RATIO = click.FloatRange(min=0.05, max=20.0)


@click.command("simulate")
@click.argument("folder", type=PATH)
@click.option("--participants", type=click.IntRange(min=2, max=999), default=8, show_default=True, help="How many.")
@click.option("--view", type=_RATIO, default=0.75, show_default=True, help="True time in 3D over that in 2D.")
@click.option("--practice", type=_RATIO, default=0.93, show_default=True, help="True time of a trial over the last.")
@click.option("--limit", type=click.FloatRange(min=1.0), help="The time limit of a trial, s.  [default: none]")
@click.option("--2d-first", "first", is_flag=True, help="Give everybody 2D first, which confounds view and practice.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of everything that is drawn.")
@told_in_a_sentence
def simulate(
    folder: Path, participants: int, view: float, practice: float, limit: float | None, first: bool, seed: int
) -> None:
    """Make a study in the new FOLDER: a design, simulated participants, their trials and answers, with effects known.

    The times are drawn, not tracked: it tries out the store, the board and the report, and shows what a study of this
    size can find. The report says that the data are simulated.

    \b
    Examples:
      cathxr study simulate try_out
      cathxr study simulate try_out --participants 24 --view 0.9 --limit 200
    """
    from cathxr.study.simulate import EVERYBODY_2D_FIRST, Effects, Plan, simulated

    if is_there(folder):
        raise ConfigError(f"{folder} is there already; name a new folder.")
    text = design_template(
        key="simulated", title="A simulated study", task="six_targets", practice="practice", planned=participants
    )
    design = design_from_text(text, name=DESIGN_FILE)
    sequences = EVERYBODY_2D_FIRST if first else design.sequences
    plan = Plan(
        participants, design.trials_per_condition, tuple(each.key for each in design.conditions), sequences,
        design.tasks[0], practice=3,
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    made = simulated(plan, Effects(view=math.log(view), practice=math.log(practice), limit_s=limit), rng)
    stores = stores_module()
    folder.mkdir(parents=True)
    (folder / DESIGN_FILE).write_text(text, encoding="utf-8", newline="\n")
    place = str(folder / STORE_FILE)
    with stores.create(place, study=design.key, seed=seed, software=__version__, at=now()) as store:
        store.adopt(text, at=now())
        for person in made.participants:
            store.enrol(person, at=now())
        store.record_all(made.trials, at=now())
        store.answer(_answers(design, made, rng), at=now())
    click.echo(f"Simulated {participants} participants and {len(made.trials)} trials into {folder}.")
    click.echo(f"Give `cathxr study report --study {folder}` next.")


def _answers(design: StudyDesign, made: "SimulatedStudy", rng: np.random.Generator) -> list[Answer]:
    """Return answers of everybody to every rating of the design's surveys, on each of its occasions."""
    from cathxr.study.simulate import simulated_answers

    surveys = surveys_of(Path())
    answers: list[Answer] = []
    for plan in design.surveys:
        ratings = [each for each in surveys[plan.survey].items if each.kind is Kind.RATING]
        items = [(plan.survey, each.key, each.minimum, each.maximum, each.step) for each in ratings]
        for occasion in design.occasions(plan, design.sequences[0]):
            answers += simulated_answers(made, items, rng, occasion=occasion)
    return answers
