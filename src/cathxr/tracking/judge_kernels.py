"""How well a fitted curve agrees with what each view shows, and how sure its tip is. Compiled."""

import math

import numpy as np
from numba import njit

from cathxr.geometry.camera_kernels import project_row
from cathxr.geometry.medians import median_of, smallest_but
from cathxr.tracking.band import forward
from cathxr.tracking.fit_kernels import ROUGH_RADII
from cathxr.tracking.spline import cubic_pieces

INSIDE_SHARE = 0.1
MOST_EXCESS = 16.0
BLUNT_RADII = 0.2
"""Real catheters' ends are blunter, or slimmer than the shaft, by about this: an outline so far off is still theirs."""

_FOLD_RADII, _FOLD_COSINE, _FOLD_STEPS = 1.5, 0.5, 240
"""Over so many radii from its rounded end's centre a catheter keeps its direction to this cosine: a 14F one in a bend
of 10 mm radius turns by 0.2 rad there."""


@njit(cache=True, nogil=True)
def agreement(spans, control, cameras, view, points, ends, off, caps, tolerance, work):  # type: ignore[no-untyped-def]
    """Return (radius, added, away, inside, share, on_cap, excess) of one view; radius < 0: it cannot see the curve.

    spans, control (n, 3): the fitted curve; cameras (V, 21); points, ends: (first, stop) of what the view measured of
    the midline and of the end's outline in `work`; off, caps (E,): see `CurveFit`. radius: median of the half widths.
    added: length, px, of midline that the fitted tube does not explain, the inlet's end apart. away: of the fitted
    cap's centre from the midline. inside: how far, at the tenth worst place, the outline lies outside the tube at
    least. share: of the outline that is the tube's, allowing for a blunt end. on_cap: how many of its points lie on the
    rounded end to `tolerance` px and three sigma. excess: mean square of off / sigma, outliers limited.
    """
    nothing = (-1.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0)
    line, curve = work.line, work.curve
    known = len(line)
    for k in range(known):
        piece, values, _ = cubic_pieces(spans, k / (known - 1))
        x = y = z = 0.0
        for i in range(4):
            x += values[i] * control[piece + i, 0]
            y += values[i] * control[piece + i, 1]
            z += values[i] * control[piece + i, 2]
        u, v, _, _, depth = project_row(x, y, z, cameras[view])
        if depth <= 0.0:
            return nothing
        line[k, 0], line[k, 1] = u, v
    first, stop = points
    for i in range(first, stop):
        work.scratch[i - first] = work.half[i]
    radius = median_of(work.scratch, stop - first)
    squared = radius * radius
    added = 0.0
    unexplained = 0.0
    away = np.inf
    last = -1
    there = 0
    for i in range(first, stop):
        there, shown = _explained(line, curve[i], there, squared)
        if i > first:
            away = min(away, _squared(line[0], curve[i - 1], curve[i]))
            step = math.sqrt((curve[i, 0] - curve[i - 1, 0]) ** 2 + (curve[i, 1] - curve[i - 1, 1]) ** 2)
            unexplained += 0.0 if shown else step
        if shown:
            last = i
            added += unexplained
            unexplained = 0.0
    if last < 0:
        added = np.inf
    begin, end = ends
    count = end - begin
    if count == 0:
        return radius, added, math.sqrt(away), 0.0, 1.0, 0, 1.0
    fitting = 0
    on_cap = 0
    excess = 0.0
    for i in range(begin, end):
        work.scratch[i - begin] = abs(off[i])
    spread = min(1.4826 * median_of(work.scratch, count), ROUGH_RADII * radius)  # as the fit takes it
    outside = work.scratch[:count]
    for i in range(begin, end):
        sigma = work.end_sigma[i]
        outside[i - begin] = off[i] + 3.0 * sigma
        excess += min((off[i] / max(sigma, spread, 1e-9)) ** 2, MOST_EXCESS)
        if abs(off[i]) < 3.0 * sigma + tolerance + BLUNT_RADII * radius:
            fitting += 1
        if abs(off[i]) < 3.0 * sigma + tolerance:
            on_cap += caps[i]
    inside = smallest_but(outside, count, int(INSIDE_SHARE * (count - 1)))
    return radius, added, math.sqrt(away), inside, fitting / count, on_cap, excess / count


