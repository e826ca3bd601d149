"""The signed distance of every viewing ray from a swept ball: the tube's true outline in perspective. Numba, no GIL.

A ray belongs to the silhouette of a swept ball exactly when it passes some centre at less than the radius. So for each
pixel near the curve this takes the least distance from its ray to the curve, minus the radius: negative inside. Only
the strip of pixels beside each short segment is visited. Rows may see the curve at different instants (rolling
shutter).
"""

import numpy as np
from numba import njit

from cathxr.twin.lens import project_point

FAR = np.float32(1e9)
REACH_PX = 2.6
"""How far outside the outline distances are given."""
_OBLIQUE = 1.15
"""A ball far off the optical axis looks longer than radius times focal length over depth: by less than this."""


@njit(cache=True, nogil=True)
def nodes_at(curves, index, nodes):  # type: ignore[no-untyped-def]
    """Fill nodes (n, 3) with the curve between curves (K, n, 3) at a fractional index, straight between neighbours."""
    low = min(max(int(np.floor(index)), 0), max(curves.shape[0] - 2, 0))
    high = min(low + 1, curves.shape[0] - 1)
    share = index - low
    for i in range(curves.shape[1]):
        for j in range(3):
            nodes[i, j] = curves[low, i, j] + share * (curves[high, i, j] - curves[low, i, j])


@njit(cache=True, nogil=True)
def project_nodes(curves, index, per_row, radius, lens, outline):  # type: ignore[no-untyped-def]
    """Fill outline (n, 3) with each node's pixel u, v and its ball's radius in px, each at its own row's instant.

    index: fractional index into curves (K, n, 3) for row 0; per_row: its increase per row.
    """
    last = curves.shape[0] - 1
    for i in range(curves.shape[1]):
        v = 0.5 * last / per_row if per_row > 0.0 else 0.0
        for _ in range(3 if per_row > 0.0 else 1):
            at = min(max(index + per_row * v, 0.0), float(last))
            low = min(int(at), max(last - 1, 0))
            high = min(low + 1, last)
            share = at - low
            x = curves[low, i, 0] + share * (curves[high, i, 0] - curves[low, i, 0])
            y = curves[low, i, 1] + share * (curves[high, i, 1] - curves[low, i, 1])
            z = max(curves[low, i, 2] + share * (curves[high, i, 2] - curves[low, i, 2]), 1.0)
            u, v = project_point(x, y, z, lens)
        outline[i, 0] = u
        outline[i, 1] = v
        outline[i, 2] = _OBLIQUE * radius * max(lens[0], lens[1]) / z


@njit(cache=True, nogil=True)
def window_of(outline, width, height, window):  # type: ignore[no-untyped-def]
    """Widen window (4,) = left, top, right, bottom (exclusive) to hold the outline's balls and their reach."""
    for i in range(outline.shape[0]):
        reach = outline[i, 2] + REACH_PX + 2.0
        window[0] = min(window[0], max(0, int(np.floor(outline[i, 0] - reach))))
        window[1] = min(window[1], max(0, int(np.floor(outline[i, 1] - reach))))
        window[2] = max(window[2], min(width, int(np.ceil(outline[i, 0] + reach)) + 1))
        window[3] = max(window[3], min(height, int(np.ceil(outline[i, 1] + reach)) + 1))


@njit(cache=True, nogil=True)
def strip(outline, i):  # type: ignore[no-untyped-def]
    """Return segment i's start (u, v), direction (tu, tv), length, overlap at each end and half breadth, px.

    The overlap covers the wedge that a bend opens on its outer side; an end, a sharp turn or a segment that is seen
    end-on gets the whole ball.
    """
    last = outline.shape[0] - 2
    u, v = outline[i, 0], outline[i, 1]
    du, dv = outline[i + 1, 0] - u, outline[i + 1, 1] - v
    length = np.sqrt(du * du + dv * dv)
    breadth = max(outline[i, 2], outline[i + 1, 2]) + REACH_PX
    if length < 1e-6:
        return u, v, 1.0, 0.0, length, breadth, breadth
    tu, tv = du / length, dv / length
    overlap = 1.0
    for other in (i - 1, i + 1):
        if other < 0 or other > last:
            overlap = breadth
            continue
        au, av = outline[other + 1, 0] - outline[other, 0], outline[other + 1, 1] - outline[other, 1]
        size = np.sqrt(au * au + av * av)
        cosine = (au * tu + av * tv) / max(size, 1e-9)
        if cosine < 0.7:
            overlap = breadth
            continue
        overlap = max(overlap, 1.0 + breadth * np.sqrt(max(0.0, 1.0 - cosine * cosine)))
    return u, v, tu, tv, length, min(overlap, breadth), breadth


@njit(cache=True, nogil=True)
def row_span(part, row, width):  # type: ignore[no-untyped-def]
    """Return the first and one past the last column of a row that lie in the strip `part`."""
    u, v, tu, tv, length, overlap, breadth = part
    low, high = 0.0, float(width)
    dv = row - v
    for a, b, least, most in ((tu, tv, -overlap, length + overlap), (-tv, tu, -breadth, breadth)):
        offset = b * dv - a * u
        if abs(a) < 1e-9:
            if offset < least or offset > most:
                return 0, 0
            continue
        first, second = (least - offset) / a, (most - offset) / a
        low, high = max(low, min(first, second)), min(high, max(first, second) + 1.0)
    return int(np.ceil(low)), int(np.floor(high))


