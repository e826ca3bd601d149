"""`cathxr track`: recorded videos or picture folders in, a track CSV out, an overlay video where asked for."""

import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.interruption import heeded_ctrl_c
from cathxr.app.offline import TrackedPair, track_pairs
from cathxr.app.offline_inputs import TrackInputs, TrackOptions, open_inputs
from cathxr.app.offline_pairs import read_pairs
from cathxr.core import Status, Track
from cathxr.storage.overlay import OverlayWriter
from cathxr.storage.track_columns import FEWEST_POINTS, MOST_POINTS
from cathxr.storage.track_csv import TrackCsvWriter

_PATH = click.Path(path_type=Path)


@dataclass
class Summary:
    """What is counted while tracking."""

    statuses: Counter[str] = field(default_factory=Counter)
    reasons: Counter[tuple[str, str]] = field(default_factory=Counter)
    seconds: float = 0.0

    def count(self, track: Track) -> None:
        """Count one Track."""
        self.statuses[track.status.value] += 1
        if track.status is not Status.TRACKED:
            self.reasons[(track.status.value, track.reason)] += 1

    def lines(self) -> list[str]:
        """Return the summary for the console."""
        pairs = sum(self.statuses.values())
        rate = f", {pairs / self.seconds:.1f} pairs/s" if self.seconds > 0 else ""
        parts = ", ".join(f"{self.statuses[each.value]} {each.value}" for each in Status)
        result = [f"{pairs} pairs: {parts}{rate}"]
        for (status, reason), count in sorted(self.reasons.items(), key=lambda each: -each[1]):
            result.append(f"  {status}, {reason}: {count}")
        return result


@click.command("track")
@click.option("--rig", required=True, type=_PATH, help="The rig the pictures were taken with (rig.toml).")
@click.option("--top", required=True, type=_PATH, help="Top camera: a video, or a folder of pictures in name order.")
@click.option("--front", required=True, type=_PATH, help="Front camera, likewise.")
@click.option("--out", required=True, type=_PATH, help="The track table to write (CSV).")
@click.option("--times", type=_PATH, help="When the pictures were taken: CSV seq,t_top_s,t_front_s.")
@click.option("--roll", type=_PATH, help="Encoder counts on the same clock: CSV t_s,count.")
@click.option(
    "--method", type=click.Choice(["model", "paper"]), default="model", show_default=True, help="How to track."
)
@click.option(
    "--points", type=click.IntRange(FEWEST_POINTS, MOST_POINTS), default=50, show_default=True,
    help="Points of the centreline in the table.",
)  # fmt: skip
@click.option("--background-top", type=_PATH, help="A picture of the empty box from the top camera.")
@click.option("--background-front", type=_PATH, help="The same from the front camera.")
@click.option("--overlay", type=_PATH, help="Also write a video (MP4) with the curve drawn on both views.")
@told_in_a_sentence
def track(
    rig: Path,
    top: Path,
    front: Path,
    out: Path,
    times: Path | None,
    roll: Path | None,
    method: str,
    points: int,
    background_top: Path | None,
    background_front: Path | None,
    overlay: Path | None,
) -> None:
    """Track a catheter in recorded pictures of both cameras.

    One row for each picture pair goes to the table: status, tip, direction, roll, and the centreline in mm. A pair in
    which the catheter cannot be found is a row of status "lost"; that is no failure. Needs the rig that belongs to
    the pictures; docs/formats.md explains every file.

    \b
    Example:
      cathxr track --rig rig.toml --top top.mp4 --front front.mp4 --out track.csv --overlay overlay.mp4
    """
    options = TrackOptions(
        rig, top, front, out, times, roll, method, points, background_top, background_front, overlay
    )  # fmt: skip
    inputs = open_inputs(options)
    summary = run(options, inputs)
    for note in (*inputs.notes, *dict.fromkeys((*inputs.top.notes, *inputs.front.notes))):
        click.echo(f"Note: {note}.", err=True)
    for line in summary.lines():
        click.echo(line)
    click.echo(f"Table: {out}")
    if overlay is not None:
        click.echo(f"Overlay: {overlay}")


def run(options: TrackOptions, inputs: TrackInputs) -> Summary:
    """Track everything, write the outputs, and return what was counted. On any error nothing is left behind.

    Raises:
        ConfigError, DataError: one sentence about what is wrong.
    """
    # Imported here: compiling and loading the methods takes seconds that --help and a wrong path need not wait for.
    from cathxr.tracking import make_tracker
    from cathxr.vision import make_detector

    detectors = {
        name: make_detector(options.method, inputs.rig, name, background=inputs.backgrounds.get(name))
        for name in ("top", "front")
    }
    tracker = make_tracker(options.method, inputs.rig, points=options.points)
    summary = Summary()
    rate_hz = inputs.rig.cameras["top"].rate_hz
    with heeded_ctrl_c() as check, ExitStack() as outputs:
        table = TrackCsvWriter(options.out, points=options.points)
        outputs.callback(table.discard)  # before it is opened: Ctrl-C may come while it is
        outputs.enter_context(table)
        overlay = None
        if options.overlay is not None:
            overlay = OverlayWriter(options.overlay, inputs.rig)
            outputs.callback(overlay.discard)
            outputs.enter_context(overlay)
        pairs = read_pairs(inputs.top, inputs.front, rate_hz=rate_hz, times=inputs.times)
        outputs.callback(getattr(pairs, "close", lambda: None))
        tracked = track_pairs(inputs.rig, pairs, detectors, tracker, counts=inputs.counts)
        begun_s = time.perf_counter()
        with _progress(inputs) as shown:
            for each in shown(tracked):
                check()
                table.write(each.track)
                if overlay is not None:
                    overlay.write(each.top.pixels, each.front.pixels, each.track)
                summary.count(each.track)
        summary.seconds = time.perf_counter() - begun_s
    return summary


class _Shown:
    """Passes pairs on and moves a progress bar."""

    def __init__(self, bar: Progress, total: int | None) -> None:
        self._bar = bar
        self._task = bar.add_task("tracking", total=total)

    def __call__(self, pairs: Iterator[TrackedPair]) -> Iterator[TrackedPair]:
        for each in pairs:
            yield each
            self._bar.advance(self._task)


@contextmanager
def _progress(inputs: TrackInputs) -> Iterator[_Shown]:
    """Give a progress bar on stderr, silent where that is no terminal. The number of pairs may be a guess."""
    guesses = [each.about for each in (inputs.top, inputs.front) if each.about is not None]
    total = inputs.pair_count or (min(guesses) if guesses else None)
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        TimeRemainingColumn(compact=True),
    )  # fmt: skip
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        yield _Shown(bar, total)
