"""`cathxr study simulate`: a whole study of simulated participants, as numbers only or by hands that steer the twin."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from cathxr import __version__
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.app.study_folder import DESIGN_FILE, STORE_FILE, is_there, now, open_study, stores_module, surveys_of
from cathxr.core import ConfigError
from cathxr.core.trials import Answer
from cathxr.study.design_file import design_from_text
from cathxr.study.design_template import design_template

if TYPE_CHECKING:
    from cathxr.storage.study_store import StudyStore
    from cathxr.study.design import StudyDesign
    from cathxr.study.simulate import SimulatedStudy

_RATIO = click.FloatRange(min=0.05, max=20.0)


@click.command("simulate")
@click.argument("folder", type=PATH)
@click.option("--twin", is_flag=True, help="Let simulated hands steer the twin, record it all, and write the report.")
@click.option("--participants", type=click.IntRange(min=2, max=999), default=8, show_default=True, help="How many.")
@click.option(
    "--trials", type=click.IntRange(min=1, max=20), default=3, show_default=True, help="How many in each view."
)
@click.option(
    "--view",
    type=_RATIO,
    default=0.75,
    show_default=True,
    help="True time in 3D over that in 2D; with --twin: looks and misses.",
)
@click.option(
    "--practice", type=_RATIO, default=0.93, show_default=True, help="The same of a trial over the one before."
)
@click.option(
    "--limit", type=click.FloatRange(min=1.0), help="The time limit of a trial, s, without --twin.  [default: none]"
)
@click.option(
    "--rendered",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="With --twin: so many of the first trials are tracked in rendered pictures.",
)
@click.option("--2d-first", "first", is_flag=True, help="Give everybody 2D first, which confounds view and practice.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of everything that is drawn.")
@told_in_a_sentence
def simulate(
    folder: Path,
    twin: bool,
    participants: int,
    trials: int,
    view: float,
    practice: float,
    limit: float | None,
    rendered: int,
    first: bool,
    seed: int,
) -> None:
    """Make a study in the new FOLDER: a design, simulated participants, their trials and answers.

    Without --twin the times are drawn, with effects that are known: for the store, the board and the report, and to see
    what a study of this size can find. With --twin hands that look, move and miss steer the digital twin's catheter,
    and every trial is done by the machine that a real one is done by, recorded, measured from its recording and
    reported; the times come out of that. No person takes part, and the report says so.

    \b
    Examples:
      cathxr study simulate try_out --participants 24 --view 0.9 --limit 200
      cathxr study simulate whole --twin
    """
    if is_there(folder):
        raise ConfigError(f"{folder} is there already; name a new folder.")
    if twin and limit is not None:
        raise ConfigError("--limit: with --twin the task's own time limit counts; leave it out.")
    if rendered and not twin:
        raise ConfigError("--rendered: goes with --twin.")
    stores = stores_module()
    text = design_template(
        key="simulated", title="A study simulated on the digital twin" if twin else "A simulated study",
        task="six_targets", practice="practice", planned=participants, per_condition=trials, one_order=first,
    )  # fmt: skip
    design = design_from_text(text, name=DESIGN_FILE)
    if twin:
        from cathxr.app.study_report import require_libraries

        require_libraries()
    folder.mkdir(parents=True)
    (folder / DESIGN_FILE).write_text(text, encoding="utf-8", newline="\n")
    place = str(folder / STORE_FILE)
    with stores.create(place, study=design.key, seed=seed, software=__version__, at=now()) as store:
        store.adopt(text, at=now())
        if not twin:
            made = _numbers(design, participants, view=view, practice=practice, limit_s=limit, seed=seed)
            _keep(store, design, made, np.random.default_rng([seed, 1]))
    if not twin:
        click.echo(f"Simulated {participants} participants and {len(made.trials)} trials into {folder}.")
        click.echo(f"Give `cathxr study report --study {folder}` next.")
        return
    from cathxr.app.study_report import write_report
    from cathxr.app.study_simulate_twin import Hands, simulated_on_twin

    with open_study(folder, None) as study:
        hands = Hands(view=view, practice=practice, rendered=rendered, seed=seed)
        count = simulated_on_twin(study, folder / "recordings", hands)
        click.echo(f"Simulated {participants} participants and {count} trials on the twin into {folder}.")
        for line in write_report(study, folder / "report", folder / "recordings"):
            click.echo(line)


def _numbers(
    design: "StudyDesign", participants: int, *, view: float, practice: float, limit_s: float | None, seed: int
) -> "SimulatedStudy":
    from cathxr.study.simulate import Effects, Plan, simulated

    plan = Plan(
        participants, design.trials_per_condition, tuple(each.key for each in design.conditions), design.sequences,
        design.tasks[0], practice=3,
    )  # fmt: skip
    effects = Effects(view=math.log(view), practice=math.log(practice), limit_s=limit_s)
    return simulated(plan, effects, np.random.default_rng(seed))


def _keep(store: "StudyStore", design: "StudyDesign", made: "SimulatedStudy", rng: np.random.Generator) -> None:
    """Store simulated people, their trials, and answers to every survey on each of its occasions."""
    from cathxr.study.simulate_answers import answers_of_people

    surveys, keys = surveys_of(Path()), [each.key for each in design.conditions]
    asked = [
        (surveys[plan.survey], occasion, keys.index(occasion.removeprefix("after:")) if ":" in occasion else 0)
        for plan in design.surveys
        for occasion in design.occasions(plan, design.sequences[0])
    ]
    for person in made.participants:
        store.enrol(person, at=now())
    store.record_all(made.trials, at=now())
    answers: tuple[Answer, ...] = answers_of_people(asked, [each.code for each in made.participants], rng, at=now())
    store.answer(answers, at=now())
