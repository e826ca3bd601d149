"""A whole silhouette's outline and the tube that makes it: which part makes which point, and what is left. Compiled."""

import math

import numpy as np
from numba import njit

from cathxr.geometry.medians import median_of
from cathxr.tracking.fit_rows import seen
from cathxr.tracking.pair_work import DISCS as PARTS

_HELD_EVERY = 4
_ROOM_PX = 0.5
_LARGEST_PX = 100.0
"""No catheter is seen larger: a fit that has run away may be."""


@njit(cache=True, nogil=True)
def follow_rim(spans, cameras, outline, work):  # type: ignore[no-untyped-def]
    """Set each outline point's parameter `end_at` to that of the ball which makes the outline there; as `follow_end`.

    The whole curve is sampled evenly, and each point looked for between samples.
    """
    end, discs = work.end, work.discs
    last = -1
    for i in range(outline):
        if work.end_view[i] != last:
            last = work.end_view[i]
            set_discs(spans, work.control, cameras, last, work.balls[last], discs)
        work.end_at[i], _ = nearest_disc(discs, work.end[i, 0], end[i, 1])


@njit(cache=True, nogil=True)
def set_rim_widths(spans, cameras, points, outline, radius, work):  # type: ignore[no-untyped-def]
    """Set `balls` of views that give a rim and no midline: to leave as much of the rim inside as outside the tube."""
    for view in range(len(cameras)):
        shown = False
        for i in range(points):
            shown = shown or work.of_view[i] == view
        if shown:
            continue
        set_discs(spans, work.control, cameras, view, work.balls[view], work.discs)
        count, scale = 0, work.discs[0, 2] / work.balls[view]
        for i in range(outline):
            if work.end_view[i] == view:
                _, work.scratch[count] = nearest_disc(work.discs, work.end[i, 0], work.end[i, 1])
                count += 1
        if count > 4:
            wider = median_of(work.scratch, count) / max(scale, 1e-9)
            work.balls[view] = min(max(work.balls[view] + wider, 0.75 * radius), 1.3 * radius)


@njit(cache=True, nogil=True)
def set_discs(spans, control, cameras, view, radius, discs):  # type: ignore[no-untyped-def]
    """Fill the first PARTS of discs (S, 3) with centres and radii, px, of balls along the curve as a view sees them."""
    for k in range(PARTS):
        _, _, _, u, v, by_u, by_v = seen(spans, control, cameras, view, k / (PARTS - 1))
        squared = 0.0
        for axis in range(3):
            squared += by_u[axis] * by_u[axis] + by_v[axis] * by_v[axis]
        discs[k, 0], discs[k, 1], discs[k, 2] = u, v, radius * math.sqrt(0.5 * squared)


@njit(cache=True, nogil=True)
def nearest_disc(discs, x, y):  # type: ignore[no-untyped-def]
    """Return (parameter, distance px outside) of the ball on whose disc a picture's point is, or is nearest to."""
    best, place = np.inf, 0.0
    for k in range(PARTS - 1):
        sx, sy = discs[k + 1, 0] - discs[k, 0], discs[k + 1, 1] - discs[k, 1]
        px, py = x - discs[k, 0], y - discs[k, 1]
        share = min(max((px * sx + py * sy) / max(sx * sx + sy * sy, 1e-12), 0.0), 1.0)
        ox, oy = px - share * sx, py - share * sy
        gap = math.sqrt(ox * ox + oy * oy) - discs[k, 2]
        if gap < best:
            best, place = gap, (k + share) / (PARTS - 1)
    return place, best


KEPT, KEPT_FEWER = (0.95, 0.87), (0.9, 0.79)
"""So much of a rim says how well it is explained; normal noise of one has that RMS without its outermost part."""


@njit(cache=True, nogil=True)
def unexplained(off, sigma, rims, limit, kept=KEPT):  # type: ignore[no-untyped-def]
    """Return (share, longest run, rms px, clean px) of a rim's points that lie off a fitted tube by more than `limit`.

    off (R,) px; sigma (R,); rims: (first, stop) of the view's points in them. rms: of all, each at most `limit` px;
    clean: the standard deviation by all but the worst, of which `kept` says how many they are. Those are the corners
    between two parts of a catheter, which blur and the light from one part on the other fill.
    """
    count, missed, run, longest = rims[1] - rims[0], 0, 0, 0
    amounts = np.empty(count)
    for i in range(rims[0], rims[1]):
        amounts[i - rims[0]] = min(abs(off[i]), limit)
        if abs(off[i]) > limit + 3.0 * sigma[i]:
            missed += 1
            run += 1
            longest = max(longest, run)
        else:
            run = 0
    amounts.sort()
    most = int(kept[0] * count)
    whole = inner = 0.0
    for i in range(count):
        whole += amounts[i] ** 2
        if i < most:
            inner = whole
    clean = math.sqrt(inner / max(most, 1)) / kept[1]
    return missed / max(count, 1), longest, math.sqrt(whole / max(count, 1)), clean


