"""Building a heart on the console: reads, segments, builds, with a bar of what is done, and tells what was made."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from rich.console import Console
from rich.table import Table

from cathxr.app.heart_progress import shown_progress
from cathxr.app.heart_threads import side_by_side
from cathxr.core import ConfigError, RegistrationError
from cathxr.heart import HeartFolder, HeartSource
from cathxr.heart.build import build_heart
from cathxr.heart.build_folder import check_place
from cathxr.heart.openings import Places, find_places
from cathxr.heart.quality import PAGE
from cathxr.heart.reading import read_labels, read_volume, require_contrast
from cathxr.heart.volume import LabelVolume, Volume
from cathxr.heart.volume import Progress as Told
from cathxr.registration import BEFORE_MM, default_placement, registration_toml

_PLACEMENT = (
    f"default placement, nothing measured: the inlet {BEFORE_MM:g} mm before the inferior vena cava's opening, +x "
    "towards the centre of the superior vena cava's, +z as near to anterior as that allows"
)


@dataclass(frozen=True)
class BuildChoice:
    """What a person chose; see the command's options."""

    path: Path
    out: Path
    phase: str | None = None
    series: int | None = None
    labels: Path | None = None
    names: Path | None = None
    seeds: Path | None = None
    budget: int = 150_000
    name: str = ""


Material = tuple[Volume | None, LabelVolume, tuple[str, ...]]
"""The CT (None where there are labels alone), the labels on its grid, and what could not be separated."""


def build_and_tell(choice: BuildChoice, *, material: Material | None = None) -> None:
    """Build the heart folder and tell on the console what it holds.

    material: what was read and segmented already; without it, it is made from the choice.

    Raises:
        CathxrError: it cannot be read, segmented or written; what was at `out` is as it was.
    """
    _checked(choice)
    with _stopped_like_ctrl_c(), shown_progress() as told:
        heart, findings = built(choice, told, material=material)
    _tell(heart, findings)


def built(choice: BuildChoice, told: Told, *, material: Material | None = None) -> tuple[HeartFolder, tuple[str, ...]]:
    """Return the heart that was built, and the sentences about what is missing or doubtful."""
    volume, labels, findings = material or _material(choice, _part(told, 0.0, 0.55))
    told("Looking for valves and vessels' mouths", 0.55)
    places = find_places(labels, volume=volume)
    heart = build_heart(
        choice.out,
        volume=volume,
        labels=labels,
        findings=findings,
        source=source_of(choice, volume),
        name=choice.name or _default_name(volume),
        budget=choice.budget,
        places=places,
        registration=placement_of(places),
        together=side_by_side,
        progress=_part(told, 0.55, 1.0),
    )
    return heart, (*findings, *places.findings)


def source_of(choice: BuildChoice, volume: Volume | None) -> HeartSource:
    """Return what the folder says about where the heart is from: nothing about a person, and no file's name."""
    made = "labels that were given" if choice.labels is not None else "segmentation by cathxr"
    if choice.seeds is not None:
        made += ", corrected by seeds"
    return HeartSource(
        title="Labels without a CT" if volume is None else "CT series of the laboratory, without identification",
        authors="not stated",
        url="not published",
        licence="not stated: the laboratory's own data",
        licence_url="",
        changes=f"{made[0].upper()}{made[1:]}; surfaces smoothed, simplified, coloured.",
    )


def placement_of(places: Places) -> str | None:
    """Return the text of a registration.toml without landmarks; None where a vena cava's opening is missing."""
    inlet, aim = (places.openings.get(f"{each}_vena_cava") for each in ("inferior", "superior"))
    if inlet is None or aim is None:
        return None
    try:
        return registration_toml(default_placement(inlet.centroid_mm, aim.centroid_mm, method=_PLACEMENT))
    except RegistrationError:
        return None


def _material(choice: BuildChoice, told: Told) -> Material:
    """Return what the heart is made from."""
    if choice.labels is not None and choice.labels.absolute() == choice.path.absolute():
        return None, read_labels(choice.labels, like=None, names=choice.names, progress=told), ()
    volume = read_volume(choice.path, phase=choice.phase, series=choice.series, progress=_part(told, 0.0, 0.4))
    if choice.labels is not None:
        labels = read_labels(choice.labels, like=volume, names=choice.names, progress=_part(told, 0.4, 1.0))
        return volume, labels, ()
    from cathxr.heart.seeds import read_seeds
    from cathxr.heart.segmentation import segment

    require_contrast(volume)
    seeds = read_seeds(choice.seeds) if choice.seeds is not None else ()
    found = segment(volume, seeds=seeds, progress=_part(told, 0.4, 1.0))
    return volume, found.labels, tuple(found.findings)


def _checked(choice: BuildChoice) -> None:
    """Refuse, before anything long begins, what cannot go together."""
    check_place(choice.out)
    if choice.names is not None and choice.labels is None:
        raise ConfigError("--names says what the values of labels stand for; give it together with --labels.")
    if choice.seeds is not None and choice.labels is not None:
        raise ConfigError("--seeds corrects a segmentation, and --labels takes its place; give one of the two.")


def _default_name(volume: Volume | None) -> str:
    phase = volume.technical.phase if volume is not None else ""
    return "Heart from labels" if volume is None else "Heart from CT" + (f", {phase}" if phase else "")


def _part(told: Told, first: float, last: float) -> Told:
    """Return a progress that fills the part from `first` to `last` of another."""
    return lambda what, share: told(what, None if share is None else first + (last - first) * share)


@contextmanager
def _stopped_like_ctrl_c() -> Iterator[None]:
    """Let a request to end (SIGTERM) clean up as Ctrl-C does."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _tell(heart: HeartFolder, findings: tuple[str, ...]) -> None:
    """Print the volumes, what was found, and where to look."""
    console = Console()
    table = Table("structure", "volume, mL", box=None, pad_edge=False)
    table.columns[1].justify = "right"
    for each in heart.structures.values():
        table.add_row(each.name, "" if each.volume_ml is None else f"{each.volume_ml:.1f}")
    console.print(table)
    names = [each.name.lower() for each in heart.openings.values()]
    console.print(f"Openings: {', '.join(names) or 'none'}.", highlight=False)
    for sentence in findings:
        console.print(f"! {sentence}", highlight=False, markup=False, soft_wrap=True)
    ready = f"{heart.path} is ready. Look at {heart.path / PAGE} before you use it."
    console.print(ready, highlight=False, markup=False, soft_wrap=True)
