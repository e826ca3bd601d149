"""Boards as text, as corners, as pictures, and as sheets of paper."""

import math
import re
import subprocess
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cathxr.calibration.board import Board, parse_board
from cathxr.calibration.board_sheet import PAPERS_MM, board_pdf
from cathxr.calibration.board_views import BoardView, RejectedView, find_board
from cathxr.calibration.coverage import CoverageMap, still
from cathxr.core import ConfigError, FloatArray, PixelArray, Pose
from cathxr.geometry import CameraModel
from cathxr.geometry.pose import pose_from_vector
from cathxr.storage.rig_file import example_rig
from cathxr.twin import scene
from cathxr.twin.board_pictures import BoardRenderer

CHARUCO = "charuco:10x10:6.0:4.0:DICT_4X4_50"
CHESSBOARD = "chessboard:9x6:25.0"


@given(st.integers(3, 20), st.integers(3, 20), st.floats(0.5, 100.0))
def test_a_boards_text_gives_the_same_board_back(columns: int, rows: int, square_mm: float) -> None:
    board = Board("chessboard", columns, rows, square_mm)
    assert parse_board(board.text) == board
    assert board.corners_mm.shape == (columns * rows, 3)
    steps = np.diff(board.corners_mm.reshape(rows, columns, 3), axis=1)
    np.testing.assert_allclose(steps, np.broadcast_to([square_mm, 0.0, 0.0], steps.shape), rtol=1e-12, atol=1e-9)


def test_charuco_corners_and_ids_are_opencvs() -> None:
    board = parse_board(CHARUCO)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    theirs = cv2.aruco.CharucoBoard((10, 10), 6.0, 4.0, dictionary).getChessboardCorners()
    np.testing.assert_allclose(board.corners_mm, theirs, atol=1e-5)


@pytest.mark.parametrize(
    "text",
    ["", "charuco", "chessboard:9x6", "chessboard:9x6:0", "chessboard:2x6:25", "chessboard:9x6:-3",
     "charuco:10x10:4.0:6.0:DICT_4X4_50", "charuco:10x10:6.0:4.0:DICT_9X9", "charuco:60x60:6.0:4.0:DICT_4X4_50",
     "chessboard:9x6:nan", "circles:4x11:20", "chessboard:9999x6:1", CHESSBOARD + ":x"],
)  # fmt: skip
def test_what_is_no_board_is_refused_with_both_forms_shown(text: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(CHESSBOARD)):
        parse_board(text)


@pytest.mark.parametrize("text", [CHARUCO, CHESSBOARD, "charuco:7x5:12.0:9.0:DICT_5X5_100"])
def test_the_printed_picture_shows_the_corners_where_they_are(text: str) -> None:
    board, scale, margin = parse_board(text), 8.0, 10.0
    view = find_board(board, board.picture(px_per_mm=scale, margin_mm=margin), name="print")
    assert isinstance(view, BoardView)
    assert len(view.ids) == board.corner_count
    expected = (board.corners_mm[view.ids, :2] - board.picture_origin_mm + margin) * scale - 0.5
    if not board.is_charuco:  # a chessboard may be numbered from its other end
        turned = expected[::-1]
        expected = (
            turned if np.abs(view.corners_px - turned).max() < np.abs(view.corners_px - expected).max() else expected
        )
    # A perfect print: what is left is the corner model's own error.
    assert np.abs(view.corners_px - expected).max() < 0.03


@pytest.mark.parametrize("paper", ["A4", "Letter"])
@pytest.mark.parametrize("text", [CHARUCO, "chessboard:6x4:25.0"])
def test_the_sheet_has_the_papers_size_and_the_board_its_own(
    paper: str, text: str, require_tool: Callable[[str], Path], tmp_path: Path
) -> None:
    board = parse_board(text)
    pdf = board_pdf(board, paper)
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", pdf)
    assert box is not None
    size_mm = sorted(float(each) / 72.0 * 25.4 for each in box.groups())
    np.testing.assert_allclose(size_mm, sorted(PAPERS_MM[paper]), atol=0.05)
    (tmp_path / "board.pdf").write_bytes(pdf)
    tool = require_tool("pdftoppm")
    subprocess.run([tool, "-r", "254", "-gray", "board.pdf", "sheet"], cwd=tmp_path, check=True)
    sheet = cv2.imread(str(next(tmp_path.glob("sheet*.pgm"))), cv2.IMREAD_GRAYSCALE)
    view = find_board(board, np.asarray(sheet, dtype=np.uint8), name="sheet")
    assert isinstance(view, BoardView)
    places = board.corners_mm[view.ids, :2]
    measured = np.linalg.norm(view.corners_px[-1] - view.corners_px[0]) / 10.0  # 254 dpi: 10 px/mm
    # The rasteriser rounds edges to a pixel, 0.1 mm, at either end.
    assert abs(measured - np.linalg.norm(places[-1] - places[0])) < 0.15


