"""The outline of the whole silhouette: where a catheter lies over itself its midline says too little."""

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit

from cathxr.core import FloatArray, PixelArray
from cathxr.vision.profiles import edge, sample, settled
from cathxr.vision.raw import END_CHANGE, look_inside
from cathxr.vision.segmentation import MatteArray, Window

SPACING_PX = 2.0
CUT_PX = 1000.0
"""The sigma of a point that only closes a ring: where the inlet cuts the silhouette, no edge is seen."""
_REACH_PX = 3.0
_LEAST_SIGMA_PX = 0.08
_LEAST_RING_PX = 10.0
_EDGE_SHARE = 0.35
"""A silhouette's edge is looked for at this share of its darkness; see `settled`. A lit side is no gap in it."""
_STEEP = 3
"""The blur is taken from this quartile of a ring's edges, by how steep they are."""
_INLET_POINTS = 5
"""So many first points of the axis, a millimetre apart, may be the inlet's: its outline is no catheter's."""
_HELD_WIDTHS = 1.5
"""A silhouette farther than this from the inlet's axis, where the catheter begins, is something else."""


@dataclass(frozen=True, eq=False)
class Rim:
    """Closed rings of points (R, 2) px one after the other, each ending with its first again; sigmas (R,) px."""

    points: FloatArray
    sigma: FloatArray


def rim_of(
    matte: MatteArray, mask: PixelArray, step: int, window: Window, plateau: float, axis: FloatArray, width: float
) -> Rim | None:
    """Return the outline of what lies at the inlet's axis, in the picture's pixels, None where there is nothing.

    matte: of the window; mask, step: the coarse candidates; plateau: the matte's level on the catheter; axis (N, 2) px:
    the inlet's axis in the picture, from the inlet on; width px: the catheter's.
    """
    level = _EDGE_SHARE * plateau
    body = _body(matte, mask, step, window, level, axis, width)
    if body is None:
        return None
    contours, _ = cv2.findContours(body, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    soft = cv2.GaussianBlur(matte, (0, 0), 1.0)
    slopes = np.stack([cv2.Sobel(soft, cv2.CV_32F, 1, 0), cv2.Sobel(soft, cv2.CV_32F, 0, 1)])
    points, sigmas = [], []
    for each in contours:
        if len(each) < _LEAST_RING_PX:
            continue
        ring = np.asarray(each[:, 0, :], dtype=np.float64)[:: round(SPACING_PX)]
        ring, sigma = refined(matte, slopes, np.ascontiguousarray(ring), plateau, width)
        points.append(np.vstack([ring, ring[:1]]))
        sigmas.append(np.concatenate([sigma, [CUT_PX]]))
    if not points:
        return None
    rim = np.vstack(points) + np.array([window.x0, window.y0], dtype=np.float64)
    ahead = axis[-1] - axis[0]
    behind = (rim - axis[min(_INLET_POINTS, len(axis) - 1)]) @ ahead < 0.0
    return Rim(rim, np.where(behind, CUT_PX, np.concatenate(sigmas)))


def _body(
    matte: MatteArray, mask: PixelArray, step: int, window: Window, level: float, axis: FloatArray, width: float
) -> PixelArray | None:
    """Return 1 where the catheter is in the window: the largest connected candidate that begins at the inlet."""
    near = cv2.dilate(mask, np.ones((3, 3), dtype=np.uint8))
    columns = np.minimum(np.arange(window.x0, window.x1) // step, mask.shape[1] - 1)
    rows = np.minimum(np.arange(window.y0, window.y1) // step, mask.shape[0] - 1)
    fine = ((matte > level) & (near[rows][:, columns] > 0)).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(fine, connectivity=4)
    local = np.round(axis - (window.x0, window.y0)).astype(np.int64)
    best, most = 0, 0
    for shift in np.arange(-_HELD_WIDTHS, _HELD_WIDTHS + 0.1, 0.5) * width:
        for across in ((0.0, shift), (shift, 0.0)):
            at = local + np.round(across).astype(np.int64)
            inside = (at >= 0).all(axis=1) & (at[:, 0] < fine.shape[1]) & (at[:, 1] < fine.shape[0])
            for label in np.unique(labels[at[inside, 1], at[inside, 0]]):
                if label > 0 and stats[label, cv2.CC_STAT_AREA] > most:
                    best, most = int(label), int(stats[label, cv2.CC_STAT_AREA])
    if most < 2.0 * width * width:
        return None
    return np.asarray(labels == best, dtype=np.uint8)


@njit(cache=True, nogil=True)
def refined(matte, slopes, ring, plateau, width):  # type: ignore[no-untyped-def]
    """Return a ring's points (N, 2) moved to the edge of the matte, and their sigmas (N,).

    slopes (2, h, w): of the smoothed matte; plateau, width: the catheter's. A point without an edge close by stays
    where it is, with CUT_PX.
    """
    result = ring.copy()
    sigma = np.full(len(ring), CUT_PX)
    level = _EDGE_SHARE * plateau
    where = np.zeros(len(ring), dtype=np.int64)
    starts, fars, falls = np.zeros((len(ring), 4)), np.zeros(len(ring)), np.zeros(len(ring))
    count = 0
    for i in range(len(ring)):
        x, y = ring[i, 0], ring[i, 1]
        gx, gy = slopes[0, int(y), int(x)], slopes[1, int(y), int(x)]
        length = (gx * gx + gy * gy) ** 0.5
        if not length > 1e-6:
            continue
        dx, dy = -gx / length, -gy / length
        x, y = x - _REACH_PX * dx, y - _REACH_PX * dy
        if sample(matte, x, y) < level:
            x, y = x + 0.6 * _REACH_PX * dx, y + 0.6 * _REACH_PX * dy
            if sample(matte, x, y) < level:
                continue
        found = edge(matte, x, y, dx, dy, 2.0 * _REACH_PX, level)
        if found[0] < 0.0:
            continue
        where[count] = i
        starts[count, 0], starts[count, 1], starts[count, 2], starts[count, 3] = x, y, dx, dy
        fars[count], falls[count] = found
        count += 1
    if count == 0:
        return result, sigma
    # steep edges are those of the tube's usual darkness, and tell the blur
    inside = look_inside(width, plateau / np.sort(falls[:count])[(_STEEP * count) // 4], END_CHANGE)
    for k in range(count):
        x, y, dx, dy = starts[k, 0], starts[k, 1], starts[k, 2], starts[k, 3]
        far, _ = settled(matte, x, y, dx, dy, (fars[k], falls[k]), inside, plateau)
        i = where[k]
        result[i, 0], result[i, 1] = x + far * dx, y + far * dy
        sigma[i] = _LEAST_SIGMA_PX
    return result, sigma
