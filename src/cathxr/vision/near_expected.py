"""Where the catheter should be seen: the last curves carried on in time and projected. Compiled."""

import math

import numpy as np
from numba import njit

from cathxr.geometry.camera_kernels import project_row
from cathxr.vision.raw import apart

_HIDDEN_RADII = 2.2
"""Nearer than this to another part of the catheter the end's outline is not the end's alone."""
_PARTS_RADII = 6.0
"""What is farther than this along the tube is another part of it."""
_LEAST_GAP_MM = 0.2


@njit(cache=True, nogil=True)
def expect(count, radius_mm, ratio, camera, size, work):  # type: ignore[no-untyped-def]
    """Set line, path, widths and shares of `work` from its shape; return (K, tip u, tip v, alone).

    count: of the shape's points. ratio: apparent width over the expected one. camera (21,): see `packed`; size: width
    and height of its picture. K: points of the path, 0 where the curve leaves the picture or lies behind the camera.
    alone: no other part of the catheter lies at its end.
    """
    used = _from_cap_centre(work.shape, count, radius_mm, work.line)
    tip = work.shape[0]
    tip_u, tip_v, _, _, depth = project_row(tip[0], tip[1], tip[2], camera)
    if depth <= 0.0:
        return 0, 0.0, 0.0, False
    line, path = work.line, work.path
    for i in range(used):
        u, v, by_u, by_v, depth = project_row(line[i, 0], line[i, 1], line[i, 2], camera)
        if depth <= 0.0:
            return 0, 0.0, 0.0, False
        path[i, 0], path[i, 1] = u, v
        squared = 0.0
        for axis in range(3):
            squared += by_u[axis] * by_u[axis] + by_v[axis] * by_v[axis]
        work.widths[i] = math.sqrt(0.5 * squared)  # px per mm, for now
    margin = 1.4 * radius_mm * ratio * work.widths[0]
    width, height = size
    if not (margin <= tip_u <= width - 1.0 - margin and margin <= tip_v <= height - 1.0 - margin):
        return 0, 0.0, 0.0, False
    alone = True
    along_mm = 0.0
    before = 1.0
    reach = _HIDDEN_RADII * radius_mm * ratio * work.widths[0]
    for i in range(used - 1):
        step_mm = _step(line, i)
        step_px = apart(path[i + 1, 0], path[i + 1, 1], path[i, 0], path[i, 1])
        share = step_px / max(step_mm * 0.5 * (work.widths[i] + work.widths[i + 1]), 1e-9)
        work.shares[i] = share if i == 0 else min(share, before)
        before = share
        along_mm += step_mm
        near = apart(path[i + 1, 0], path[i + 1, 1], path[0, 0], path[0, 1]) < reach
        if near and along_mm > _PARTS_RADII * radius_mm:
            alone = False
    work.shares[used - 1] = before
    for i in range(used):
        work.widths[i] *= 2.0 * radius_mm * ratio
    return used, tip_u, tip_v, alone


@njit(cache=True, nogil=True)
def _from_cap_centre(shape, count, radius_mm, line):  # type: ignore[no-untyped-def]
    """Fill `line` with the curve from the rounded end's centre on, one radius behind the tip; return its points."""
    after = count - 1
    before_mm, there_mm = 0.0, 0.0
    for i in range(1, count):
        there_mm = _between(shape, i)
        if there_mm > radius_mm:
            after = i
            break
        if i < count - 1:
            before_mm = there_mm
    share = min(max((radius_mm - before_mm) / max(there_mm - before_mm, 1e-9), 0.0), 1.0)
    squared = 0.0
    for axis in range(3):
        line[0, axis] = shape[after - 1, axis] + share * (shape[after, axis] - shape[after - 1, axis])
        squared += (shape[after, axis] - line[0, axis]) ** 2
    if squared < _LEAST_GAP_MM**2 and count - after > 2:
        after += 1
    for i in range(after, count):
        line[1 + i - after] = shape[i]
    return 1 + count - after


@njit(cache=True, nogil=True)
def _between(shape, i):  # type: ignore[no-untyped-def]
    """Return the distance of point i from the first."""
    return math.sqrt(
        (shape[i, 0] - shape[0, 0]) ** 2 + (shape[i, 1] - shape[0, 1]) ** 2 + (shape[i, 2] - shape[0, 2]) ** 2
    )


@njit(cache=True, nogil=True)
def _step(line, i):  # type: ignore[no-untyped-def]
    """Return the distance of point i from the one after it."""
    return math.sqrt(
        (line[i + 1, 0] - line[i, 0]) ** 2 + (line[i + 1, 1] - line[i, 1]) ** 2 + (line[i + 1, 2] - line[i, 2]) ** 2
    )


@njit(cache=True, nogil=True)
def spread(count, spacing_px, most, work):  # type: ignore[no-untyped-def]
    """Set points, width and share of `work` evenly along its path of `count` points; return (N, spacing px)."""
    along, path = work.along, work.path
    along[0] = 0.0
    for i in range(1, count):
        along[i] = along[i - 1] + apart(path[i, 0], path[i, 1], path[i - 1, 0], path[i - 1, 1])
    total = along[count - 1]
    wanted = int(min(max(total / spacing_px, 6.0), float(most)))
    spacing = max(total / (wanted - 1), 1e-3)
    j = 0
    for i in range(wanted):
        while j < count - 2 and along[j + 1] < spacing * i:
            j += 1
        part = min(max((spacing * i - along[j]) / max(along[j + 1] - along[j], 1e-9), 0.0), 1.0)
        for axis in range(2):
            work.points[i, axis] = path[j, axis] + part * (path[j + 1, axis] - path[j, axis])
        work.width[i] = work.widths[j] + part * (work.widths[j + 1] - work.widths[j])
        work.share[i] = work.shares[j] + part * (work.shares[j + 1] - work.shares[j])
    return wanted, spacing


@njit(cache=True, nogil=True)
def offset_from(path, count, x, y):  # type: ignore[no-untyped-def]
    """Return (dx, dy): how far a point lies off a polyline of `count` points."""
    best = np.inf
    dx = dy = 0.0
    for i in range(count - 1):
        sx, sy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        px, py = x - path[i, 0], y - path[i, 1]
        share = min(max((px * sx + py * sy) / max(sx * sx + sy * sy, 1e-12), 0.0), 1.0)
        ox, oy = px - share * sx, py - share * sy
        if ox * ox + oy * oy < best:
            best = ox * ox + oy * oy
            dx, dy = ox, oy
    return dx, dy
