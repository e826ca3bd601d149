"""How much of what the cameras see through the ROI lies before the lit diffuser."""

from dataclasses import dataclass, replace

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.layout import INLET_SIDE_MM, Layout

_GRID = 40
MOST_RIPPLE = 0.05
"""How much of the diffuser's light may come and go from row to row of LEDs."""


@dataclass(frozen=True)
class Lit:
    """Shares of view rays that end on the diffuser, 0 to 1: the worse of both cameras.

    of_places: of the rays to places that fill the ROI evenly, which is what a catheter anywhere in it needs.
    of_picture: of the rays that fill the ROI's picture evenly. without_inlet: of_places, with the inlet block left out.
    """

    of_places: float
    of_picture: float
    without_inlet: float


def lit(layout: Layout, *, grid: int = _GRID) -> Lit:
    """Return the lit shares, from grid**3 places and grid**2 rays."""
    side = (np.arange(grid) + 0.5) / grid * 2.0 * layout.half_mm - layout.half_mm
    places = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    # Rays that meet the ROI are those through its face nearest to the camera.
    near = places[np.isclose(places[:, 2], side[-1])] * (1.0, 1.0, 0.0) + (0.0, 0.0, layout.half_mm)
    with_inlet, without = _shares(layout, places)
    return Lit(of_places=with_inlet, of_picture=_shares(layout, near)[0], without_inlet=without)


def least_distance_mm(layout: Layout) -> float:
    """Return the camera distance from which every ray through the ROI ends on the diffuser; inf: none does."""
    half, inner, ledge = layout.half_mm, layout.inner_mm, layout.ledge_mm
    return half * (ledge + inner) / (inner - half) if inner > half else float("inf")


def advised_distance_mm(layout: Layout) -> float:
    """Return the nearest camera distance, to 10 mm, at which enough rays end on the diffuser; inf: none up to 1 m does.

    Farther away the inlet block hides less too.
    """
    parameters = layout.parameters
    distance = least_distance_mm(layout)
    while distance < 1000.0:
        there = Layout(replace(parameters, camera=replace(parameters.camera, distance_mm=distance)))
        if lit(there).of_places >= parameters.light.least_share:
            return distance
        distance += 10.0
    return float("inf")


def row_ripple(layout: Layout) -> float:
    """Return how much the light on the diffuser varies from LED row to LED row: (most - least) / (most + least).

    A row is a line of Lambertian light: at a distance x aside and gap g behind, it gives g^2 / (g^2 + x^2)^1.5.
    """
    light = layout.parameters.light
    rows = light.pitch_mm * np.arange(-60, 61)
    places = np.linspace(0.0, 0.5 * light.pitch_mm, 21)
    gap = light.gap_mm
    given = (gap**2 / (gap**2 + (places[:, None] - rows) ** 2) ** 1.5).sum(axis=1)
    return float((given.max() - given.min()) / (given.max() + given.min()))


def _shares(layout: Layout, places: FloatArray) -> tuple[float, float]:
    """Return the lit shares, with and without the inlet block, of rays to places (N, 3) about the ROI's centre.

    The camera looks along the places' third axis, from its positive side; the inlet is on the first axis's negative
    side. The block is square, so that both cameras see the same.
    """
    distance = layout.parameters.camera.distance_mm
    slope = places[:, :2] / (distance - places[:, 2:])
    on_ledge, on_inner = slope * (distance + layout.ledge_mm), slope * (distance + layout.inner_mm)
    good = (np.maximum(np.abs(on_ledge), np.abs(on_inner)) <= layout.inner_mm).all(axis=1)
    # A ray to a place in the ROI meets the block only behind that place, where it leaves the ROI over the entry plane.
    above, below = (slope * (distance + sign * 0.5 * INLET_SIDE_MM) for sign in (-1.0, 1.0))
    outwards = np.minimum(above[:, 0], below[:, 0]) < -layout.half_mm
    beside = np.minimum(np.abs(above[:, 1]), np.abs(below[:, 1])) <= 0.5 * INLET_SIDE_MM
    return float((good & ~(outwards & beside)).mean()), float(good.mean())
