"""Where a board's corners are, to a pixel or so, by OpenCV's finders; and which other board a picture may show."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.calibration.board import Board, dictionaries
from cathxr.core import FloatArray, PixelArray

Ids = NDArray[np.int64]

_WIDE_PX = 1000
"""Chessboards are looked for in pictures of at most about this width: their finder is slow, and the fit is exact."""
_LOOKED_AT = 6
"""So many pictures tell which board they show."""


@dataclass(frozen=True, eq=False)
class Found:
    """Corners found: their numbers (N,) and where they are (N, 2), px."""

    ids: Ids
    corners_px: FloatArray


def grey(pixels: PixelArray) -> PixelArray:
    """Return a picture, uint8 (H, W) or (H, W, 3) BGR, in grey (H, W).

    Raises:
        ValueError: it is neither.
    """
    good = pixels.dtype == np.uint8 and pixels.size > 0
    if good and pixels.ndim == 2:
        return np.ascontiguousarray(pixels)
    if good and pixels.ndim == 3 and pixels.shape[2] == 3:
        return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    raise ValueError(f"pixels: expected uint8 (H, W) or (H, W, 3), got {pixels.dtype} {pixels.shape}")


def find_corners(board: Board, shades: PixelArray) -> Found | str:
    """Return the board's corners in a grey picture (H, W), or as a phrase why there are none."""
    return _charuco(board, shades) if board.is_charuco else _chessboard(board, shades)


def board_in(board: Board, pictures: Iterable[PixelArray]) -> Board:
    """Return `board` in the pattern, of OpenCV before 4.6 or after, that grey pictures show; else `board`."""
    if not board.has_two_patterns:
        return board
    other = board.in_pattern(legacy=not board.legacy)
    seen = [0, 0]
    for shades in list(pictures)[:_LOOKED_AT]:
        for i, each in enumerate((board, other)):
            found = find_corners(each, shades)
            seen[i] += 0 if isinstance(found, str) else len(found.ids)
    return other if seen[1] > seen[0] else board


def other_board(board: Board, pictures: Sequence[PixelArray]) -> str | None:
    """Return, as a phrase, which other board grey pictures seem to show, None where nothing is recognised."""
    some = pictures[:_LOOKED_AT]
    numbers = {name: _marker_numbers(name, some) for name in _families()}
    best = max(numbers, key=lambda name: len(numbers[name]))
    if len(numbers[best]) >= 6:
        name = _smallest(best, numbers[best])
        if board.dictionary is not None and _family(name) == _family(board.dictionary):
            return (
                f"they show its markers, but not where a board of {board.columns} columns and {board.rows} rows of "
                "squares has them: count again, columns first"
            )
        return f"they show ArUco markers of another dictionary, {name} or a larger one like it"
    seen = [
        (columns, rows)
        for columns, rows in _other_sizes(board)
        if any(
            not isinstance(_chessboard(Board("chessboard", columns, rows, board.square_mm), shades), str)
            for shades in some[:2]
        )
    ]
    if seen:
        columns, rows = max(seen, key=lambda each: each[0] * each[1])
        return f"they show a chessboard of {columns}x{rows} inner corners, chessboard:{columns}x{rows}:SQUARE"
    return None


def _charuco(board: Board, shades: PixelArray) -> Found | str:
    detector = cv2.aruco.CharucoDetector(board.opencv())
    corners, ids, _, markers = detector.detectBoard(shades)
    seen = 0 if markers is None else len(markers)
    if ids is None or len(ids) == 0:
        if seen == 0:
            return "no board: none of its markers is seen"
        return f"no board: {seen} of its markers are seen, but no corner between them"
    order = np.argsort(ids.ravel())
    points = corners.reshape(-1, 2).astype(np.float64)[order]
    numbers = ids.ravel().astype(np.int64)[order]
    inside = np.isfinite(points).all(axis=1)
    return Found(numbers[inside], points[inside])


def _chessboard(board: Board, shades: PixelArray) -> Found | str:
    scale = max(1, round(shades.shape[1] / _WIDE_PX))
    tries = [(scale, _by_sectors), (scale, _by_quads)]
    if scale > 1:
        tries.append((1, _by_sectors))
    for reduced, finder in tries:
        small = shades if reduced == 1 else cv2.resize(shades, None, fx=1 / reduced, fy=1 / reduced, interpolation=3)
        corners = finder(np.asarray(small, dtype=np.uint8), board.grid)
        if corners is not None:
            # The first pixel's centre is (0, 0): a pixel of the smaller picture covers several of the larger.
            points = (corners.reshape(-1, 2).astype(np.float64) + 0.5) * reduced - 0.5
            return Found(np.arange(len(points), dtype=np.int64), points)
    columns, rows = board.grid
    return (
        f"no board: a chessboard of {columns}x{rows} inner corners is not seen whole; bring all of it into the "
        "picture, with its white margin"
    )


def _by_sectors(shades: PixelArray, grid: tuple[int, int]) -> FloatArray | None:
    """Duda and Frese, "Accurate Detection and Localization of Checkerboard Corners", BMVC 2018."""
    found, corners = cv2.findChessboardCornersSB(shades, grid, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    return np.asarray(corners, dtype=np.float64) if found else None


def _by_quads(shades: PixelArray, grid: tuple[int, int]) -> FloatArray | None:
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    found, corners = cv2.findChessboardCorners(shades, grid, flags=flags)
    return np.asarray(corners, dtype=np.float64) if found else None


def _families() -> tuple[str, ...]:
    """Return the largest dictionary of each family: its markers begin with those of the smaller ones."""
    return tuple(
        name
        for name in dictionaries()
        if name.endswith("_1000") or name in ("DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_36H11", "DICT_APRILTAG_16H5")
    )


def _family(dictionary: str) -> str:
    return dictionary.rpartition("_")[0]


def _smallest(dictionary: str, numbers: Sequence[int]) -> str:
    """Return the smallest dictionary of the same family that has these markers but for a few, misread ones."""
    highest = float(np.percentile(numbers, 85))
    sizes = {
        each: int(each.rpartition("_")[2]) for each in dictionaries() if each.startswith(_family(dictionary) + "_")
    }
    fitting = {each: size for each, size in sizes.items() if size > highest} if dictionary.endswith("_1000") else {}
    return min(fitting, key=lambda each: fitting[each], default=dictionary)


def _marker_numbers(dictionary: str, pictures: Sequence[PixelArray]) -> list[int]:
    """Return the numbers of all markers read."""
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)))
    found = [detector.detectMarkers(shades)[1] for shades in pictures]
    return [int(each) for ids in found if ids is not None for each in ids.ravel()]


def _other_sizes(board: Board) -> list[tuple[int, int]]:
    """Return what a person may have meant: squares counted instead of corners, or one more or less, or exchanged."""
    columns, rows = board.grid
    near = [(columns + i, rows + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    common = [(9, 6), (10, 7), (8, 6), (8, 5), (7, 6), (7, 7)]
    sizes = [(board.columns, board.rows), *near, *common]
    return [each for each in dict.fromkeys(sizes) if min(each) >= 3 and each != board.grid]
