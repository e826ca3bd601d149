"""`cathxr calibrate intrinsics --live`: a board held before the camera, on the page, until the lens is known."""

import datetime
import os
import shutil
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np

from cathxr.app.calibration_server import compiled, serve_calibration
from cathxr.app.config import Config, read_config
from cathxr.app.page_options import PageChoice
from cathxr.app.plugins import make_camera
from cathxr.calibration.board import Board
from cathxr.calibration.board_views import find_board
from cathxr.calibration.poses import with_intrinsics
from cathxr.core import Clock, ConfigError, DataError, Image, Intrinsics, PixelArray, Rig, Source
from cathxr.devices.clock import MonotonicClock
from cathxr.runtime.calibration_intrinsics import IntrinsicsSession, Solution
from cathxr.runtime.calibration_task import Ending
from cathxr.storage.atomic import check_writable, os_reason, written_whole
from cathxr.storage.rig_file import read_rig, write_rig
from cathxr.twin.board_camera import TwinBoardCamera
from cathxr.wire.hub import Hub

_SQUARE_PX = 48
_MARGIN_SQUARES = 0.5


@dataclass(frozen=True)
class LiveIntrinsics:
    """Where the pictures come from and how the page is served. source: "cameras", "twin", or a video file."""

    source: str = "cameras"
    config: Path | None = None
    seed: int = 0
    page: PageChoice = field(default_factory=PageChoice)


def calibrate_intrinsics_live(
    rig_path: Path, camera: str, board: Board, *, choice: LiveIntrinsics, report: Path, dry_run: bool
) -> None:
    """Measure a camera's lens on the page and write it into the rig; returns when a person has accepted it.

    Raises:
        CathxrError: it could not start, or was cancelled: the rig is untouched.
    """
    rig = read_rig(rig_path)
    if camera not in rig.cameras:
        raise ConfigError(f"The rig {rig_path} has no camera {camera!r}: it has {', '.join(rig.cameras)}.")
    if not dry_run:
        check_writable(rig_path, what="the rig")
    clock = MonotonicClock()
    source = board_source(rig, camera, board, choice=choice, clock=clock)
    # The looking thread has the processor to itself: OpenCV's own threads would only take it from the page.
    cv2.setNumThreads(1)
    compiled(lambda: find_board(board, _printed(board)[0], name="print"))

    def save(solution: Solution) -> Ending:
        return save_intrinsics(rig_path, camera, solution, report=report, dry_run=dry_run)

    def task(hub: Hub) -> IntrinsicsSession:
        date = datetime.date.today().isoformat()
        seen = rig.cameras[camera]
        return IntrinsicsSession(
            board,
            camera=camera,
            size_px=seen.size_px,
            date=date,
            keep=hub.publish_result,
            save=save,
            start=seen.intrinsics,
        )

    ending = serve_calibration(
        task, {camera: source}, rig=rig, kind=choice.source if choice.source in ("twin", "cameras") else "video",
        title=f"Calibrating the {camera} camera's lens with {board.text} ({_described(choice)}).",
        clock=clock, page=choice.page,
    )  # fmt: skip
    click.echo(ending.sentence)


def board_source(rig: Rig, camera: str, board: Board, *, choice: LiveIntrinsics, clock: Clock) -> Source[Image]:
    """Return the camera that the board is held before, closed.

    Raises:
        ConfigError: no configuration for real cameras, or one that does not name this camera.
    """
    if choice.source == "twin":
        return _twin(rig, camera, board, seed=choice.seed, clock=clock)
    if choice.source != "cameras":
        if not Path(choice.source).is_file():
            raise ConfigError(f"There is no source {choice.source!r}: give cameras, twin, or a video file.")
        return make_camera("opencv", rig, camera, clock=clock, options={"device": choice.source, "loop": True})
    config = Config() if choice.config is None else read_config(choice.config)
    options: dict[str, Any] = dict(getattr(config.cameras, camera))
    if config.cameras.driver == "opencv" and "device" not in options:
        raise ConfigError(
            f"The configuration does not say which device the {camera} camera is: run `cathxr calibrate cameras` first "
            "and give its configuration with --config, or try without hardware with --source twin."
        )
    return make_camera(config.cameras.driver, rig, camera, clock=clock, options=options)