@njit(cache=True, nogil=True)
def invented(discs, rim, sigma, cut, slack):  # type: ignore[no-untyped-def]
    """Return how many of the PARTS discs of a tube stick out of a silhouette by more than `slack` of their radius.

    rim (R, 2), sigma (R,): its closed rings, see `Detection`. Discs nearest to where the inlet cuts it, sigma at least
    `cut`, count for nothing.
    """
    count = 0
    for k in range(PARTS):
        x, y = discs[k, 0], discs[k, 1]
        inside = False
        least, nearest = np.inf, 0
        begun = 0
        for i in range(len(rim)):
            squared = (rim[i, 0] - x) ** 2 + (rim[i, 1] - y) ** 2
            if squared < least:
                least, nearest = squared, i
            if i > begun:
                if (rim[i, 1] > y) != (rim[i - 1, 1] > y):
                    share = (y - rim[i - 1, 1]) / (rim[i, 1] - rim[i - 1, 1])
                    if x < rim[i - 1, 0] + share * (rim[i, 0] - rim[i - 1, 0]):
                        inside = not inside
                if rim[i, 0] == rim[begun, 0] and rim[i, 1] == rim[begun, 1]:
                    begun = i + 1
        if sigma[nearest] >= cut:
            continue
        if not inside or math.sqrt(least) < (1.0 - slack) * discs[k, 2]:
            count += 1
    return count


@njit(cache=True, nogil=True)
def distances(discs, points):  # type: ignore[no-untyped-def]
    """Return how far, px, each of points (N, 2) lies outside a tube's discs."""
    result = np.empty(len(points))
    for i in range(len(points)):
        _, result[i] = nearest_disc(discs, points[i, 0], points[i, 1])
    return result


@njit(cache=True, nogil=True)
def held(discs, rim, sigma, cut, rows):  # type: ignore[no-untyped-def]
    """Fill rows (N, 6) with where parts of a tube can be in a silhouette; return how many.

    Each is the parameter, the middle (x, y) of what is free across the tube, its unit normal (x, y), and how far it is
    free to either side, px. Parts that show at the rim are left out, those with more room than their own width are not
    held by it, and beside the inlet's cut (sigma at least `cut`) nothing is known. discs, rim, sigma: see `invented`.
    """
    count = 0
    shown = np.zeros(PARTS)
    for i in range(len(rim)):
        if sigma[i] < cut:
            at, _ = nearest_disc(discs, rim[i, 0], rim[i, 1])
            shown[int(at * (PARTS - 1))] = 1.0
    for k in range(_HELD_EVERY, PARTS - _HELD_EVERY, _HELD_EVERY):
        if shown[k - _HELD_EVERY : k + _HELD_EVERY].sum() > 0.0:
            continue
        x, y, radius = discs[k, 0], discs[k, 1], discs[k, 2]
        dx, dy = discs[k + 1, 0] - discs[k - 1, 0], discs[k + 1, 1] - discs[k - 1, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length < 1e-3 or not radius < _LARGEST_PX:
            continue
        nx, ny = -dy / length, dx / length
        gap, nearest = _gap(rim, x, y)
        if sigma[nearest] >= cut or gap < 0.5 * radius:
            continue
        left, right = _room(rim, x, y, -nx, -ny, radius), _room(rim, x, y, nx, ny, radius)
        if left + right > 1.5 * radius or count >= len(rows):
            continue
        middle = 0.5 * (right - left)
        rows[count, 0] = k / (PARTS - 1)
        rows[count, 1], rows[count, 2] = x + middle * nx, y + middle * ny
        rows[count, 3], rows[count, 4] = nx, ny
        rows[count, 5] = max(0.5 * (left + right), 0.0)
        count += 1
    return count


@njit(cache=True, nogil=True)
def _room(rim, x, y, dx, dy, radius):  # type: ignore[no-untyped-def]
    """Return how far a disc in a rim can go along the unit (dx, dy), px, until it touches; negative: it sticks out."""
    far = 0.0
    gap, _ = _gap(rim, x, y)
    if gap < radius:
        ahead, _ = _gap(rim, x + dx, y + dy)
        return gap - radius if ahead < gap else radius - gap
    while far < radius:
        gap, _ = _gap(rim, x + (far + _ROOM_PX) * dx, y + (far + _ROOM_PX) * dy)
        if gap < radius:
            break
        far += _ROOM_PX
    return far


@njit(cache=True, nogil=True)
def _gap(rim, x, y):  # type: ignore[no-untyped-def]
    """Return (distance, which) of the point of a rim (R, 2) nearest to (x, y)."""
    least, nearest = np.inf, 0
    for i in range(len(rim)):
        squared = (rim[i, 0] - x) ** 2 + (rim[i, 1] - y) ** 2
        if squared < least:
            least, nearest = squared, i
    return math.sqrt(least), nearest