@njit(cache=True, nogil=True)
def ray_to_segment(rx, ry, a, e):  # type: ignore[no-untyped-def]
    """Return, at the nearest: distance, depth on the ray, place (0 to 1) on the segment, x and y from it to the ray.

    Ray (rx, ry, 1) from the camera's centre; a (3,): the segment's start, e (3,): its whole extent.
    """
    vv = rx * rx + ry * ry + 1.0
    av = a[0] * rx + a[1] * ry + a[2]
    ev = e[0] * rx + e[1] * ry + e[2]
    ae = a[0] * e[0] + a[1] * e[1] + a[2] * e[2]
    ee = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
    across = ee - ev * ev / vv
    place = 0.0 if across < 1e-12 else min(1.0, max(0.0, -(ae - av * ev / vv) / across))
    depth = (av + place * ev) / vv
    dx = depth * rx - a[0] - place * e[0]
    dy = depth * ry - a[1] - place * e[1]
    dz = depth - a[2] - place * e[2]
    return np.sqrt(dx * dx + dy * dy + dz * dz), depth, place, dx, dy


@njit(cache=True, nogil=True)
def distance_field(curves, index, per_row, radius, outline, rays, blocker, field):  # type: ignore[no-untyped-def]
    """Lower field (H, W, 3) to each ray's distance from the swept ball's surface, mm, negative inside, and its slope.

    The slope is the distance's growth to the right and downwards, mm/px.
    curves (K, n, 3) mm in the camera's frame, seen at `index` + `per_row` times the row; outline from `project_nodes`;
    rays from `lens.ray_table`; blocker (H, W): depth of what hides the tube, mm.
    """
    height, width = field.shape[0], field.shape[1]
    last = curves.shape[0] - 1
    a, e = np.empty(3), np.empty(3)
    for i in range(curves.shape[1] - 1):
        part = strip(outline, i)
        reach = part[5] + part[6]
        top = max(0, int(np.floor(min(part[1], part[1] + part[3] * part[4]) - reach)))
        bottom = min(height, int(np.ceil(max(part[1], part[1] + part[3] * part[4]) + reach)) + 1)
        for row in range(top, bottom):
            left, right = row_span(part, row, width)
            if right <= left:
                continue
            at = min(max(index + per_row * row, 0.0), float(last))
            low = min(int(at), max(last - 1, 0))
            high = min(low + 1, last)
            share = at - low
            for j in range(3):
                a[j] = curves[low, i, j] + share * (curves[high, i, j] - curves[low, i, j])
                e[j] = curves[low, i + 1, j] + share * (curves[high, i + 1, j] - curves[low, i + 1, j]) - a[j]
            for column in range(left, right):
                distance, depth, place, dx, dy = ray_to_segment(rays[row, column, 0], rays[row, column, 1], a, e)
                inside = distance - radius
                if depth > blocker[row, column] or inside >= field[row, column, 0]:
                    continue
                # Growth of the distance per px: with the nearest points held, only the ray's far end moves.
                grow = depth / max(distance, 1e-9)
                near_u, near_v = min(column, width - 2), min(row, height - 2)
                across, down = 0.0, 0.0
                for j, d in ((0, dx), (1, dy)):
                    across += grow * d * (rays[row, near_u + 1, j] - rays[row, near_u, j])
                    down += grow * d * (rays[near_v + 1, column, j] - rays[near_v, column, j])
                # In a pixel on a round end the outline bends away from its tangent: by 1 / (24 radius), all in px.
                if (place == 0.0 and i == 0) or (place == 1.0 and i == curves.shape[1] - 2):
                    inside += (across * across + down * down) / (24.0 * radius)
                field[row, column, 0] = inside
                field[row, column, 1] = across
                field[row, column, 2] = down


@njit(cache=True, nogil=True)
def surface_field(nodes, along, radius, outline, rays, blocker, surface):  # type: ignore[no-untyped-def]
    """Fill surface (H, W, 3) with what is seen of the tube: depth, distance from the axis in radii, place along it.

    nodes (n, 3) mm in the camera's frame; along (n,) mm from the tip. The front-most part wins; just outside the
    outline (for the blurred rim) the nearest. Depth must hold FAR before.
    """
    height, width = surface.shape[0], surface.shape[1]
    e = np.empty(3)
    for i in range(nodes.shape[0] - 1):
        part = strip(outline, i)
        for j in range(3):
            e[j] = nodes[i + 1, j] - nodes[i, j]
        reach = part[5] + part[6]
        top = max(0, int(np.floor(min(part[1], part[1] + part[3] * part[4]) - reach)))
        bottom = min(height, int(np.ceil(max(part[1], part[1] + part[3] * part[4]) + reach)) + 1)
        for row in range(top, bottom):
            left, right = row_span(part, row, width)
            for column in range(left, right):
                distance, depth, place, _, _ = ray_to_segment(rays[row, column, 0], rays[row, column, 1], nodes[i], e)
                if depth > blocker[row, column]:
                    continue
                share = distance / radius
                seen = depth - radius * np.sqrt(1.0 - share * share) if share < 1.0 else 1e5 * share
                if seen < surface[row, column, 0]:
                    surface[row, column, 0] = seen
                    surface[row, column, 1] = min(share, 1.0)
                    surface[row, column, 2] = along[i] + place * (along[i + 1] - along[i])
