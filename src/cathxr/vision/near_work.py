"""The memory that following one catheter in one camera's pictures needs, made once and used for every picture."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cathxr.core import FloatArray
from cathxr.vision.midline_kernels import END_RAYS

MOST_TRACK_POINTS = 200
MOST_POINTS = 110
_PATH = MOST_TRACK_POINTS + 1


class NearWork(NamedTuple):
    """Room for K points of the expected curve, N sections across it, and E points of the end's outline.

    shape (K, 3) mm, the expected curve, tip first; line (K, 3) mm, the same from the rounded end's centre on; path
    (K, 2) px, path_normals (K, 2), widths (K,) px, shares (K,), along (K,): the line as seen.
    points, moved, normals (N, 2), width, share, offsets (N,), sections (N, 4), state, rough (N,): see `sections_near`.
    curve, curve_normal (N + 1, 2), curve_sigma, half_width (N + 1,), outline (E, 2): the measured midline and end.
    scratch: for medians.
    """

    shape: FloatArray
    line: FloatArray
    path: FloatArray
    path_normals: FloatArray
    widths: FloatArray
    shares: FloatArray
    along: FloatArray
    points: FloatArray
    moved: FloatArray
    normals: FloatArray
    width: FloatArray
    share: FloatArray
    offsets: FloatArray
    sections: FloatArray
    state: NDArray[np.int64]
    rough: NDArray[np.int64]
    curve: FloatArray
    curve_normal: FloatArray
    curve_sigma: FloatArray
    half_width: FloatArray
    outline: FloatArray
    scratch: FloatArray


def near_work() -> NearWork:
    """Return fresh room."""
    return NearWork(
        shape=np.zeros((_PATH, 3)),
        line=np.zeros((_PATH, 3)),
        path=np.zeros((_PATH, 2)),
        path_normals=np.zeros((_PATH, 2)),
        widths=np.zeros(_PATH),
        shares=np.zeros(_PATH),
        along=np.zeros(_PATH),
        points=np.zeros((MOST_POINTS, 2)),
        moved=np.zeros((MOST_POINTS, 2)),
        normals=np.zeros((MOST_POINTS, 2)),
        width=np.zeros(MOST_POINTS),
        share=np.zeros(MOST_POINTS),
        offsets=np.zeros(MOST_POINTS),
        sections=np.zeros((MOST_POINTS, 4)),
        state=np.zeros(MOST_POINTS, dtype=np.int64),
        rough=np.zeros(MOST_POINTS, dtype=np.int64),
        curve=np.zeros((MOST_POINTS + 1, 2)),
        curve_normal=np.zeros((MOST_POINTS + 1, 2)),
        curve_sigma=np.zeros(MOST_POINTS + 1),
        half_width=np.zeros(MOST_POINTS + 1),
        outline=np.zeros((END_RAYS, 2)),
        scratch=np.zeros(2 * _PATH),
    )
