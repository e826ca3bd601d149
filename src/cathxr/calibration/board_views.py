"""A board in a picture: which of its corners are seen, and where, to some hundredths of a pixel; or why not."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.calibration.board import Board
from cathxr.calibration.board_finding import Found, Ids, find_corners, grey
from cathxr.calibration.corner_kernels import fit_corners
from cathxr.core import FloatArray, PixelArray
from cathxr.core.arrays import checked

LEAST_CORNERS = 12
"""Fewer corners fix a view's own pose and say hardly anything about the lens."""

_REACH = 0.42
"""How far from a corner its edges are looked at, in squares: short of where the next corner's blur begins."""
_MOST_PX = 8.0
"""The same in pixels: within it the edges of a distorted board are straight to 0.01 px (k1 = -0.2, 1280x720)."""
_MOST_LEFT = 0.2
"""A corner that the model leaves this share of contrast unexplained is covered, in glare, or none."""
_MOST_MOVED_PX = 2.0
"""The finders are good to 1 px (half-size pictures); what the fit moves further has slipped to another edge."""
_MOST_BLUR_SQUARES = 0.16
_MOST_BLUR_PX = 4.0
_ALIKE_PX = 0.25
"""Two pictures whose corners agree this well were taken without moving the board: they are one view."""


@dataclass(frozen=True, eq=False)
class BoardView:
    """The board in one picture.

    ids (N,): the corners' numbers in `Board.corners_mm`; corners_px (N, 2): where they are, raw pixels. sharpness: one
    over the edges' blur, 1/px (larger is sharper). square_px: mean side of a square in the picture. tilt (2,): how much
    the scale grows, as a share, across the board from the picture's left to its right and from its top to its bottom.
    """

    name: str
    size_px: tuple[int, int]
    ids: Ids
    corners_px: FloatArray
    sharpness: float
    square_px: float = 0.0
    tilt: FloatArray = field(default_factory=lambda: np.zeros(2))

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners_px", checked("corners_px", self.corners_px, (None, 2)))
        object.__setattr__(self, "tilt", checked("tilt", self.tilt, (2,)))
        ids = np.array(self.ids, dtype=np.int64)
        if ids.shape != (len(self.corners_px),) or len(np.unique(ids)) != len(ids):
            raise ValueError(f"ids: expected {len(self.corners_px)} different numbers, one a corner, got {ids.shape}")
        ids.setflags(write=False)
        object.__setattr__(self, "ids", ids)

    @property
    def blur_px(self) -> float:
        """Standard deviation of the edges' blur."""
        return 1.0 / self.sharpness


@dataclass(frozen=True)
class RejectedView:
    """A picture that is not used. reason: why, and what to do about it, as a phrase."""

    name: str
    reason: str


def find_board(
    board: Board, pixels: PixelArray, *, name: str, corner_window_px: int | None = None
) -> BoardView | RejectedView:
    """Return the board's corners in a picture, uint8 (H, W) or (H, W, 3) BGR, or why it does not serve.

    corner_window_px: refine the corners by OpenCV's cornerSubPix with this fixed half window instead of by the model of
    two crossing edges; only to repeat calibrations of others, for a window that meets other edges spoils corners.

    Raises:
        ValueError: the array is no picture.
    """
    shades = grey(pixels)
    found = find_corners(board, shades)
    if isinstance(found, str):
        return RejectedView(name, found)
    if corner_window_px is not None:
        return _by_opencv(board, shades, found, name=name, window_px=corner_window_px)
    return _by_model(board, shades, found, name=name)


def screened(
    views: Sequence[BoardView], *, size_px: tuple[int, int]
) -> tuple[tuple[BoardView, ...], tuple[RejectedView, ...]]:
    """Return the views that may be used together, and those of another size, blurred beside the others, or repeated."""
    kept: list[BoardView] = []
    rejected: list[RejectedView] = []
    usual = float(np.median([view.blur_px for view in views])) if views else 0.0
    for view in views:
        twin = next((each for each in kept if same_view(each, view, limit_px=_ALIKE_PX)), None)
        if view.size_px != size_px:
            wide, high = view.size_px
            reason = f"another picture size: {wide}x{high} px, not {size_px[0]}x{size_px[1]}"
        elif view.blur_px > max(2.0 * usual, usual + 0.8):
            reason = f"blurred: its edges have a blur of {view.blur_px:.1f} px, the others {usual:.1f} px"
        elif twin is not None:
            reason = f"the same view as {twin.name}: move the board between pictures"
        else:
            kept.append(view)
            continue
        rejected.append(RejectedView(view.name, reason))
    return tuple(kept), tuple(rejected)


def same_view(first: BoardView, second: BoardView, *, limit_px: float) -> bool:
    """Return whether the board rests at the same place in both pictures, to `limit_px` in the mean."""
    common, of_first, of_second = np.intersect1d(first.ids, second.ids, assume_unique=True, return_indices=True)
    if len(common) < 4 or len(common) < 0.6 * min(len(first.ids), len(second.ids)):
        return False
    apart = first.corners_px[of_first] - second.corners_px[of_second]
    return bool(np.sqrt(np.mean(np.sum(apart**2, axis=1))) < limit_px)


