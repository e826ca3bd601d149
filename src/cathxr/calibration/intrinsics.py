"""A camera's lens from views of a board: the values, what they are good for, and which views were of no use."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.calibration.board import Board
from cathxr.calibration.board_finding import Ids
from cathxr.calibration.board_views import BoardView, RejectedView, screened
from cathxr.calibration.intrinsics_fit import LENS, BoardCorners, LensFit, fit_lens
from cathxr.calibration.intrinsics_start import first_lens
from cathxr.core import CalibrationError, FloatArray, Intrinsics, Pose, Provenance
from cathxr.geometry.pose import pose_from_vector

LEAST_VIEWS = 5
"""Fewer views leave no way to tell a bad one from the others."""
WANTED_VIEWS = 15

_OUTLIER = 3.0
_OUTLIER_PX = 0.05
"""A view fits badly when its residuals are this many times those of the others, and at least so large."""
_OUTLIER_ALIKE_PX = 1.5
"""The same where all views count alike, as in OpenCV: corners found with a fixed window are off by up to a pixel where
the window meets other corners, and only what is worse than that is wrong."""
_MOST_RMS_PX = 2.0
_MOST_FOCAL_SHARE = 0.02
"""Above 2 % the focal length is not measured: 2 % at 330 mm is 6.6 mm of depth."""
_DISTORTION_AT_CORNER = np.array([0.5, 0.2, 0.02, 0.02, 0.05])
"""Standard deviation of what k1 r^2, k2 r^4, p1 r, p2 r and k3 r^6 come to at the picture's corner, for lenses of any
kind. Views that reach into the corners know them a hundred times better; where they do not, a coefficient stays near 0
instead of growing wild, and its uncertainty is this and counted."""
_HELD = 0.5
"""A coefficient known hardly better than beforehand (this share of it) is named as held."""
_NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")


@dataclass(frozen=True, eq=False)
class ViewResult:
    """One view that was used. corners_px (N, 2): found; residual_px (N, 2): found minus computed; ids (N,)."""

    name: str
    rms_px: float
    residual_px: FloatArray
    camera_from_board: Pose
    corners_px: FloatArray
    ids: Ids


@dataclass(frozen=True, eq=False)
class IntrinsicsResult:
    """A lens with its errors (in its provenance), the views it comes from, and those that were rejected.

    warnings: sentences about what limits the result and what would make it better. noise_px: standard deviation of one
    coordinate of a corner. inflation: by how much variances were raised for errors that corners of a view share.
    """

    intrinsics: Intrinsics
    views: tuple[ViewResult, ...]
    rejected: tuple[RejectedView, ...]
    size_px: tuple[int, int]
    board: Board
    warnings: tuple[str, ...] = ()
    noise_px: float = 0.0
    inflation: float = 1.0

    @property
    def verdict(self) -> str:
        """One sentence: whether the result is good, or what would make it better."""
        if self.warnings:
            return self.warnings[0]
        focal, std = self.intrinsics.focal_px, self.intrinsics.provenance.std["focal_px"]
        share = 100.0 * float((std / focal).max())
        return f"Good: the focal length is known to {share:.2g} %, and the views agree with the lens model."


def calibrate_intrinsics(
    board: Board,
    views: Sequence[BoardView],
    *,
    size_px: tuple[int, int],
    date: str,
    start: Intrinsics | None = None,
    rejected: Sequence[RejectedView] = (),
    keep_all: bool = False,
    alike: bool = False,
    note: str = "",
) -> IntrinsicsResult:
    """Return the lens that explains the views, with honest standard deviations and a covariance.

    date: ISO date for the provenance. start: tried as a start beside OpenCV's own. rejected: those that `find_board`
    refused, for the record. keep_all: reject no view for its blur, likeness or residuals and let all count alike.
    alike: let all views count alike, as OpenCV does, and call only those outliers that are more than 1.5 px off.
    note: added to the method that the provenance states.

    Raises:
        CalibrationError: too few views, all views alike, or corners that do not lie as on the board; says what to do.
    """
    kept, refused = (tuple(views), ()) if keep_all else screened(views, size_px=size_px)
    wrong = [view.name for view in kept if view.size_px != size_px]
    if wrong:
        raise CalibrationError(f"{wrong[0]}: expected a picture of {size_px[0]}x{size_px[1]} px, the camera's size.")
    turned_down = [*rejected, *refused]
    _enough(kept, turned_down)
    corners = {view.name: BoardCorners(board.corners_mm[view.ids], view.corners_px) for view in kept}
    used, fit, outliers = _fitted(kept, corners, size_px, start, keep_all=keep_all, alike=alike)
    turned_down += outliers
    _enough(used, turned_down)
    _believable(board, used, fit)
    _determined(fit)
    intrinsics = _intrinsics(board, used, fit, size_px=size_px, date=date, note=note)
    results = tuple(
        ViewResult(view.name, float(rms), residual, pose_from_vector(pose), view.corners_px, view.ids)
        for view, rms, residual, pose in zip(used, fit.view_rms_px, fit.residuals_px, fit.poses, strict=True)
    )
    warnings = _warnings(fit, len(used), size_px, used)
    return IntrinsicsResult(
        intrinsics, results, tuple(turned_down), size_px, board, warnings, fit.noise_px, fit.inflation
    )


def prior_std(focal_px: float, size_px: tuple[int, int]) -> FloatArray:
    """Return what is known of a lens (9,) beforehand: nothing but that its distortion stays within reason."""
    reach = 0.5 * float(np.hypot(*size_px)) / focal_px
    powers = reach ** np.array([2.0, 4.0, 1.0, 1.0, 6.0])
    return np.concatenate([np.full(4, np.inf), _DISTORTION_AT_CORNER / powers])


def _fitted(
    views: Sequence[BoardView],
    corners: dict[str, BoardCorners],
    size_px: tuple[int, int],
    start: Intrinsics | None,
    *,
    keep_all: bool,
    alike: bool,
) -> tuple[tuple[BoardView, ...], LensFit, list[RejectedView]]:
    """Return the views that agree, their fit, and the views that do not fit with the others."""
    used, outliers = tuple(views), list[RejectedView]()
    first = first_lens([corners[view.name] for view in used], size_px, start)
    if first is None:
        raise CalibrationError(
            "No lens explains the corners found: check that --board describes the board in the pictures (columns, rows)"
            ", that the board is flat, and that it is tilted in different ways."
        )
    lens, poses = first
    while True:
        prior = prior_std(float(lens[:2].mean()), size_px)
        robust = not (keep_all or alike)
        fit = fit_lens([corners[view.name] for view in used], lens, poses, prior_std=prior, robust=robust)
        rms = fit.view_rms_px
        limit = max(_OUTLIER * float(np.median(rms)), _OUTLIER_ALIKE_PX if alike else _OUTLIER_PX)
        worst = int(np.argmax(rms))
        if keep_all or rms[worst] <= limit or len(used) <= LEAST_VIEWS:
            return used, fit, outliers
        usual = float(np.median(rms))
        reason = (
            f"outlier: its corners are {rms[worst]:.2f} px from where the lens puts them, the others' {usual:.2f} px "
            "(a bent board, motion, or something in front of it)"
        )
        outliers.append(RejectedView(used[worst].name, reason))
        lens, poses = fit.lens, np.delete(fit.poses, worst, axis=0)
        used = (*used[:worst], *used[worst + 1 :])


def _enough(views: Sequence[BoardView], rejected: Sequence[RejectedView]) -> None:
    if len(views) >= LEAST_VIEWS:
        return
    first: dict[str, list[str]] = {}
    for each in rejected:
        first.setdefault(each.reason, []).append(each.name)
    whose = {why: f"{names[0]} and {len(names) - 1} more" if names[1:] else names[0] for why, names in first.items()}
    said = "".join(f"; {whose[why]}: {why}" for why in list(first)[:3])
    more = f"; and {len(first) - 3} other reasons" if len(first) > 3 else ""
    raise CalibrationError(
        f"Too few views of the board: {len(views)} can be used, at least {LEAST_VIEWS} are needed and "
        f"{WANTED_VIEWS} are good; take more pictures with the board in other places and tilts{said}{more}."
    )


def _believable(board: Board, views: Sequence[BoardView], fit: LensFit) -> None:
    square_px = float(np.median([view.square_px for view in views])) or 20.0
    limit = min(_MOST_RMS_PX, max(0.08 * square_px, 0.5))
    if fit.rms_px > limit:
        raise CalibrationError(
            f"The corners do not lie as on a board {board.text}: they are {fit.rms_px:.1f} px from any fit; check "
            "columns and rows (ChArUco: squares, chessboard: inner corners), that the squares are square (printed at "
            "100 %), and that the board is flat."
        )


def _determined(fit: LensFit) -> None:
    focal = fit.lens[:2]
    std = np.sqrt(np.diag(fit.covariance)[:2])
    if not (std < _MOST_FOCAL_SHARE * focal).all():
        worst = int(np.argmax(std / focal))
        raise CalibrationError(
            f"The views do not determine the focal length ({focal[worst]:.0f} ± {std[worst]:.0f} px): they are too "
            "much alike; tilt the board by 20 to 45 degrees, to the left and right, forwards and backwards, and bring "
            "it near enough to fill half of the picture."
        )


def _intrinsics(
    board: Board, views: Sequence[BoardView], fit: LensFit, *, size_px: tuple[int, int], date: str, note: str
) -> Intrinsics:
    std = np.sqrt(np.diag(fit.covariance))
    held = _held(fit, size_px)
    count = sum(len(view.ids) for view in views)
    said = f"{board.text}, {count} corners in {len(views)} views, OpenCV's lens model k1 k2 p1 p2 k3"
    if note:
        said += f", {note}"
    if held:
        said += f", {' '.join(held)} held near 0 (the views do not determine it)"
    if fit.inflation > 1.2:
        said += f", std raised by {np.sqrt(fit.inflation):.1f} for errors that corners of a view share"
    provenance = Provenance(
        std={"focal_px": std[:2], "centre_px": std[2:4], "distortion": std[4:]},
        covariance=fit.covariance,
        rms_px=fit.rms_px,
        n=len(views),
        date=date,
        method=said,
    )
    return Intrinsics(fit.lens[:2], fit.lens[2:4], fit.lens[4:], provenance)


def _held(fit: LensFit, size_px: tuple[int, int]) -> list[str]:
    """Return the names of the coefficients that the views say hardly anything about."""
    prior = prior_std(float(fit.lens[:2].mean()), size_px)
    std = np.sqrt(np.diag(fit.covariance) / fit.inflation)
    return [_NAMES[i] for i in range(4, LENS) if std[i] > _HELD * prior[i]]


def _warnings(fit: LensFit, count: int, size_px: tuple[int, int], views: Sequence[BoardView]) -> tuple[str, ...]:
    """Return sentences about what limits the result, the weightiest first."""
    result = []
    focal, std = fit.lens[:2], np.sqrt(np.diag(fit.covariance)[:2])
    share = float((std / focal).max())
    if share > 0.003:
        result.append(
            f"The focal length is known to {100 * share:.2g} % only (0.3 % or better is good): add views tilted by 20 "
            "to 45 degrees in all directions."
        )
    if abs(focal[0] / focal[1] - 1.0) > max(0.015, 4.0 * share):
        result.append(
            f"fx and fy differ by {100 * abs(focal[0] / focal[1] - 1.0):.1f} %: the board's squares may not be square; "
            "print it at 100 % and measure both directions."
        )
    if held := _held(fit, size_px):
        result.append(
            f"{' '.join(held)} cannot be told from these views and stays near 0: show the board in the picture's "
            "corners."
        )
    if count < 10:
        result.append(f"{count} views are few; {WANTED_VIEWS} give a better lens and a safer error.")
    if (reached := reached_share(views, size_px)) < 0.75:
        result.append(
            f"The views reach only {100 * reached:.0f} % of the way to the picture's corners; the lens is less sure "
            "outside: show the board nearer to the corners."
        )
    return tuple(result)


def reached_share(views: Sequence[BoardView], size_px: tuple[int, int]) -> float:
    """Return how far from the picture's centre corners were seen (their 98th percentile), as a share of the way out."""
    if not views:
        return 0.0
    centre = 0.5 * (np.array(size_px) - 1.0)
    away = np.linalg.norm(np.concatenate([view.corners_px for view in views]) - centre, axis=1)
    return float(np.percentile(away, 98) / np.linalg.norm(centre))
