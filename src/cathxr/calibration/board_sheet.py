"""A board as a true-scale PDF: exact squares, two rulers to check the print, and what to do when they are wrong."""

from io import BytesIO

import numpy as np
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from cathxr.calibration.board import Board
from cathxr.calibration.drawing import INK
from cathxr.core import ConfigError

PAPERS_MM = {"A4": (210.0, 297.0), "Letter": (215.9, 279.4)}
"""Width and height, upright."""

_EDGE_MM = 6.0
"""What printers leave white."""
_RULER_MM = 7.0
_TEXT_MM = 11.0
_GAP_MM = 3.0
_MM_PER_INCH = 25.4


def board_pdf(board: Board, paper: str) -> bytes:
    """Return the board on one sheet, "A4" or "Letter", upright or lying, as a PDF in true scale.

    Raises:
        ConfigError: the board does not fit (says the largest square that does), or the paper is unknown.
    """
    if paper not in PAPERS_MM:
        raise ConfigError(f"There is no paper {paper!r} to print a board on: choose {' or '.join(PAPERS_MM)}.")
    upright = PAPERS_MM[paper]
    sheets = [upright, upright[::-1]]
    fitting = [sheet for sheet in sheets if _fits(board, sheet)]
    if not fitting:
        largest = max(_largest_square_mm(board, sheet) for sheet in sheets)
        raise ConfigError(
            f"board {board.text}: {board.size_mm[0]:g} x {board.size_mm[1]:g} mm do not fit on {paper} with white "
            f"around and the rulers; the largest square that fits is {largest:.1f} mm, or take fewer columns and rows."
        )
    return _drawn(board, fitting[0])


def _room_mm(sheet: tuple[float, float]) -> tuple[float, float]:
    """Return the width and height that a sheet has for the squares."""
    return (
        sheet[0] - 2 * _EDGE_MM - _RULER_MM - _GAP_MM,
        sheet[1] - 2 * _EDGE_MM - _RULER_MM - _GAP_MM - _TEXT_MM,
    )


def _fits(board: Board, sheet: tuple[float, float]) -> bool:
    return all(size <= room for size, room in zip(board.size_mm, _room_mm(sheet), strict=True))


def _largest_square_mm(board: Board, sheet: tuple[float, float]) -> float:
    each = [room / count for room, count in zip(_room_mm(sheet), board.squares, strict=True)]
    return float(np.floor(10.0 * min(each)) / 10.0)


def _drawn(board: Board, sheet: tuple[float, float]) -> bytes:
    """Return the PDF. The axes are the sheet in mm, x right and y down: what is drawn at mm is printed there."""
    width, height = sheet
    figure = Figure(figsize=(width / _MM_PER_INCH, height / _MM_PER_INCH), facecolor="white")
    FigureCanvasPdf(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, width)
    axes.set_ylim(height, 0.0)
    axes.axis("off")
    room = _room_mm(sheet)
    left = _EDGE_MM + _RULER_MM + _GAP_MM + 0.5 * (room[0] - board.size_mm[0])
    top = _EDGE_MM + 0.5 * (room[1] - board.size_mm[1])
    rectangles = np.array(board.dark_rectangles_mm(with_markers=True)) + np.array([left, top, left, top])
    # One path for all: renderers would leave hairlines between separate shapes that touch.
    axes.add_patch(PathPatch(_path(rectangles), facecolor="black", edgecolor="none", linewidth=0.0))
    across = 10.0 * np.floor(room[0] / 10.0)
    down = 10.0 * np.floor(room[1] / 10.0)
    bottom = _EDGE_MM + room[1] + _GAP_MM
    ticks = [*_ruler(across, horizontal=True, at=(_EDGE_MM + _RULER_MM + _GAP_MM, bottom))]
    ticks += _ruler(down, horizontal=False, at=(_EDGE_MM + _RULER_MM, _EDGE_MM))
    axes.add_patch(PathPatch(_path(np.array(ticks)), facecolor="black", edgecolor="none", linewidth=0.0))
    _numbers(axes.text, across=across, down=down, bottom=bottom)
    lines = _sentences(board, across=across, down=down)
    for i, line in enumerate(lines):
        y = bottom + _RULER_MM + 2.2 + 3.1 * i
        axes.text(_EDGE_MM, y, line, fontsize=6.6, color=INK, va="center", weight="bold" if i == 0 else "normal")
    buffer = BytesIO()
    metadata = {"Title": board.text, "Creator": "cathxr calibrate board", "Producer": None, "CreationDate": None}
    figure.savefig(buffer, format="pdf", metadata=metadata)
    return buffer.getvalue()


def _path(rectangles: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Path:
    """Return one path of rectangles (N, 4): left, top, right, bottom."""
    left, top, right, bottom = rectangles.T
    corners = np.stack([left, top, right, top, right, bottom, left, bottom, left, top], axis=1).reshape(-1, 2)
    codes = np.tile([Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], len(rectangles))
    return Path(corners, codes)


def _ruler(length_mm: float, *, horizontal: bool, at: tuple[float, float]) -> list[tuple[float, float, float, float]]:
    """Return a ruler's ticks as thin rectangles, each mm; the middle of a tick is its mark."""
    half = 0.06
    result = []
    for mark in range(round(length_mm) + 1):
        tick = 3.2 if mark % 10 == 0 else 2.3 if mark % 5 == 0 else 1.4
        if horizontal:
            x, y = at[0] + mark, at[1]
            result.append((x - half, y, x + half, y + tick))
        else:
            x, y = at[0], at[1] + mark
            result.append((x - tick, y - half, x, y + half))
    return result


def _numbers(write, *, across: float, down: float, bottom: float) -> None:  # type: ignore[no-untyped-def]
    for mark in range(0, round(across) + 1, 10):
        write(_EDGE_MM + _RULER_MM + _GAP_MM + mark, bottom + 4.9, f"{mark}", fontsize=6, ha="center", va="center")
    for mark in range(0, round(down) + 1, 10):
        write(_EDGE_MM + 1.9, _EDGE_MM + mark, f"{mark}", fontsize=6, ha="center", va="center", rotation=90)


def _sentences(board: Board, *, across: float, down: float) -> tuple[str, str, str]:
    count = max(board.squares)
    return (
        f"{board.text}     Print at 100 %, no scaling, on matt paper; glue it flat onto a stiff plate.",
        f"Check with a real ruler: {across:.0f} mm across and {down:.0f} mm down must be just that. "
        "If both are off alike, the print is scaled:",
        f"measure the longer side of the board, divide it by {count}, and give that as the square in --board. "
        "If they are off differently, print it again.",
    )
