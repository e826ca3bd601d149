"""Calibration boards: what is printed, said in one line of text, and where its corners are."""

import re
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import cv2
import numpy as np

from cathxr.core import ConfigError, FloatArray, PixelArray

EXAMPLES = "charuco:10x10:6.0:4.0:DICT_4X4_50 or chessboard:9x6:25.0"
_LEAST, _MOST = 3, 60
_NUMBER = r"\d+(?:\.\d*)?|\.\d+"
_CHARUCO = re.compile(
    rf"charuco:(\d{{1,4}})x(\d{{1,4}}):({_NUMBER}):({_NUMBER}):(\w+)(:legacy)?", re.ASCII | re.IGNORECASE
)
_CHESSBOARD = re.compile(rf"chessboard:(\d{{1,4}})x(\d{{1,4}}):({_NUMBER})", re.ASCII | re.IGNORECASE)


@dataclass(frozen=True)
class Board:
    """One printed board. Frame: x right, y down, z into the paper, mm; origin as OpenCV has it (see `corners_mm`).

    kind: "charuco" or "chessboard". columns, rows: squares of a ChArUco board, inner corners of a chessboard.
    marker_mm, dictionary: the ArUco markers in a ChArUco board's white squares, None on a chessboard.
    legacy: the pattern of ChArUco boards printed with OpenCV before 4.6, which begins with a white square where the
    number of rows is even.
    """

    kind: str
    columns: int
    rows: int
    square_mm: float
    marker_mm: float | None = None
    dictionary: str | None = None
    legacy: bool = False

    def __post_init__(self) -> None:
        if problem := _problem(self):
            raise ConfigError(f"board {self.text!r}: {problem}; write it as {EXAMPLES}.")

    @property
    def text(self) -> str:
        """The board in one line, as on the command line; `parse_board` gives the same board back."""
        head = f"{self.kind}:{self.columns}x{self.rows}:{self.square_mm!r}"
        if self.kind == "chessboard":
            return head
        return f"{head}:{self.marker_mm!r}:{self.dictionary}{':legacy' if self.legacy else ''}"

    @property
    def is_charuco(self) -> bool:
        """Whether the board has ArUco markers, so that a part of it suffices."""
        return self.kind == "charuco"

    @property
    def grid(self) -> tuple[int, int]:
        """Columns and rows of inner corners."""
        return (self.columns - 1, self.rows - 1) if self.is_charuco else (self.columns, self.rows)

    @property
    def squares(self) -> tuple[int, int]:
        """Columns and rows of squares."""
        return (self.columns, self.rows) if self.is_charuco else (self.columns + 1, self.rows + 1)

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the printed squares."""
        return self.squares[0] * self.square_mm, self.squares[1] * self.square_mm

    @property
    def corner_count(self) -> int:
        """How many inner corners the board has."""
        return self.grid[0] * self.grid[1]

    @cached_property
    def corners_mm(self) -> FloatArray:
        """Inner corners (N, 3), mm, by id: along the first row, then the next; z = 0.

        ChArUco: the origin is the outer corner of the first square. Chessboard: the origin is the first inner corner.
        """
        columns, rows = self.grid
        across, down = np.meshgrid(np.arange(columns), np.arange(rows))
        steps = np.column_stack([across.ravel(), down.ravel(), np.zeros(columns * rows)]).astype(np.float64)
        steps[:, :2] += 1.0 if self.is_charuco else 0.0
        corners = np.asarray(steps * self.square_mm, dtype=np.float64)
        corners.setflags(write=False)
        return corners

    @property
    def picture_origin_mm(self) -> FloatArray:
        """Where in the board's frame (2,), mm, the outer corner of the first printed square is."""
        return np.zeros(2) if self.is_charuco else np.full(2, -self.square_mm)

    def picture(self, *, px_per_mm: float, margin_mm: float = 0.0) -> PixelArray:
        """Return the printed board as a grey picture, black 0 and white 255, with a white margin around.

        The picture's first pixel begins at `picture_origin_mm - margin_mm`. Squares begin at whole pixels.

        Raises:
            ValueError: a square is less than 8 pixels wide, or the picture would be larger than 20000 pixels.
        """
        square_px = round(self.square_mm * px_per_mm)
        margin_px = round(margin_mm * px_per_mm)
        size = (self.squares[0] * square_px + 2 * margin_px, self.squares[1] * square_px + 2 * margin_px)
        if square_px < 8 or margin_px < 0 or max(size) > 20000:
            raise ValueError(f"px_per_mm: expected squares of 8 px or more in at most 20000 px, got {px_per_mm}")
        if abs(square_px - self.square_mm * px_per_mm) > 1e-6 * square_px:
            raise ValueError(f"px_per_mm: expected a whole number of pixels for each square, got {px_per_mm}")
        result = np.full((size[1], size[0]), 255, dtype=np.uint8)
        for rectangle in self.dark_rectangles_mm():
            left, top, right, bottom = np.rint(np.asarray(rectangle) * px_per_mm).astype(int) + margin_px
            result[top:bottom, left:right] = 0
        for left_mm, top_mm, number in self._markers():
            assert self.marker_mm is not None
            size_px = round(self.marker_mm * px_per_mm)
            left, top = round(left_mm * px_per_mm) + margin_px, round(top_mm * px_per_mm) + margin_px
            bits = self._bits(number)
            index = (np.arange(size_px) * len(bits)) // size_px
            result[top : top + size_px, left : left + size_px] = np.where(bits[np.ix_(index, index)], 255, 0)
        return result

    def dark_rectangles_mm(self, *, with_markers: bool = False) -> list[tuple[float, float, float, float]]:
        """Return what is black: left, top, right, bottom in mm from the outer corner of the first printed square."""
        columns, rows = self.squares
        side = self.square_mm
        result = [
            (column * side, row * side, (column + 1) * side, (row + 1) * side)
            for row in range(rows)
            for column in range(columns)
            if self._is_dark(column, row)
        ]
        if with_markers:
            for left, top, number in self._markers():
                bits = self._bits(number)
                step = (self.marker_mm or 0.0) / len(bits)
                result += [
                    (left + step * first, top + step * i, left + step * last, top + step * (i + 1))
                    for i, line in enumerate(bits)
                    for first, last in _dark_runs(line)
                ]
        return result

    def in_pattern(self, *, legacy: bool) -> Self:
        """Return this board in the pattern of OpenCV before 4.6 or after."""
        return replace(self, legacy=legacy)

    @property
    def has_two_patterns(self) -> bool:
        """Whether the pattern of OpenCV before 4.6 differs from the later one."""
        return self.is_charuco and self.rows % 2 == 0

    def opencv(self) -> cv2.aruco.CharucoBoard:
        """Return OpenCV's ChArUco board.

        Raises:
            ValueError: this is a chessboard.
        """
        if not self.is_charuco or self.marker_mm is None:
            raise ValueError("board: expected a ChArUco board")
        result = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_mm, self.marker_mm, self._dictionary())
        result.setLegacyPattern(self.legacy)
        return result

    def _dictionary(self) -> cv2.aruco.Dictionary:
        return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary or ""))

    def _is_dark(self, column: int, row: int) -> bool:
        if self.is_charuco and self.legacy and self.has_two_patterns:
            return (column + row) % 2 == 1
        return (column + row) % 2 == 0

    def _markers(self) -> list[tuple[float, float, int]]:
        """Return left, top (mm) and number of each marker, in the order of their numbers."""
        if not self.is_charuco:
            return []
        columns, rows = self.squares
        inset = 0.5 * (self.square_mm - (self.marker_mm or 0.0))
        places = [(column, row) for row in range(rows) for column in range(columns) if not self._is_dark(column, row)]
        return [(x * self.square_mm + inset, y * self.square_mm + inset, i) for i, (x, y) in enumerate(places)]

    def _bits(self, number: int) -> FloatArray:
        """Return a marker's cells (n, n), border included: 1 where white."""
        dictionary = self._dictionary()
        cells = dictionary.markerSize + 2
        return np.asarray(dictionary.generateImageMarker(number, cells, borderBits=1) > 127, dtype=np.float64)