@njit(cache=True, nogil=True)
def _explained(line, point, there, squared):  # type: ignore[no-untyped-def]
    """Return (segment, whether one is near): of a line (K, 2), nearer to a point than the root of `squared`.

    It is looked for from the segment `there` on to both sides; which one it is matters to the next search only.
    """
    most = len(line) - 1
    for far in range(most):
        for j in (there + far, there - far):
            if 0 <= j < most and _squared(point, line[j], line[j + 1]) < squared:
                return j, True
    return there, False


@njit(cache=True, nogil=True)
def _squared(point, first, second):  # type: ignore[no-untyped-def]
    """Return the squared distance of a point from the straight line between two others."""
    dx, dy = second[0] - first[0], second[1] - first[1]
    px, py = point[0] - first[0], point[1] - first[1]
    share = min(max((px * dx + py * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
    return (px - share * dx) ** 2 + (py - share * dy) ** 2


@njit(cache=True, nogil=True)
def tip_variance(spans, control, factor, radius, gain):  # type: ignore[no-untyped-def]
    """Return the trace (mm^2) of the covariance of the tip, `radius` mm beyond the curve's beginning.

    factor (3n, 12): see `CurveFit`. gain (3n, 3): room for how the tip moves with the control points.
    """
    _, values, slopes = cubic_pieces(spans, 0.0)
    x = y = z = 0.0
    for k in range(4):
        x += slopes[k] * control[k, 0]
        y += slopes[k] * control[k, 1]
        z += slopes[k] * control[k, 2]
    speed = math.sqrt(x * x + y * y + z * z)
    if not 1e-6 < speed < 1e12:
        return np.inf
    tangent = (x / speed, y / speed, z / speed)
    size = len(factor)
    gain[:size] = 0.0
    for k in range(4):
        for row in range(3):
            for axis in range(3):
                turn = (1.0 if row == axis else 0.0) - tangent[row] * tangent[axis]
                same = values[k] if row == axis else 0.0
                gain[3 * k + axis, row] = same - slopes[k] * radius / speed * turn
    forward(factor, size, gain)
    total = 0.0
    for i in range(size):
        for row in range(3):
            total += gain[i, row] * gain[i, row]
    return total


@njit(cache=True, nogil=True)
def folded_at_tip(spans, control, radius):  # type: ignore[no-untyped-def]
    """Return whether a curve turns back on itself within the rounded end, of `radius` mm: no catheter bends so.

    Both silhouettes of such a curve are those of one without the fold, but its tip points back along the catheter.
    """
    _, values, slopes = cubic_pieces(spans, 0.0)
    x = y = z = dx = dy = dz = 0.0
    for k in range(4):
        x += values[k] * control[k, 0]
        y += values[k] * control[k, 1]
        z += values[k] * control[k, 2]
        dx += slopes[k] * control[k, 0]
        dy += slopes[k] * control[k, 1]
        dz += slopes[k] * control[k, 2]
    for i in range(1, _FOLD_STEPS):
        piece, values, _ = cubic_pieces(spans, i / (_FOLD_STEPS - 1))
        px, py, pz = -x, -y, -z
        for k in range(4):
            px += values[k] * control[piece + k, 0]
            py += values[k] * control[piece + k, 1]
            pz += values[k] * control[piece + k, 2]
        far = math.sqrt(px * px + py * py + pz * pz)
        if far > _FOLD_RADII * radius:
            speed = math.sqrt(dx * dx + dy * dy + dz * dz)
            return not px * dx + py * dy + pz * dz > _FOLD_COSINE * far * speed
    return False
