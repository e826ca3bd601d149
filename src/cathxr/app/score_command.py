"""`cathxr score`: the measures of the trials in a recording."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cathxr import __version__
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.app.study_folder import STORE_VARIABLE
from cathxr.core import ConfigError, DataError

if TYPE_CHECKING:
    from cathxr.core import Track
    from cathxr.training import Replayed, TrialResult
    from cathxr.training.metrics import Measure, Run

SCHEMA = "cathxr-score/1"


@click.command("score")
@click.argument("session", type=PATH)
@click.option("--task", help="Do this task (a built-in key or a file) on the recording, from its first Track on.")
@click.option("--heart", type=PATH, help="The heart folder.  [default: the built-in heart]")
@click.option("--expert", type=PATH, help="A recording of an expert's run, to compare the path with.")
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of a random order, with --task."
)
@click.option("--row", type=click.IntRange(min=0), default=0, show_default=True, help="Of a Latin square, with --task.")
@click.option("--wall/--no-wall", default=True, show_default=True, help="Measure virtual wall breaches.")
@click.option("--study", type=PATH, help="The folder of the study that the trials are of: also print score cards.")
@click.option("--store", envvar=STORE_VARIABLE, help="The study's store.  [default: study.sqlite in its folder]")
@click.option("--out", type=PATH, help="Also write everything as JSON.")
@told_in_a_sentence
def score(
    session: Path,
    task: str | None,
    heart: Path | None,
    expert: Path | None,
    seed: int,
    row: int,
    wall: bool,
    study: Path | None,
    store: str | None,
    out: Path | None,
) -> None:
    """Measure the trials in the recording SESSION, done again from its Tracks and the person's acts.

    With --study a score card follows: this trial against the own best before, the own progress, and the others.

    A metric that cannot be had is not 0: the table says why. docs/metrics.md explains each.

    \b
    Examples:
      cathxr score recordings/first
      cathxr score recordings/first --task six_targets --out score.json
      cathxr score my_study/recordings/P01-1-2d-3 --study my_study
    """
    from cathxr.app.register_heart import chosen_heart
    from cathxr.app.score_card import card_document, card_of, show_card, stored_trials
    from cathxr.app.score_inputs import expert_path, placed_in, recorded_registration, wall_depth
    from cathxr.storage.atomic import check_writable
    from cathxr.storage.session import SessionReader
    from cathxr.training import find_task, order_of, replay_trials, run_task
    from cathxr.training.metrics import Run, measured, motion_of

    if out is not None:
        check_writable(out, what="the scores")
    if study is not None and task is not None:
        raise ConfigError("--task does a task that the study knows nothing of: leave it or --study out.")
    reader, folder = SessionReader(session), chosen_heart(heart)
    registration = recorded_registration(reader, folder)
    tracks = tuple(reader.tracks())
    if not tracks:
        raise DataError(f"{session}: no Tracks were recorded, so that there is nothing to score.")
    if task is None:
        done = [_whole(session, each, tracks) for each in replay_trials(tracks, reader.events())]
    else:
        chosen = find_task(task)
        placed = placed_in(chosen, heart, reader.rig.roi, registration)
        replayed = run_task(placed, order_of(chosen, seed=seed, row=row), tracks)
        done = [(replayed, replayed.trial.result(), tracks)]
    if not done:
        raise DataError(f"{session}: no trial was recorded here; name a task with --task to do it on this recording.")
    records = None if study is None else stored_trials(study, store)
    cards = [None if records is None else card_of(each.trial.id, records) for each, _, _ in done]
    depth = wall_depth(folder, registration) if wall else None
    path = None if expert is None else expert_path(expert)
    documents = []
    for (each, result, its_tracks), card in zip(done, cards, strict=True):
        run = Run(result, each.trial.placed, motion_of(its_tracks, result.stretches), depth, path)
        measures = measured(run)
        _show(run, measures)
        document = _document(each, run, measures)
        if card is not None:
            show_card(card)
            document["card"] = card_document(card)
        documents.append(document)
    if not reader.is_whole:
        click.echo("The recording was cut off; this is what was saved.")
    if out is not None:
        _write(out, {"schema": SCHEMA, "session": session.name, "software": __version__, "trials": documents})
        click.echo(f"Written: {out}")


def _whole(
    session: Path, replayed: "Replayed", tracks: "tuple[Track, ...]"
) -> "tuple[Replayed, TrialResult, tuple[Track, ...]]":
    """Return a trial with its result and Tracks, joined with those of the recordings that go on from this one."""
    from cathxr.runtime.training_recordings import part_folders, recorded_trial

    if len(part_folders(session)) < 2:
        return replayed, replayed.trial.result(), tracks
    joined = recorded_trial(session, replayed.trial.id)
    return joined.replayed, joined.result, joined.tracks


def _show(run: "Run", measures: "Mapping[str, Measure]") -> None:
    """Print one trial."""
    from rich.console import Console
    from rich.table import Table

    from cathxr.training import familiarisation
    from cathxr.training.metrics import METRICS

    result = run.result
    console = Console()
    if not console.is_terminal:
        console = Console(width=110)
    unseen = f"; not seen in {100.0 * result.unseen_share:.1f} % of it" if result.unseen_share > 0 else ""
    how = f"{run.placed.name}: {result.outcome.value}, {result.reached} reached, {result.active_s:.2f} s{unseen}"
    console.print(how, markup=False, highlight=False)
    if run.placed.in_a_row is not None:
        console.print(familiarisation(result, run.placed.in_a_row).sentence, markup=False, highlight=False)
    targets = Table()
    for name in ("target", "offered, s", "reached, s", "path, mm", "misses"):
        targets.add_column(name, justify="left" if name == "target" else "right")
    for each in result.targets:
        reached = "no" if each.reached_s is None else f"{each.reached_s:.2f}"
        targets.add_row(each.key, f"{each.offered_s:.2f}", reached, f"{each.path_mm:.1f}", str(each.misses))
    console.print(targets)
    table = Table()
    table.add_column("metric")
    table.add_column("value", justify="right")
    table.add_column("unit, or why there is none")
    for metric in METRICS:
        measure = measures[metric.key]
        value = "" if measure.value is None else f"{measure.value:.2f}"
        table.add_row(metric.name, value, metric.unit if measure.value is not None else measure.reason)
    console.print(table, markup=False)


def _document(done: "Replayed", run: "Run", measures: "Mapping[str, Measure]") -> dict[str, Any]:
    """Return a trial for JSON."""
    result = run.result
    return {
        "trial": result.id,
        "task": run.placed.key,
        "task_sha256": run.placed.sha256,
        "order": list(done.trial.order),
        "outcome": result.outcome.value,
        "active_s": result.active_s,
        "unseen_share": result.unseen_share,
        "targets": [dict(vars(each)) for each in result.targets],
        "measures": {key: each.value for key, each in measures.items() if each.value is not None},
        "absent": {key: each.reason for key, each in measures.items() if each.value is None},
    }


def _write(out: Path, document: Mapping[str, Any]) -> None:
    from cathxr.storage.atomic import written_whole

    with written_whole(out) as part:
        part.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8", newline="\n")
