"""Debris and bubbles that drift through the box: where they are at an instant, and how they are drawn."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from cathxr.core import FloatArray, Roi
from cathxr.geometry import CameraModel

_EDGE_PX = 1.0


@dataclass(frozen=True, eq=False)
class Clutter:
    """Balls that swing slowly about their places. Each array has one row per ball.

    place, swing (N, 3) mm; pulsation (N, 3) rad/s; phase (N, 3); radius (N,) mm; bubble (N,) 1 or 0; stretch (N,): how
    much longer than broad it looks; lean (N,) rad: which way, at time zero.
    """

    place: FloatArray
    swing: FloatArray
    pulsation: FloatArray
    phase: FloatArray
    radius_mm: FloatArray
    bubble: FloatArray
    stretch: FloatArray
    lean: FloatArray

    @classmethod
    def made(cls, roi: Roi, *, debris: int, bubbles: int, seed: int) -> "Clutter":
        """Return specks (0.15 to 0.9 mm, most of them small) and bubbles (0.6 to 1.8 mm) all over the ROI."""
        rng = np.random.default_rng([seed, 0xDEB215])
        count = debris + bubbles
        bubble = np.concatenate([np.zeros(debris), np.ones(bubbles)])
        small = 0.15 + 0.75 * rng.uniform(size=count) ** 2.5
        fibre = (rng.uniform(size=count) < 0.2) & (bubble == 0)
        stretch = np.where(fibre, rng.uniform(4.0, 12.0, size=count), rng.uniform(1.0, 1.8, size=count))
        return cls(
            place=rng.uniform(roi.min_mm, roi.max_mm, size=(count, 3)),
            swing=rng.uniform(2.0, 15.0, size=(count, 3)),
            pulsation=2.0 * np.pi / rng.uniform(6.0, 25.0, size=(count, 3)),
            phase=rng.uniform(0.0, 2.0 * np.pi, size=(count, 3)),
            radius_mm=np.where(bubble > 0, rng.uniform(0.6, 1.8, size=count), np.where(fibre, 0.15, small)),
            bubble=bubble,
            stretch=np.where(bubble > 0, 1.0, stretch),
            lean=rng.uniform(0.0, np.pi, size=count),
        )

    def seen(self, model: CameraModel, t_s: float) -> FloatArray:
        """Return (N, 6) at an instant: pixel u, v, radius in px, whether it is a bubble, stretch, and lean (rad)."""
        at = self.place + self.swing * np.sin(self.pulsation * t_s + self.phase)
        depth = model.to_camera(at)[:, 2]
        radius_px = self.radius_mm * float(model.intrinsics.focal_px.mean()) / depth
        lean = self.lean + 0.3 * np.sin(self.pulsation[:, 0] * t_s)
        return np.column_stack([model.project(at), radius_px, self.bubble, self.stretch, lean])


@njit(cache=True, nogil=True)
def draw_clutter(balls, shine, passed, added, window):  # type: ignore[no-untyped-def]
    """Darken passed (H, W) and brighten added (H, W, 3) where balls (N, 6) are; widen window (4,) to hold them.

    A speck is opaque. A bubble in water bends the back-light away at its rim and lets it through in the middle, with a
    small reflection of strength `shine` (3,), DN.
    """
    height, width = passed.shape
    for k in range(balls.shape[0]):
        u, v, radius = balls[k, 0], balls[k, 1], balls[k, 2]
        stretch, cosine, sine = balls[k, 4], np.cos(balls[k, 5]), np.sin(balls[k, 5])
        reach = radius * stretch + 2.0 * _EDGE_PX
        left, right = max(0, int(np.floor(u - reach))), min(width, int(np.ceil(u + reach)) + 1)
        top, bottom = max(0, int(np.floor(v - reach))), min(height, int(np.ceil(v + reach)) + 1)
        if left >= right or top >= bottom:
            continue
        window[0], window[1] = min(window[0], left), min(window[1], top)
        window[2], window[3] = max(window[2], right), max(window[3], bottom)
        for row in range(top, bottom):
            for column in range(left, right):
                # A capsule: the distance from its straight middle line.
                along = abs((column - u) * cosine + (row - v) * sine)
                across = (row - v) * cosine - (column - u) * sine
                off = np.sqrt(max(0.0, along - radius * (stretch - 1.0)) ** 2 + across * across)
                cover = 0.5 - 0.5 * np.tanh((off - radius) / (0.6 * _EDGE_PX))
                glint = 0.0
                if balls[k, 3] > 0.0:
                    cover *= 0.25 + 0.7 / (1.0 + np.exp(-(off / radius - 0.6) * 12.0))
                    near = ((column - u + 0.35 * radius) ** 2 + (row - v + 0.35 * radius) ** 2) / (0.2 * radius) ** 2
                    glint = np.exp(-0.5 * near)
                if cover < 2e-3 and glint < 1e-3:
                    continue
                passed[row, column] *= 1.0 - cover
                for c in range(3):
                    added[row, column, c] = added[row, column, c] * (1.0 - cover) + glint * shine[c] + 1e-6
