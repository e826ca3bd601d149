"""The midline's hot loops, compiled: even sampling, smoothing, sections, and the rounded end."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cathxr.core import FloatArray
from cathxr.vision.profiles import cross, edge, sample, settled
from cathxr.vision.raw import EDGE_SHARE, END_CHANGE, look_inside
from cathxr.vision.segmentation import MatteArray

SPACING_PX = 2.5
MOST_POINTS = 160
_WIDEST = 1.45
_NARROWEST = 0.3
_SPREAD = 0.3
_RAYS = 9
END_RAYS = 37
END_REACH_RAD = 3.1
"""The rays go all around the end: behind it they meet the sides of a tube that points at the camera."""
END_FAR = 2.2
"""No outline is looked for farther than this many radii from where the end's centre seems to be."""


@njit(cache=True, nogil=True)
def evenly(points: FloatArray, count: int) -> FloatArray:
    """Return `count` points uniform in arc length along a polyline (N, 2); `geometry.resampled`, compiled."""
    total = len(points)
    along = np.zeros(total)
    for i in range(1, total):
        along[i] = along[i - 1] + math.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    result = np.empty((count, 2))
    j = 0
    for i in range(count):
        wanted = along[-1] * i / (count - 1)
        while j < total - 2 and along[j + 1] < wanted:
            j += 1
        span = along[j + 1] - along[j]
        share = min(max((wanted - along[j]) / span, 0.0), 1.0) if span > 0.0 else 0.0
        for axis in range(2):
            result[i, axis] = points[j, axis] + share * (points[j + 1, axis] - points[j, axis])
    return result


@njit(cache=True, nogil=True)
def smoothed(values: FloatArray, half_window: int) -> FloatArray:
    """Return (N, 2) values after a sliding quadratic fit (Savitzky-Golay), the ends by the outermost fit."""
    result = values.copy()
    smooth(values, len(values), half_window, result)
    return result


