"""A view, or a row of one, seen earlier or later than its pair: its measurements moved to the pair's instant. Compiled.

The curve's own motion says how: each measured point moves as the curve's point at the same arc fraction does.
"""

import math

from numba import njit

from cathxr.geometry.camera_kernels import project_row

SKEW_NS = 50_000
"""Nearer in time than this two pictures are taken at one instant: the quickest hand moves less than 0.01 mm."""
_FARTHEST_MM = 5.0
_FASTEST_MM_S = 400.0


@njit(cache=True, nogil=True)
def at_instant(seen, last, before, times, result):  # type: ignore[no-untyped-def]
    """Fill `result` (K, 3) mm with a curve at time 0: by the parabola through what one view says at three instants.

    seen, last, before (K, 3) mm; times: s, of each; 0 for `last` or `before` that are not known. One view's own curves
    are taken, not the pairs': an error of one correction would go into the next. No point moves by more than a quick
    hand would move it.
    """
    now, then, earlier = times
    for i in range(len(seen)):
        squared = 0.0
        for axis in range(3):
            move = 0.0
            if then < 0.0:
                slope = (seen[i, axis] - last[i, axis]) / (now - then)
                move = -now * slope
                if earlier < then:
                    slower = (last[i, axis] - before[i, axis]) / (then - earlier)
                    move += now * then * (slope - slower) / (now - earlier)
            result[i, axis] = move
            squared += move * move
        limit = min(1.0, _FARTHEST_MM / max(math.sqrt(squared), 1e-9))
        for axis in range(3):
            result[i, axis] = seen[i, axis] + limit * result[i, axis]


@njit(cache=True, nogil=True)
def motion(curve, last, before, times, result):  # type: ignore[no-untyped-def]
    """Fill `result` (K, 3) mm/s with a curve's velocity at time 0: of the parabola through three instants.

    curve, last, before (K, 3) mm; times: s, of the latter two, negative; 0 for what is not known. No point is quicker
    than a hand.
    """
    then, earlier = times
    for i in range(len(curve)):
        squared = 0.0
        for axis in range(3):
            slope = 0.0
            if then < 0.0:
                slope = (last[i, axis] - curve[i, axis]) / then
                if earlier < then:
                    slope -= then * ((last[i, axis] - before[i, axis]) / (then - earlier) - slope) / earlier
            result[i, axis] = slope
            squared += slope * slope
        limit = min(1.0, _FASTEST_MM_S / max(math.sqrt(squared), 1e-9))
        for axis in range(3):
            result[i, axis] *= limit


@njit(cache=True, nogil=True)
def shift_view(camera, moved, speed, rows, there, points, ends, work):  # type: ignore[no-untyped-def]
    """Move one view's measured points of `work`, in place, from the view's instant, and their row's, to the pair's.

    there (K, 3) mm: the curve at the view's instant, the rounded end's centre first; moved (K, 3) mm: by how much it
    has moved since the pair's; speed (K, 3) mm/s: how it moves meanwhile. rows: (the row of the view's instant, s from
    each row to the next, 0 for a global shutter). points, ends: (first, stop) of the view's midline points and of its
    end's outline; `at` says where on the curve the former are, and who has no place goes with the point before.
    camera (21,): see `packed`.
    """
    count = len(there)
    shift, line = work.discs, work.line
    middle, row_s = rows
    for j in range(count):
        x, y, z = there[j, 0], there[j, 1], there[j, 2]
        line[j, 0], line[j, 1], _, _, _ = project_row(x, y, z, camera)
        late = row_s * (line[j, 1] - middle)
        if late != 0.0:  # where the curve was when its row was open, to first order
            line[j, 0], line[j, 1], _, _, _ = project_row(
                x + late * speed[j, 0], y + late * speed[j, 1], z + late * speed[j, 2], camera
            )
        u, v, _, _, _ = project_row(x - moved[j, 0], y - moved[j, 1], z - moved[j, 2], camera)
        shift[j, 0], shift[j, 1] = u - line[j, 0], v - line[j, 1]
    place = 0.0
    for i in range(points[0], points[1]):
        if work.at[i] >= 0.0:
            place = min(work.at[i], 1.0) * (count - 1)
        j = min(int(place), count - 2)
        for axis in range(2):
            work.curve[i, axis] += shift[j, axis] + (place - j) * (shift[j + 1, axis] - shift[j, axis])
    for i in range(ends[0], ends[1]):
        best, least = 0, math.inf
        for j in range(count):
            squared = (work.end[i, 0] - line[j, 0]) ** 2 + (work.end[i, 1] - line[j, 1]) ** 2
            if squared < least:
                best, least = j, squared
        work.end[i, 0] += shift[best, 0]
        work.end[i, 1] += shift[best, 1]
