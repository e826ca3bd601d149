"""What both views measured, side by side as compiled code takes it, and the memory that fitting needs: made once."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cathxr.core import Detection, FloatArray

MOST_CONTROLS = 31
BAND = 12
"""Twelve unknowns, three of each of four control points, meet in one measurement."""
SAMPLES = 72
LINE_POINTS = 100


class FitWork(NamedTuple):
    """Room for M midline points and E points of the ends' outlines of all V views together, tip first, view by view.

    of_view (M,): which view each belongs to; curve, normal (M, 2), sigma, half (M,): see `Detection`; at (M,): the
    parameter of each point's foot on the curve, negative for one without a part. end_view, end (E, 2), end_sigma
    (E,), end_at (E,) likewise; end_off (E,): see `CurveFit`. along (V, 2): unit, ahead at the tip; along_sigma (V,).
    outlined (V,): whether the outline says where the end is. balls (V,): radius of the tube as each view shows it, mm.
    pieces, residuals, sigmas (R,), design (R, 12): the rows of the least squares. control (n, 3); band (3n, 12), right,
    gain (3n, ...): the normal equations; prior (n, 4). line (K, 2), discs (S, 3), scratch: for one thing at a time.
    """

    of_view: NDArray[np.int64]
    curve: FloatArray
    normal: FloatArray
    sigma: FloatArray
    half: FloatArray
    at: FloatArray
    end_view: NDArray[np.int64]
    end: FloatArray
    end_sigma: FloatArray
    end_at: FloatArray
    end_off: FloatArray
    along: FloatArray
    along_sigma: FloatArray
    outlined: NDArray[np.bool_]
    balls: FloatArray
    pieces: NDArray[np.int64]
    design: FloatArray
    residuals: FloatArray
    sigmas: FloatArray
    control: FloatArray
    band: FloatArray
    right: FloatArray
    gain: FloatArray
    prior: FloatArray
    line: FloatArray
    discs: FloatArray
    scratch: FloatArray


def fit_work(points: int, outline: int, views: int) -> FitWork:
    """Return fresh room for so many midline points, outline points and views."""
    rows = points + outline + 2 * views
    return FitWork(
        of_view=np.zeros(points, dtype=np.int64),
        curve=np.zeros((points, 2)),
        normal=np.zeros((points, 2)),
        sigma=np.zeros(points),
        half=np.zeros(points),
        at=np.zeros(points),
        end_view=np.zeros(outline, dtype=np.int64),
        end=np.zeros((outline, 2)),
        end_sigma=np.zeros(outline),
        end_at=np.zeros(outline),
        end_off=np.zeros(outline),
        along=np.zeros((views, 2)),
        along_sigma=np.zeros(views),
        outlined=np.zeros(views, dtype=np.bool_),
        balls=np.zeros(views),
        pieces=np.zeros(rows, dtype=np.int64),
        design=np.zeros((rows, BAND)),
        residuals=np.zeros(rows),
        sigmas=np.zeros(rows),
        control=np.zeros((MOST_CONTROLS, 3)),
        band=np.zeros((3 * MOST_CONTROLS, BAND)),
        right=np.zeros((3 * MOST_CONTROLS, 1)),
        gain=np.zeros((3 * MOST_CONTROLS, 3)),
        prior=np.zeros((MOST_CONTROLS, 4)),
        line=np.zeros((LINE_POINTS, 2)),
        discs=np.zeros((max(SAMPLES, LINE_POINTS), 3)),
        scratch=np.zeros(max(rows, SAMPLES)),
    )


LEAST_OUTLINE = 7
"""Fewer points of the end's outline than this do not say where it is."""


class PairWork:
    """One pair's measurements in arrays that the next pair uses again; they grow where a pair needs more."""

    def __init__(self) -> None:
        self.arrays = fit_work(360, 96, 2)
        self.points = self.outline = 0

    def take(self, detections: Sequence[Detection]) -> None:
        """Put two or more views' measurements side by side."""
        self.points = sum(len(each.curve_px) for each in detections)
        self.outline = sum(len(each.end_px) for each in detections)
        room = self.arrays
        if self.points > len(room.of_view) or self.outline > len(room.end) or len(detections) != len(room.balls):
            self.arrays = room = fit_work(2 * self.points, 2 * self.outline + 1, len(detections))
        first = first_end = 0
        for view, each in enumerate(detections):
            part, end = slice(first, first + len(each.curve_px)), slice(first_end, first_end + len(each.end_px))
            first, first_end = part.stop, end.stop
            room.of_view[part] = view
            room.curve[part] = each.curve_px
            room.normal[part] = each.normal_px
            room.sigma[part] = each.sigma_px
            room.half[part] = each.half_width_px
            room.end_view[end] = view
            room.end[end] = each.end_px
            room.end_sigma[end] = each.end_sigma_px
            room.outlined[view] = len(each.end_px) >= LEAST_OUTLINE
            assert each.tip_px is not None
            assert each.tip_sigma_px is not None
            ahead = each.tip_px - each.curve_px[0]
            room.along[view] = ahead / max(float(np.sqrt(ahead @ ahead)), 1e-9)
            room.along_sigma[view] = each.tip_sigma_px