def test_a_board_larger_than_the_paper_is_refused_with_the_largest_square() -> None:
    with pytest.raises(ConfigError, match=r"largest square that fits is \d+\.\d mm"):
        board_pdf(parse_board("chessboard:9x6:40.0"), "A4")
    largest = board_pdf(parse_board("chessboard:9x6:25.0"), "A4")
    assert largest.startswith(b"%PDF")


def seen(board: Board, *, tilt_deg: float = 25.0, shift_mm: float = 0.0) -> tuple[PixelArray, FloatArray]:
    """Return a camera's picture of the board, and where its corners truly are."""

    camera = example_rig().cameras["top"]
    scale, margin = 12.0, 8.0
    renderer = BoardRenderer(
        camera,
        board.picture(px_per_mm=scale, margin_mm=margin),
        px_per_mm=scale,
        offset_mm=tuple(margin - board.picture_origin_mm),
        settings=scene("empty_wall"),
        seed=zlib.crc32(board.text.encode()),
    )
    turn = pose_from_vector(np.array([0.0, math.radians(tilt_deg), 0.0, 0.0, 0.0, 0.0]))
    middle = board.corners_mm.mean(axis=0)
    pose = Pose(turn.rotation_wxyz, np.array([shift_mm, 0.0, 170.0]) - turn.rotation @ middle)
    in_camera = board.corners_mm @ pose.rotation.T + pose.translation_mm

    model = CameraModel(camera.intrinsics, Pose.identity(), camera.size_px)
    return renderer.picture(pose, number=1), model.pixels_from_normalised(in_camera[:, :2] / in_camera[:, 2:])


def test_corners_in_a_tilted_noisy_picture_are_good_to_a_few_hundredths() -> None:
    board = parse_board(CHARUCO)
    pixels, true = seen(board)
    view = find_board(board, pixels, name="one")
    assert isinstance(view, BoardView)
    apart = view.corners_px - true[view.ids]
    assert len(view.ids) > 70
    assert np.sqrt(np.mean(apart**2)) < 0.05
    assert np.abs(apart.mean(axis=0)).max() < 0.02


def test_pictures_of_no_use_say_why() -> None:
    board = parse_board(CHARUCO)
    pixels, _ = seen(board)
    for name, bad in {
        "black": np.zeros((720, 1280, 3), np.uint8),
        "noise": np.random.default_rng(1).integers(0, 255, (720, 1280, 3), dtype=np.uint8),
        "blurred": cv2.GaussianBlur(pixels, (0, 0), 9.0),
        "partial": np.where(np.arange(1280)[None, :, None] < 560, pixels, 90).astype(np.uint8),
        "tiny": pixels[:20, :20],
    }.items():
        found = find_board(board, bad, name=name)
        assert isinstance(found, RejectedView), name
        assert found.name == name
        assert len(found.reason) > 10
    with pytest.raises(ValueError, match="expected"):
        find_board(board, np.zeros((4, 4, 4, 4), np.uint8), name="x")


def test_coverage_fills_and_knows_what_is_new() -> None:
    board = parse_board(CHARUCO)
    cover = CoverageMap()
    first = find_board(board, seen(board)[0], name="one")
    other = find_board(board, seen(board, shift_mm=30.0, tilt_deg=-25.0)[0], name="two")
    assert isinstance(first, BoardView)
    assert isinstance(other, BoardView)
    assert cover.is_new(first)
    one = cover.with_view(first)
    assert cover.kept == 0, "a map is a value: adding a view gives another map"
    assert not one.is_new(first)
    assert one.is_new(other)
    assert 0.0 < one.filled < one.with_view(other).filled < 1.0
    assert not one.complete
    assert one.advice()
    assert still(first, first)
    assert not still(first, other)