@njit(cache=True, nogil=True)
def smooth(values, count, half_window, result):  # type: ignore[no-untyped-def]
    """Fill `result` (N, 2) with the first `count` of values (N, 2), smoothed; see `smoothed`."""
    half = min(half_window, (count - 1) // 2)
    if half < 2:
        result[:count] = values[:count]
        return
    # sums over -half..half of 1, t^2, t^4: the normal equations of a quadratic on an even grid
    s0 = 2.0 * half + 1.0
    s2 = 0.0
    s4 = 0.0
    for k in range(1, half + 1):
        s2 += 2.0 * k * k
        s4 += 2.0 * k**4
    determinant = s0 * s4 - s2 * s2
    for i in range(count):
        centre = min(max(i, half), count - 1 - half)
        t = float(i - centre)
        for axis in range(2):
            v0 = 0.0
            v1 = 0.0
            v2 = 0.0
            for k in range(-half, half + 1):
                value = values[centre + k, axis]
                v0 += value
                v1 += k * value
                v2 += k * k * value
            a = (s4 * v0 - s2 * v2) / determinant
            b = v1 / s2
            c = (s0 * v2 - s2 * v0) / determinant
            result[i, axis] = a + b * t + c * t * t


@njit(cache=True, nogil=True)
def normals_of(points: FloatArray) -> FloatArray:
    """Return unit normals (N, 2): tangents by central differences, turned a quarter from x towards y."""
    result = np.empty((len(points), 2))
    set_normals(points, len(points), result)
    return result


@njit(cache=True, nogil=True)
def set_normals(points, count, result):  # type: ignore[no-untyped-def]
    """Fill `result` (N, 2) with the unit normals of the first `count` of points (N, 2); see `normals_of`."""
    for i in range(count):
        before = max(i - 1, 0)
        after = min(i + 1, count - 1)
        dx = points[after, 0] - points[before, 0]
        dy = points[after, 1] - points[before, 1]
        length = max(math.sqrt(dx * dx + dy * dy), 1e-12)
        result[i, 0] = -dy / length
        result[i, 1] = dx / length


@njit(cache=True, nogil=True)
def good_sections(sections: FloatArray, width: float) -> NDArray[np.bool_]:
    """Return which sections (N, 4) are those of the tube: about as wide as most."""
    widths = sections[:, 1]
    good = (widths > _NARROWEST * width) & (widths < _WIDEST * width)
    if good.any():
        typical = np.median(widths[good])
        good &= np.abs(widths - typical) < _SPREAD * typical
    return good


@njit(cache=True, nogil=True)
def measured_sections(
    matte: MatteArray, path: FloatArray, width: float, plateau: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return measured midline points (N, 2), their normals (N, 2) and sections (N, 4) along a path, entry first.

    Three rounds, coarse to fine: sample evenly, smooth, measure, and move each point to its section's middle. Fewer
    than five good sections give empty arrays.
    """
    points = path
    none = (np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 4)))
    result = none
    for round_ in range(3):
        spacing = 2.0 * SPACING_PX if round_ == 0 else SPACING_PX
        length = 0.0
        for i in range(1, len(points)):
            length += math.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
        count = int(min(max(length / spacing, 6.0), float(MOST_POINTS)))
        points = smoothed(evenly(points, count), max(2, round(1.2 * width / (length / count))))
        normals = normals_of(points)
        sections = np.empty((count, 4))
        for i in range(count):
            sections[i] = cross(matte, points[i, 0], points[i, 1], normals[i, 0], normals[i, 1], width, plateau)
        good = good_sections(sections, width)
        where = np.flatnonzero(good)
        if len(where) < 5:
            return none
        for k in range(len(where)):
            i = where[k]
            points[i, 0] += sections[i, 0] * normals[i, 0]
            points[i, 1] += sections[i, 0] * normals[i, 1]
        result = (points[where], normals[where], sections[where])
        points = points[where[0] : where[-1] + 1].copy()
    return result


@njit(cache=True, nogil=True)
def end_line(points: FloatArray, length: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (position, unit direction, half the bend (2,) 1/px) of the midline (N, 2) at its last point.

    Of a quadratic over the last `length` px; of a straight line, without bend, where there are few points.
    """
    count = len(points)
    along = np.zeros(count)
    first = count - 1
    for i in range(count - 2, -1, -1):
        along[i] = along[i + 1] - math.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
        if along[i] < -length and count - i > 4:
            break
        first = i
    order = 3 if count - first >= 6 else 2
    normal = np.zeros((order, order))
    right = np.zeros((order, 2))
    scale = max(-along[first], 1e-9)
    for i in range(first, count):
        power = np.ones(order)
        for k in range(1, order):
            power[k] = power[k - 1] * along[i] / scale
        for a in range(order):
            for axis in range(2):
                right[a, axis] += power[a] * points[i, axis]
            for b in range(order):
                normal[a, b] += power[a] * power[b]
    fit = np.linalg.solve(normal, right)
    direction = fit[1] / max(math.hypot(fit[1, 0], fit[1, 1]), 1e-12)
    half_bend = fit[2] / (scale * scale) if order == 3 else np.zeros(2)
    return fit[0].copy(), direction, half_bend


@njit(cache=True, nogil=True)
def cap_centre(
    matte: MatteArray, position: FloatArray, direction: FloatArray, radius: float, plateau: float, blur: float
) -> tuple[float, float]:
    """Return (distance, its error) of the rounded end's centre from `position` along `direction`; error < 0: no end.

    The end's circle is met by rays along the axis. Blur pulls the half level of a convex edge of radius R inwards by
    blur^2 / (2 R): undone here.
    """
    apparent = radius - blur * blur / (2.0 * radius)
    level, inside = EDGE_SHARE * plateau, look_inside(2.0 * radius, math.sqrt(2.0 * math.pi) * blur, END_CHANGE)
    centres = np.empty(_RAYS)
    count = 0
    for i in range(_RAYS):
        offset = (1.2 * i / (_RAYS - 1) - 0.6) * radius
        for back in (2.0, 1.0):
            x = position[0] - offset * direction[1] - back * radius * direction[0]
            y = position[1] + offset * direction[0] - back * radius * direction[1]
            found = edge(matte, x, y, direction[0], direction[1], 5.0 * radius, level)
            if found[0] >= 0.0:
                distance, _ = settled(matte, x, y, direction[0], direction[1], found, inside, plateau)
                centres[count] = distance - back * radius - math.sqrt(max(apparent * apparent - offset * offset, 0.0))
                count += 1
                break
    if count < 5:
        return 0.0, -1.0
    # rays that disagree mean that the end is no clean circle: turned towards the camera, or something lies at it
    return float(np.median(centres[:count])), max(float(np.std(centres[:count])), 0.02)


@njit(cache=True, nogil=True)
def end_outline(
    matte: MatteArray, centre: FloatArray, direction: FloatArray, radius: float, plateau: float, blur: float
) -> FloatArray:
    """Return points (N, 2) of the outline around the end's centre, met by rays to the front and to both sides.

    A ray ends at the first fall below half the plateau; rays that meet none near by are left out. The pull of the blur
    on a convex edge (see `cap_centre`) is undone.
    """
    points = np.empty((END_RAYS, 2))
    count = 0
    level, inside = EDGE_SHARE * plateau, look_inside(2.0 * radius, math.sqrt(2.0 * math.pi) * blur, END_CHANGE)
    if sample(matte, centre[0], centre[1]) < level:
        return points[:0]
    for i in range(END_RAYS):
        angle = END_REACH_RAD * (2.0 * i / (END_RAYS - 1) - 1.0)
        c, s = math.cos(angle), math.sin(angle)
        dx = c * direction[0] - s * direction[1]
        dy = s * direction[0] + c * direction[1]
        found = edge(matte, centre[0], centre[1], dx, dy, END_FAR * radius, level)
        if found[0] > 0.3 * radius:
            distance, _ = settled(matte, centre[0], centre[1], dx, dy, found, inside, plateau)
            distance += blur * blur / (2.0 * radius)
            points[count, 0] = centre[0] + distance * dx
            points[count, 1] = centre[1] + distance * dy
            count += 1
    return points[:count].copy()


@njit(cache=True, nogil=True)
def middle_of(values: FloatArray) -> float:
    """Return the median of (N,)."""
    return float(np.median(values))
