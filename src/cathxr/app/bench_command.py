"""`cathxr bench`: measures this machine and prints (or writes) one page of tables."""

import os
import platform
import time
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from cathxr import __version__
from cathxr.app.bench_live import measure
from cathxr.app.bench_tables import table, tracking_part
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.live_options import PATH

_CLIENTS = (1, 10, 50)


@click.command("bench")
@click.argument("what", type=click.Choice(["all", "tracking", "accuracy", "twin", "heart", "live"]), default="all")
@click.option("--pairs", type=click.IntRange(6, 5000), default=60, show_default=True, help="Pairs of each scene.")
@click.option(
    "--sequences",
    type=click.IntRange(1, 100),
    default=3,
    show_default=True,
    help="Sequences that they are shared among, each with another seed and another draw of the calibration.",
)
@click.option(
    "--seconds", type=click.FloatRange(2.0, 600.0), default=15.0, show_default=True, help="Length of each live run."
)
@click.option("--scene", "chosen", multiple=True, help="Scenes to track, instead of the usual ones; repeatable.")
@click.option(
    "--calibration",
    type=click.Choice(["exact", "fiducials"]),
    default="fiducials",
    show_default=True,
    help="Camera poses: as they are, or from four fiducials seen with 0.1 px of noise.",
)
@click.option(
    "--rate", "rate_hz", type=click.FloatRange(1.0, 240.0), default=30.0, show_default=True, help="Pairs a second."
)
@click.option("--out", type=PATH, help="Also write the page to this file (Markdown).")
@told_in_a_sentence
def bench(
    what: str,
    pairs: int,
    sequences: int,
    seconds: float,
    chosen: tuple[str, ...],
    calibration: str,
    rate_hz: float,
    out: Path | None,
) -> None:
    """Measure accuracy, speed, latency and load on this machine, on the digital twin's rendered pictures.

    `all` leaves out `accuracy`, which says where the tip's error comes from: it writes its tables between the two
    markers of the page given with --out, and its pictures into the folder images beside it.

    \b
    Example:
      cathxr bench --out docs/benchmarks.md
      cathxr bench tracking --scene smooth --scene curl --calibration exact
      cathxr bench accuracy --pairs 100 --sequences 5 --out docs/accuracy.md
    """
    import cv2

    cv2.setNumThreads(1)
    console = Console(stderr=True)

    part = None if out is None else out.with_name(out.name + ".part")

    def kept(*texts: str) -> None:
        """Keep what there is so far beside the page: long runs are interrupted."""
        if part is not None:
            part.write_text("\n\n".join(texts) + "\n", encoding="utf-8", newline="\n")

    parts = [_heading(what, pairs, sequences, seconds, calibration)]
    with Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), console=console,
        disable=not console.is_terminal, transient=True,
    ) as bar:  # fmt: skip
        if what == "accuracy":
            _accuracy(out, pairs, sequences, rate_hz, bar)
            return
        if what in ("all", "tracking"):
            from cathxr.app.bench_scenes import CATEGORIES

            scenes = chosen or tuple(CATEGORIES)
            task = bar.add_task("tracking", total=len(scenes) * pairs)

            def named(scene: str) -> None:
                bar.update(task, description=f"tracking {scene}")
                if not console.is_terminal:
                    console.print(f"tracking {scene} ...")

            parts.append(
                tracking_part(
                    scenes, pairs=pairs, rate_hz=rate_hz, calibration=calibration, sequences=sequences,
                    begun=named, progress=lambda: bar.advance(task), so_far=lambda text: kept(parts[0], text),
                )
            )  # fmt: skip
        if what in ("all", "twin"):
            parts.append(_twin())
        if what in ("all", "heart"):
            parts.append(_heart())
        if what in ("all", "live"):
            task = bar.add_task("live", total=len(_CLIENTS))
            parts.append(_live(seconds, lambda: bar.advance(task)))
    click.echo("\n\n".join(parts) + "\n")
    kept(*parts)
    if part is not None and out is not None:
        part.replace(out)


