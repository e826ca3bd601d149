"""`cathxr calibrate intrinsics`: pictures of a board in, a camera's lens with its errors into the rig."""

import contextlib
import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console

from cathxr.app.calibrate_intrinsics_pictures import BoardPictures, board_pictures, found_views
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PageChoice, live_page_options
from cathxr.calibration.board import Board, parse_board
from cathxr.calibration.board_views import BoardView, RejectedView
from cathxr.calibration.poses import with_intrinsics
from cathxr.core import CalibrationError, ConfigError, Rig
from cathxr.storage.atomic import check_writable
from cathxr.storage.rig_file import read_rig, write_rig

if TYPE_CHECKING:
    from cathxr.calibration.intrinsics import IntrinsicsResult

_PATH = click.Path(path_type=Path)
_OPENCV_WINDOW_PX = 11
"""What OpenCV's own calibration program and its tutorials use."""


@click.command("intrinsics")
@click.option("--rig", "rig_path", required=True, type=_PATH, help="The rig to measure (rig.toml).")
@click.option("--camera", required=True, type=click.Choice(["top", "front"]), help="Which of its cameras.")
@click.option(
    "--board",
    "text",
    required=True,
    help="charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY (mm), :legacy for boards of OpenCV before 4.6; or "
    "chessboard:COLUMNSxROWS:SQUARE (inner corners).",
)
@click.argument("pictures", nargs=-1, type=_PATH)
@click.option("--live", is_flag=True, help="Take the pictures now, guided by a page in the browser.")
@click.option("--report", type=_PATH, help="Folder for the pictures.  [default: <rig>_calibration beside the rig]")
@click.option("--dry-run", is_flag=True, help="Measure and report, and leave the rig as it is.")
@click.option("--keep-all", is_flag=True, help="Reject no view for blur or residuals, and let all count alike.")
@click.option(
    "--corners",
    type=click.Choice(["auto", "edges", "opencv"]),
    default="auto",
    show_default=True,
    help="edges: each corner where its two edges cross, and views count by how well they agree. opencv: cornerSubPix "
    "with a half window of 11 px and all views alike, as most published calibrations. auto: edges for ChArUco; "
    "opencv for a chessboard, so that its figures compare with others', and a note when edges are better.",
)
@click.option(
    "--corner-window",
    type=click.IntRange(1, 50),
    metavar="PX",
    help="Refine corners by OpenCV's cornerSubPix with this half window, to repeat others' results.",
)
@live_page_options
@told_in_a_sentence
def intrinsics(
    rig_path: Path,
    camera: str,
    text: str,
    pictures: tuple[Path, ...],
    live: bool,
    report: Path | None,
    dry_run: bool,
    keep_all: bool,
    corners: str,
    corner_window: int | None,
    source: str,
    config: Path | None,
    seed: int,
    port: int,
    lan: bool,
    no_browser: bool,
) -> None:
    """Measure one camera's lens with pictures of a board.

    PICTURES are files, folders or a video of the board in at least 5, better 15 places: over the whole picture, into
    its corners, tilted by 20 to 45 degrees to all sides, held still. Bad ones are rejected and named. The lens with its
    errors goes into the rig, whose earlier file stays beside it; two pictures show coverage and residuals.

    \b
    Examples:
      cathxr calibrate intrinsics --rig rig.toml --camera top --board charuco:10x10:6.0:4.0:DICT_4X4_50 top_*.png
      cathxr calibrate intrinsics --rig rig.toml --camera front --board chessboard:9x6:25.0 front_pictures
      cathxr calibrate intrinsics --rig rig.toml --camera top --board chessboard:9x6:25.0 --live --config config.toml
    """
    board = parse_board(text)
    folder = rig_path.with_name(f"{rig_path.stem}_calibration") if report is None else report
    if live:
        _check_live(pictures, keep_all=keep_all, corner_window=corner_window)
        from cathxr.app.calibrate_intrinsics_live import LiveIntrinsics, calibrate_intrinsics_live

        choice = LiveIntrinsics(source, config, seed, PageChoice(port, lan, not no_browser))
        calibrate_intrinsics_live(rig_path, camera, board, choice=choice, report=folder, dry_run=dry_run)
        return
    rig = read_rig(rig_path)
    if not dry_run:
        check_writable(rig_path, what="the rig")
    found = board_pictures(pictures, rig.cameras[camera])
    way = _way(board, corners, keep_all=keep_all, window_px=corner_window)
    _measure(rig_path, rig, camera, board, found, report=folder, dry_run=dry_run, way=way)