def parse_board(text: str) -> Board:
    """Return the board of its text, such as charuco:10x10:6.0:4.0:DICT_4X4_50 or chessboard:9x6:25.0.

    charuco:COLUMNSxROWS (squares):SQUARE mm:MARKER mm:DICTIONARY, with :legacy for the pattern of OpenCV before 4.6;
    chessboard:COLUMNSxROWS (inner corners):SQUARE mm.

    Raises:
        ConfigError: the text is neither, or no such board can be.
    """
    stripped = text.strip()
    if match := _CHARUCO.fullmatch(stripped):
        columns, rows, square, marker, dictionary, legacy = match.groups()
        name = dictionary.upper()
        return Board("charuco", int(columns), int(rows), float(square), float(marker), name, legacy is not None)
    if match := _CHESSBOARD.fullmatch(stripped):
        return Board("chessboard", int(match[1]), int(match[2]), float(match[3]))
    raise ConfigError(
        f"board {text!r}: expected kind, columns x rows, square in mm (and for ChArUco marker in mm and dictionary); "
        f"write it as {EXAMPLES}."
    )


def dictionaries() -> tuple[str, ...]:
    """Return the names of the ArUco dictionaries that a board may use."""
    return tuple(sorted(name for name in dir(cv2.aruco) if name.startswith("DICT_")))


def _problem(board: Board) -> str | None:
    """Return why no such board can be, as a phrase, None where it can."""
    if board.kind not in ("charuco", "chessboard"):
        return f"expected charuco or chessboard, got {board.kind!r}"
    if not (_LEAST <= board.columns <= _MOST and _LEAST <= board.rows <= _MOST):
        return f"expected {_LEAST} to {_MOST} columns and rows, got {board.columns}x{board.rows}"
    if not (np.isfinite(board.square_mm) and 0.5 <= board.square_mm <= 500.0):
        return f"expected squares of 0.5 to 500 mm, got {board.square_mm:g}"
    if board.kind == "chessboard":
        return None
    return _charuco_problem(board)


def _charuco_problem(board: Board) -> str | None:
    if board.marker_mm is None or not 0.3 * board.square_mm <= board.marker_mm <= 0.95 * board.square_mm:
        return f"expected markers of 0.3 to 0.95 of a square ({board.square_mm:g} mm), got {board.marker_mm}"
    if board.dictionary not in dictionaries():
        return f"no ArUco dictionary is named {board.dictionary} (DICT_4X4_50, DICT_5X5_100, DICT_6X6_250 are)"
    known = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary)).bytesList)
    needed = board.columns * board.rows // 2
    if needed > known:
        return f"it needs {needed} markers and {board.dictionary} has {known}: use a larger dictionary"
    return None


def _dark_runs(line: FloatArray) -> list[tuple[int, int]]:
    """Return first and one past last of each run of zeros."""
    edges = np.flatnonzero(np.diff(np.concatenate([[1.0], line, [1.0]])))
    return [(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]