def _accuracy(out: Path | None, pairs: int, sequences: int, rate_hz: float, bar: Progress) -> None:
    """Print where the tip's error comes from, and put it with its pictures into a page."""
    from cathxr.app.bench_accuracy_page import SETTINGS, Amount, accuracy_part, written_between

    task = bar.add_task("accuracy", total=SETTINGS * pairs * sequences)
    pictures = None if out is None else out.parent / "images"
    amount = Amount(pairs, sequences, rate_hz)
    command = f"Made by `cathxr bench accuracy --pairs {pairs} --sequences {sequences}`, cathxr {__version__}. "
    text = command + accuracy_part(amount, pictures=pictures, progress=lambda: bar.advance(task))
    click.echo(text)
    if out is not None:
        page = out.read_text(encoding="utf-8") if out.exists() else ""
        out.write_text(written_between(page, text), encoding="utf-8", newline="\n")


def _heading(what: str, pairs: int, sequences: int, seconds: float, calibration: str) -> str:
    return (
        f"# Benchmarks\n\nMade by `cathxr bench {what} --pairs {pairs} --sequences {sequences} "
        f"--calibration {calibration} --seconds {seconds:g}`, cathxr {__version__}, "
        f"Python {platform.python_version()}, {platform.system()}, {_processor()}, {os.cpu_count()} cores. All "
        "pictures are **synthetic** (the digital twin, 2 x 1280x720, 9F catheter unless said, cameras off-nominal). "
        "Machines differ and shared ones are noisy: trust the ratios, measured in one run, before milliseconds."
    )


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _twin() -> str:
    """Return how fast the twin renders, one camera in one thread."""
    from cathxr.storage.rig_file import example_rig
    from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig

    rows = []
    for name in ("smooth", "debris", "mjpg", "rolling_shutter"):
        renderer = CameraRenderer(TwinWorld(true_rig(example_rig(), 3), seed=3, settings=scene(name)), "top")
        spent = []
        for i in range(40):
            begun = time.thread_time()
            renderer.picture(1_000_000_000 + i * 33_333_333)
            spent.append(time.thread_time() - begun)
        middle = 1e3 * float(np.median(spent[5:]))
        rows.append((name, f"{middle:.1f}", f"{1e3 / middle:.0f}"))
    return "## Twin\n\nProcessor time of one 1280x720 colour picture:\n\n" + table(("scene", "ms", "pictures/s"), rows)


def _heart() -> str:
    """Return what it takes to make a heart folder, and what several threads gain."""
    head = "## Heart\n\n"
    try:
        from cathxr.app.bench_heart import build_times
    except ImportError:
        return head + "Not measured: pip install 'cathxr[heart]' brings what it needs."
    spent = build_times()
    rows = [(name, f"{each.wall_s:.1f}", f"{each.cpu_s:.1f}") for name, each in spent.items()]
    one, other = (each.wall_s for each in spent.values())
    text = table(("independent jobs", "wall clock, s", "processor time, s"), rows)
    return (
        f"{head}The built-in heart's labels (0.7 mm) to a heart folder with surfaces, acoustic volume and quality "
        f"page, 150,000 triangles; no CT, no segmentation.\n\n{text}\n\nRatio of the wall clocks: {one / other:.2f}."
    )


def _live(seconds: float, progress: Callable[[], None]) -> str:
    """Return latency and load of the live system with several numbers of clients."""
    rows = []
    for clients in _CLIENTS:
        each = measure(clients, seconds=seconds)
        progress()
        rows.append(
            (
                str(clients), f"{each.rate_hz:.1f}", f"{each.p50_ms:.1f}", f"{each.p99_ms:.1f}", f"{each.max_ms:.0f}",
                "-" if each.cpu_share is None else f"{100.0 * each.cpu_share:.0f} %",
                "-" if each.memory_mb is None else f"{each.memory_mb:.0f}",
                f"{100.0 * each.tracked_share:.1f} %", "-" if each.tip_mm is None else f"{each.tip_mm:.3f}",
            )
        )  # fmt: skip
    text = table(
        ("clients", "Tracks/s", "p50 ms", "p99 ms", "max ms", "CPU", "memory MB", "tracked", "tip mean mm"), rows
    )
    return (
        "## Live\n\n`cathxr run` on the twin in one process (rendering, tracking and serving), WebSocket clients in "
        "another, on the same machine. Latency: mid-exposure of the top picture to the message in a client's hands. "
        "CPU: of the whole `cathxr run` process, 100 % being one core. The clients' own process "
        "takes its share of the same cores: many clients here show more load than a server would have elsewhere."
        f"\n\n{text}"
    )