@dataclass(frozen=True)
class _Way:
    """How to measure. window_px: of cornerSubPix, None for crossing edges; compare: tell when edges are better."""

    keep_all: bool = False
    alike: bool = False
    window_px: int | None = None
    compare: bool = False


def _way(board: Board, corners: str, *, keep_all: bool, window_px: int | None) -> _Way:
    classic = corners == "opencv" or (corners == "auto" and not board.is_charuco and not keep_all)
    if window_px is not None or corners == "edges" or not classic:
        return _Way(keep_all=keep_all, window_px=window_px if corners != "opencv" else window_px or _OPENCV_WINDOW_PX)
    return _Way(keep_all=keep_all, alike=True, window_px=_OPENCV_WINDOW_PX, compare=corners == "auto")


def _check_live(pictures: tuple[Path, ...], *, keep_all: bool, corner_window: int | None) -> None:
    for given, name in ((pictures, "pictures"), (keep_all, "--keep-all"), (corner_window, "--corner-window")):
        if given:
            raise ConfigError(f"--live takes its own pictures and decides by itself: leave out {name}, or --live.")


def _measure(
    rig_path: Path,
    rig: Rig,
    camera: str,
    board: Board,
    pictures: BoardPictures,
    *,
    report: Path,
    dry_run: bool,
    way: _Way,
) -> None:
    """Find the board, solve, report, and write the rig last.

    Raises:
        CathxrError: one sentence about what is wrong; the rig is untouched then.
    """
    from cathxr.app.calibrate_intrinsics_report import print_finer, print_result, write_pictures

    console = Console()
    asked = board
    board, found = found_views(board, pictures, window_px=way.window_px)
    if board != asked:
        console.print(f"The pictures show the other pattern of this board: it is {board.text}.", soft_wrap=True)
    try:
        result = _solved(rig, camera, board, found, way)
    except CalibrationError as error:
        if hint := pictures.hint(board, [each for each in found if isinstance(each, BoardView)]):
            raise CalibrationError(
                f"None of the {len(found)} pictures shows the board {board.text}: {hint}; correct --board."
            ) from error
        raise
    finer = None
    if way.compare:
        with contextlib.suppress(CalibrationError):
            finer = _solved(rig, camera, board, found_views(board, pictures, window_px=None)[1], _Way())
    paths = write_pictures(report, camera, result)
    if not dry_run:
        # Read anew: the other camera may have been calibrated meanwhile.
        write_rig(rig_path, with_intrinsics(read_rig(rig_path), camera, result.intrinsics), backup=True)
    print_result(console, result, camera=camera, paths=paths)
    if finer is not None:
        print_finer(console, result, finer)
    if dry_run:
        console.print(f"Nothing was written into {rig_path} (--dry-run).", soft_wrap=True, markup=False)
        return
    console.print(f"The {camera} camera's lens is in {rig_path}; the earlier file is beside it.", soft_wrap=True)
    if rig.cameras[camera].pose_provenance.date is not None:
        console.print(
            "Its pose was measured with the earlier lens: run `cathxr calibrate markers` again when both lenses are "
            "done.",
            style="yellow", soft_wrap=True, markup=False,
        )  # fmt: skip


def _solved(
    rig: Rig, camera: str, board: Board, found: Sequence[BoardView | RejectedView], way: _Way
) -> "IntrinsicsResult":
    """Return the lens that the views found give.

    Raises:
        CalibrationError: they do not determine one.
    """
    from cathxr.calibration.intrinsics import calibrate_intrinsics

    return calibrate_intrinsics(
        board,
        [each for each in found if isinstance(each, BoardView)],
        size_px=rig.cameras[camera].size_px,
        date=datetime.date.today().isoformat(),
        start=rig.cameras[camera].intrinsics,
        rejected=[each for each in found if isinstance(each, RejectedView)],
        keep_all=way.keep_all,
        alike=way.alike,
        note="" if way.window_px is None else f"corners by cornerSubPix, half window {way.window_px} px",
    )
