"""Puts the seeds' page together: CT, labels and seeds in; the page; the seeds file and maybe a heart folder out."""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import click

from cathxr.app.calibration_server import serve_page
from cathxr.app.heart_build_run import BuildChoice, build_and_tell
from cathxr.app.heart_progress import shown_progress
from cathxr.app.heart_seeds_file import SeedsWriter
from cathxr.app.page_options import PageChoice
from cathxr.core import ConfigError
from cathxr.devices.clock import MonotonicClock
from cathxr.heart.build_folder import check_place
from cathxr.heart.reading import read_labels, read_volume, require_contrast
from cathxr.heart.seeds import Seed, read_seeds
from cathxr.heart.segmentation import segment
from cathxr.heart.volume import Progress, Volume
from cathxr.runtime.heart_seeds import SeedSession, Segmented
from cathxr.runtime.heart_seeds_run import HeartSeedsRun, SeedsOutlet
from cathxr.storage.atomic import check_writable
from cathxr.wire.heart_pages import make_slices_router
from cathxr.wire.messages import PROTOCOL, SceneDescription
from cathxr.wire.scene import FRAMES

PAGE = "heart.html"
_KEY_BYTES = 24


@dataclass(frozen=True)
class SeedsChoice:
    """What a person chose; see the command's options."""

    path: Path
    out: Path = Path("seeds.csv")
    labels: Path | None = None
    names: Path | None = None
    phase: str | None = None
    series: int | None = None
    seeds: Path | None = None
    build: Path | None = None
    name: str = ""
    page: PageChoice = field(default_factory=PageChoice)


def place_seeds(choice: SeedsChoice) -> None:
    """Serve the page until a person is done, and build the heart folder where that was asked for.

    Raises:
        CathxrError: something cannot be read, written, served or built.
        KeyboardInterrupt: Ctrl-C; what was saved stays.
    """
    check_writable(choice.out, what="the seeds")
    if choice.build is not None:
        check_place(choice.build)
    source = choice.seeds or (choice.out if choice.out.is_file() else None)
    seeds = () if source is None else tuple(read_seeds(source))
    with shown_progress() as progress:
        volume = read_volume(choice.path, phase=choice.phase, series=choice.series, progress=progress)
        labels = None
        if choice.labels is not None:
            labels = read_labels(choice.labels, like=volume, names=choice.names, progress=progress)
    key = secrets.token_urlsafe(_KEY_BYTES)
    clock = MonotonicClock()
    writer = SeedsWriter(choice.out)

    def segmented(given: Sequence[Seed], progress: Progress) -> Segmented:
        require_contrast(volume)
        return segment(volume, seeds=given, progress=progress)

    session = SeedSession(
        volume, segmenter=segmented, save=writer.save, key=key, seeds=seeds, saved=source == choice.out, labels=labels
    )

    def running(outlet: SeedsOutlet) -> HeartSeedsRun:
        return HeartSeedsRun(session, outlet=outlet, clock=clock)

    ending = serve_page(
        running, scene=_scene(), file=PAGE, clock=clock, page=choice.page,
        title="Placing seeds in the heart. Ctrl-C ends it; what was saved stays.",
        routers=(make_slices_router(session.slices, key=key),),
    )  # fmt: skip
    click.echo(f"{ending.sentence} ({choice.out})" if ending.saved else ending.sentence)
    if choice.build is not None:
        _build(choice, choice.build, volume, session)


def _build(choice: SeedsChoice, out: Path, volume: Volume, session: SeedSession) -> None:
    """Build the heart folder, of the labels that were shown where these follow the seeds, else segmenting once more.

    Raises:
        CathxrError: it cannot be built; what was there is as it was.
    """
    if session.ending is None or not session.ending.saved:
        raise ConfigError(f"{out} was not built: the seeds were closed without being saved. Start the command again.")
    state = session.state()
    as_given = state.labels_from == "file" and not state.seeds  # seeds correct a segmentation, not labels
    asked = BuildChoice(
        choice.path, out, phase=choice.phase, series=choice.series, name=choice.name,
        labels=choice.labels if as_given else None, names=choice.names if as_given else None,
        seeds=choice.out if state.seeds else None,
    )  # fmt: skip
    known = session.labels if as_given or session.is_current else None
    build_and_tell(asked, material=None if known is None else (volume, known, session.findings))


def _scene() -> SceneDescription:
    """Return a scene without a box: the page shows a scan."""
    nowhere = (0.0, 0.0, 0.0)
    return SceneDescription(
        protocol=PROTOCOL, source="ct", frames={"ct": FRAMES["ct"]}, roi_min_mm=nowhere, roi_max_mm=nowhere,
        catheter_name="", catheter_diameter_mm=0.0, sector_deg=None, cameras=[], heart=None, targets=[], twin=None,
    )  # fmt: skip
