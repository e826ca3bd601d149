"""`cathxr register --touch`: landmarks touched with the tracked tip, guided by a page."""

from collections.abc import Mapping
from pathlib import Path

import click
import numpy as np

from cathxr.app.calibration_server import serve_running
from cathxr.app.config import Config, read_config
from cathxr.app.live_parts import CAMERAS, TWIN, live_parts
from cathxr.app.register_heart import chosen_heart, chosen_out, heart_shape
from cathxr.app.register_inputs import heart_point
from cathxr.app.register_report import figures, write_picture, write_registration_file
from cathxr.app.register_run import TouchChoice
from cathxr.app.register_twin import SimulatedHand, comparison, touching
from cathxr.app.run_command import prepare
from cathxr.core import ConfigError, FloatArray, Rig
from cathxr.devices.clock import MonotonicClock
from cathxr.heart import HeartFolder
from cathxr.registration import Kind, Registration, caval_placement
from cathxr.runtime.calibration_task import Ending
from cathxr.runtime.registration_live import LiveTouching
from cathxr.runtime.registration_touch import TouchSession, Wanted
from cathxr.wire.hub import Hub

_NEAR_MM = 15.0
_APART_MM = 6.0


def touch_landmarks(heart_path: Path | None, choice: TouchChoice) -> None:
    """Register a heart by touching its landmarks; returns when a person has accepted the result.

    Raises:
        CathxrError: it could not start, or was cancelled: nothing was written.
    """
    heart = chosen_heart(heart_path)
    target = None if choice.dry_run else chosen_out(heart, choice.out)
    clock = MonotonicClock()
    config = _config(choice)
    parts = live_parts(choice.source, config, clock=clock)
    shape = heart_shape(heart)
    points = _points(heart, choice.wanted)
    hand, truth = None, None
    if parts.world is not None:
        click.echo(f"This is a simulation, without hardware: a simulated hand moves the tip (seed {choice.seed}).")
        simulated = touching(parts.world, heart, points, seed=choice.seed)
        hand, truth = SimulatedHand(parts.world, simulated.controls, clock=clock), simulated.truth
        points = {key: points[key] for key in simulated.controls}
    elif not choice.wanted:
        points = _likely(heart, points, parts.rig)
    prepare(config.tracking, parts.rig)
    sessions: list[TouchSession] = []

    def save(registration: Registration) -> Ending:
        if target is None:
            return Ending("Nothing was written (--dry-run).", True)
        return Ending(write_registration_file(target, registration), True, (str(target),))

    def running(outlet: Hub) -> LiveTouching:
        session = TouchSession(
            [Wanted(key, _name(heart, key), point) for key, point in points.items()],
            shape,
            kind=Kind(choice.kind),
            method="landmarks touched with the tracked tip",
            date=choice.date,
            keep=outlet.publish_result,
            save=save,
            on_landmark=None if hand is None else hand.go,
        )
        sessions.append(session)
        return LiveTouching(session, parts.source, outlet=outlet, clock=clock)

    ending = serve_running(
        running, rig=parts.rig, kind=choice.source, title="Registering by touched landmarks.", clock=clock,
        page=choice.page,
    )  # fmt: skip
    click.echo(ending.sentence)
    solution = sessions[-1].solution
    assert solution is not None
    for line in figures(solution, shape):
        click.echo(line)
    if target is not None:
        click.echo(write_picture(choice.report or target.with_name(f"{target.stem}_report"), solution, shape))
    if truth is not None:
        click.echo(comparison(solution.registration, truth, shape.vertices_ct))


def _config(choice: TouchChoice) -> Config:
    """Return the configuration of the tracker; the heart is not its business here.

    Raises:
        ConfigError: real cameras without a rig or a configuration, or a wrong file.
    """
    if choice.source == CAMERAS and choice.rig is None:
        raise ConfigError("Touching needs the rig of the cameras: give --rig rig.toml (or try --source twin).")
    read = Config() if choice.config is None else read_config(choice.config)
    changes: dict[str, object] = {"heart": None}
    if choice.rig is not None:
        changes["rig"] = str(choice.rig)
    if choice.source == TWIN:
        changes["twin"] = read.twin.model_copy(update={"seed": choice.seed})
    return read.model_copy(update=changes)


def _points(heart: HeartFolder, wanted: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return the heart's points that were asked for, or all that lie apart from each other.

    Raises:
        ConfigError: the heart has none of a name, or too few at all.
    """
    if wanted:
        return {name: heart_point(heart, name) for name in wanted}
    chosen: dict[str, FloatArray] = {}
    for key, point in heart.points_ct.items():
        if all(np.linalg.norm(point - each) > _APART_MM for each in chosen.values()):
            chosen[key] = point
    if len(chosen) < Kind.RIGID.fewest_pairs:
        raise ConfigError(
            f"The heart {heart.path} names {len(chosen)} landmarks and openings, three are needed: add landmarks to "
            "its heart.toml."
        )
    return chosen


def _likely(heart: HeartFolder, points: Mapping[str, FloatArray], rig: Rig) -> dict[str, FloatArray]:
    """Return those of the points that the default placement has in reach, where it leaves enough of them."""
    placed = caval_placement(heart.points_ct, method="")
    if placed is None:
        return dict(points)
    low, high = rig.roi.min_mm - _NEAR_MM, rig.roi.max_mm + _NEAR_MM
    inside = {
        key: each for key, each in points.items() if ((placed.box(each) >= low) & (placed.box(each) <= high)).all()
    }
    return inside if len(inside) > Kind.RIGID.fewest_pairs else dict(points)


def _name(heart: HeartFolder, key: str) -> str:
    named = heart.openings.get(key) or heart.landmarks.get(key)
    return key if named is None else named.name