def _by_model(board: Board, shades: PixelArray, found: Found, *, name: str) -> BoardView | RejectedView:
    plane = _plane(board, found)
    if plane is None:
        return RejectedView(name, _partial(board, len(found.ids)))
    lattice, square_px, tilt = plane.lattice, plane.square_px, plane.tilt
    starts, blur_px = np.asarray(found.corners_px, dtype=np.float64), 1.0
    for _ in range(2):  # the second time with the blur known: how near to a marker's frame a pixel still is white
        clear = 1.0
        if board.marker_mm is not None:
            inset = 0.5 * (1.0 - board.marker_mm / board.square_mm)
            clear = max(inset - 1.5 * blur_px / square_px, 0.5 * inset)
        fitted, left = fit_corners(shades, starts, lattice, _REACH, clear, _MOST_PX)
        good = np.isfinite(left)
        if not good.any():
            return RejectedView(name, "too blurred or too dark to find the corners to a fraction of a pixel")
        blur_px = float(np.median(fitted[good, 4:6].max(axis=1)))
    usual = float(np.median(left[good]))
    good &= (left < max(_MOST_LEFT, 2.0 * usual)) & (np.linalg.norm(fitted[:, :2] - starts, axis=1) < _MOST_MOVED_PX)
    good &= _alternating(board, found.ids, fitted[:, 9], good)
    if blur_px > min(_MOST_BLUR_PX, _MOST_BLUR_SQUARES * square_px):
        return RejectedView(
            name, f"blurred: its edges have a blur of {blur_px:.1f} px; hold the board still and check the focus"
        )
    ids = found.ids[good]
    if not _suffice(board, ids) or (not board.is_charuco and len(ids) < 0.6 * board.corner_count):
        return RejectedView(name, _partial(board, len(ids)))
    height, width = shades.shape
    return BoardView(name, (width, height), ids, fitted[good, :2], 1.0 / blur_px, square_px, tilt)


def _by_opencv(
    board: Board, shades: PixelArray, found: Found, *, name: str, window_px: int
) -> BoardView | RejectedView:
    plane = _plane(board, found)
    if plane is None:
        return RejectedView(name, _partial(board, len(found.ids)))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01)
    starts = np.ascontiguousarray(found.corners_px, dtype=np.float32).reshape(-1, 1, 2)
    corners = cv2.cornerSubPix(shades, starts, (window_px, window_px), (-1, -1), criteria).reshape(-1, 2)
    height, width = shades.shape
    size_px = (width, height)
    return BoardView(name, size_px, found.ids, corners.astype(np.float64), 1.0, plane.square_px, plane.tilt)


@dataclass(frozen=True, eq=False)
class _Plane:
    """The board's plane in a picture: lattice (N, 2, 2), each corner's steps along a row and a column, px."""

    lattice: FloatArray
    square_px: float
    tilt: FloatArray


def _plane(board: Board, found: Found) -> _Plane | None:
    """Return the board's plane, None where the corners do not span one.

    By one homography for the whole board: the lens bends it by much less than directions and sizes here need.
    """
    if not _suffice(board, found.ids):
        return None
    places = board.corners_mm[found.ids, :2]
    homography, _ = cv2.findHomography(places, found.corners_px, 0)
    if homography is None or not np.isfinite(homography).all():
        return None
    depth = np.column_stack([places, np.ones(len(places))]) @ homography[2]
    depth = depth * np.sign(np.median(depth))
    if depth.min() < 0.05 * depth.max():
        return None
    half = 0.5 * board.square_mm
    ends = [places + np.array(step) for step in ((half, 0.0), (-half, 0.0), (0.0, half), (0.0, -half))]
    right, left, down, up = (cv2.perspectiveTransform(each[None], homography)[0] for each in ends)
    lattice = np.ascontiguousarray(np.stack([right - left, down - up], axis=1), dtype=np.float64)
    square_px = float(np.sqrt(np.median(np.abs(np.linalg.det(lattice)))))
    extent = np.maximum(np.ptp(found.corners_px, axis=0), 1.0)
    design = np.column_stack([np.ones(len(places)), (found.corners_px - found.corners_px.mean(axis=0)) / extent])
    tilt = np.linalg.lstsq(design, -np.log(depth), rcond=None)[0][1:]
    return _Plane(lattice, square_px, np.asarray(tilt, dtype=np.float64))


def _alternating(board: Board, ids: Ids, contrast: FloatArray, good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which corners have the contrast that their place on the board asks for: neighbours have opposite ones."""
    columns = board.grid[0]
    parity = np.where((ids % columns + ids // columns) % 2 == 0, 1.0, -1.0)
    signs = np.sign(contrast) * parity
    return np.asarray(signs == (1.0 if np.median(signs[good]) >= 0 else -1.0))


def _suffice(board: Board, ids: Ids) -> bool:
    """Return whether these corners say something about the lens: enough of them, over three rows and columns."""
    columns = board.grid[0]
    least = min(LEAST_CORNERS, board.corner_count)
    spread = min(len(np.unique(ids % columns)), len(np.unique(ids // columns)))
    return len(ids) >= least and spread >= min(3, *board.grid)


def _partial(board: Board, seen: int) -> str:
    return (
        f"partial: {seen} of the board's {board.corner_count} corners are seen, {LEAST_CORNERS} over three rows and "
        "columns are needed; bring more of the board into the picture"
    )
