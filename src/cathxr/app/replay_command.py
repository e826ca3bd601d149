"""`cathxr replay`: a session on the page, or the proof that it replays bit for bit."""

from itertools import zip_longest
from pathlib import Path

import click
import numpy as np

from cathxr.app.config import Config
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.live_options import PATH
from cathxr.app.run_command import serve
from cathxr.core import DataError, Track


@click.command("replay")
@click.argument("session", type=PATH)
@click.option("--speed", type=click.FloatRange(0.01, 100.0), default=1.0, show_default=True, help="Pace.")
@click.option("--once", is_flag=True, help="End at the end instead of beginning again.")
@click.option("--port", type=click.IntRange(0, 65535), default=8765, show_default=True, help="Port on this machine.")
@click.option("--no-browser", is_flag=True, help="Do not open a browser.")
@click.option("--check", is_flag=True, help="Play nothing: track the Observations anew and compare bit for bit.")
@told_in_a_sentence
def replay(session: Path, speed: float, once: bool, port: int, no_browser: bool, check: bool) -> None:
    """Play a recorded session on the page, the tracker run anew on its Observations.

    \b
    Examples:
      cathxr replay recordings/first
      cathxr replay recordings/first --check
    """
    if check:
        click.echo(checked(session))
        return
    if not session.is_dir():
        raise DataError(f"There is no session folder {session}: give one that `cathxr record` or the page wrote.")
    defaults = Config()
    config = defaults.model_copy(
        update={
            "server": defaults.server.model_copy(update={"port": port, "browser": not no_browser}),
            "replay": defaults.replay.model_copy(update={"speed": speed, "loop": not once}),
        }
    )
    serve(str(session), config)


def checked(folder: Path) -> str:
    """Return how many Tracks came out the same to the last bit (latency aside).

    Raises:
        DataError: one differs, or the session cannot be read.
    """
    from cathxr.runtime.replay import replay_tracks
    from cathxr.storage.session import SessionReader
    from cathxr.tracking import make_tracker

    session = SessionReader(folder)
    config = session.config
    tracker = make_tracker(str(config.get("method", "model")), session.rig, points=int(config.get("points", 50)))
    count = 0
    for recorded, made in zip_longest(session.tracks(), replay_tracks(session, tracker)):
        if recorded is None or made is None:
            if not session.is_whole:  # the last Observation may have been written without its Track
                break
            raise DataError(f"{folder}: {count} Tracks agree, then one side has no more: the session is not complete.")
        if not same(recorded, made):
            raise DataError(
                f"{folder}: Track {recorded.seq} differs from the one made anew; it was recorded by another version?"
            )
        count += 1
    return f"{count} Tracks made anew from the Observations are the recorded ones bit for bit, latency aside."


def same(first: Track, second: Track) -> bool:
    """Return whether two Tracks are equal to the last bit, latency aside."""
    plain = ("seq", "t_ns", "status", "reason", "roll_rad", "sigma_mm")
    if any(getattr(first, name) != getattr(second, name) for name in plain):
        return False
    if first.shape_box is None or second.shape_box is None or first.box_from_tip is None or second.box_from_tip is None:
        return first.shape_box is second.shape_box and first.box_from_tip is second.box_from_tip
    return (
        np.array_equal(first.shape_box, second.shape_box)
        and np.array_equal(first.box_from_tip.rotation_wxyz, second.box_from_tip.rotation_wxyz)
        and np.array_equal(first.box_from_tip.translation_mm, second.box_from_tip.translation_mm)
    )