def twin_lens(rig: Rig, camera: str, seed: int) -> Intrinsics:
    """Return the true lens of the twin's camera: near the rig's, as that of a real one is, and never the same.

    Its focal lengths differ by up to 2 %, its centre by up to 10 px, its distortion by up to a tenth.
    """
    rng = np.random.default_rng([seed, zlib.crc32(camera.encode()), 0x1E45])
    stated = rig.cameras[camera].intrinsics
    return Intrinsics(
        stated.focal_px * (1.0 + 0.02 * rng.uniform(-1.0, 1.0)),
        stated.centre_px + 10.0 * rng.uniform(-1.0, 1.0, 2),
        stated.distortion * (1.0 + 0.1 * rng.uniform(-1.0, 1.0, 5)),
    )


def save_intrinsics(rig_path: Path, camera: str, solution: Solution, *, report: Path, dry_run: bool) -> Ending:
    """Write the pictures kept, the result's pictures, and last the rig; return how it ended.

    Raises:
        CathxrError: something cannot be written; the rig is untouched.
    """
    _make(report)
    pictures = _written_pictures(report / f"intrinsics_{camera}_pictures", solution.views)
    paths = [pictures]
    for name, (_, png) in solution.pictures.items():
        path = report / f"{name}.png"
        with written_whole(path) as part:
            part.write_bytes(png)
        paths.append(path)
    repeat = f"the {len(solution.views)} pictures are in {pictures}"
    if dry_run:
        return Ending(f"Nothing was written into {rig_path} (--dry-run); {repeat}.", True, tuple(map(str, paths)))
    # Read anew: the other camera may have been calibrated meanwhile.
    rig = read_rig(rig_path)
    write_rig(rig_path, with_intrinsics(rig, camera, solution.result.intrinsics), backup=True)
    sentence = f"The {camera} camera's lens is in {rig_path} (the earlier file is beside it); {repeat}."
    if rig.cameras[camera].pose_provenance.date is not None:
        sentence += " Its pose was measured with the earlier lens: run `cathxr calibrate markers` again."
    return Ending(sentence, True, (str(rig_path), *map(str, paths)))


def _twin(rig: Rig, camera: str, board: Board, *, seed: int, clock: Clock) -> Source[Image]:
    texture, px_per_mm, margin_mm = _printed(board)
    first_x, first_y = (board.picture_origin_mm - margin_mm).tolist()
    lens = twin_lens(rig, camera, seed)
    true = replace(rig, cameras={**rig.cameras, camera: replace(rig.cameras[camera], intrinsics=lens)})
    options = {
        "texture": texture,
        "px_per_mm": px_per_mm,
        "offset_mm": (-first_x, -first_y),
        "seed": seed,
    }
    return TwinBoardCamera(true, camera, clock=clock, options=options)


def _printed(board: Board) -> tuple[PixelArray, float, float]:
    """Return a picture of the printed board, its pixels per mm, and how wide its white margin is, mm."""
    px_per_mm = _SQUARE_PX / board.square_mm
    margin_mm = _MARGIN_SQUARES * board.square_mm
    return board.picture(px_per_mm=px_per_mm, margin_mm=margin_mm), px_per_mm, margin_mm


def _written_pictures(folder: Path, pictures: Mapping[str, bytes]) -> Path:
    """Write the pictures, PNG by name, into a folder, whole or not at all; an earlier such folder stays beside it."""
    part = folder.with_name(f".{folder.name}.part")
    try:
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        for name, png in pictures.items():
            (part / f"{name}.png").write_bytes(png)
        if folder.exists():
            number = 1
            while (earlier := folder.with_name(f"{folder.name}.bak{number if number > 1 else ''}")).exists():
                number += 1
            os.replace(folder, earlier)
        os.replace(part, folder)
    except OSError as error:
        shutil.rmtree(part, ignore_errors=True)
        raise DataError(f"{folder}: cannot write the pictures ({os_reason(error)}); check the folder.") from error
    return folder


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"{folder}: cannot make the report's folder ({os_reason(error)}); choose another.") from error


def _described(choice: LiveIntrinsics) -> str:
    if choice.source == "twin":
        return f"the digital twin, seed {choice.seed}; no hardware"
    return "live" if choice.source == "cameras" else choice.source
