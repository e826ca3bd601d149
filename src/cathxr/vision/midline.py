"""From a traced path to measured midline points with errors, and the centre of the rounded end."""

from dataclasses import dataclass, replace

import numpy as np

from cathxr.core import FloatArray
from cathxr.vision.midline_kernels import (
    SPACING_PX,
    cap_centre,
    end_line,
    end_outline,
    measured_sections,
    middle_of,
    smoothed,
)
from cathxr.vision.segmentation import MatteArray

LEAST_SIGMA_PX = 0.02
"""Sampling and interpolation alone leave about this much, however clean the picture."""
LEAST_OUTLINE_PX = 0.05
"""How well the outline of a small circle follows its ideal, however clean the picture."""
_QUANTUM_PX = 1e-4
"""Measurements are rounded to this, far below their noise, so that recordings stay small and exact."""
_LEAST_POINTS = 4


@dataclass(frozen=True, eq=False)
class Midline:
    """Measured midline, tip first: as in Detection, from the rounded end's centre on. plateau: the matte on it."""

    curve_px: FloatArray
    normal_px: FloatArray
    sigma_px: FloatArray
    half_width_px: FloatArray
    tip_px: FloatArray
    tip_sigma_px: float
    end_px: FloatArray
    end_sigma_px: FloatArray
    plateau: float

    def roughened(self, sigma_px: float, end_sigma_px: float) -> "Midline":
        """Return the same line where each section and each point of the end's outline is off by so much more."""
        return replace(
            self,
            sigma_px=np.hypot(self.sigma_px, sigma_px),
            end_sigma_px=np.hypot(self.end_sigma_px, end_sigma_px),
        )

    def without_end(self, sigma_px: float) -> "Midline":
        """Return the same line where the end is not seen: it is `sigma_px` unsure."""
        sigmas = self.sigma_px.copy()
        sigmas[0] = sigma_px
        return replace(
            self,
            sigma_px=sigmas,
            tip_sigma_px=sigma_px,
            end_px=self.end_px[:0],
            end_sigma_px=self.end_sigma_px[:0],
        )


def measured(matte: MatteArray, path: FloatArray, width: float, plateau: float) -> Midline | None:
    """Return the midline along `path` (N, 2) px, entry first, in the matte's pixels; None where too little is seen."""
    if len(path) < _LEAST_POINTS or np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < 1.5 * width:
        return None
    points, normals, sections = measured_sections(matte, np.ascontiguousarray(path), width, plateau)
    return _with_end(matte, points, normals, sections) if len(points) else None


def _with_end(matte: MatteArray, points: FloatArray, normals: FloatArray, sections: FloatArray) -> Midline | None:
    """Return the midline with the rounded end located."""
    radius = 0.5 * float(np.median(sections[-12:, 1]))
    plateau = float(np.median(sections[-12:, 2]))
    slope = float(np.median(sections[:, 3]))
    blur = float(np.clip(plateau / max(slope, 1e-6) / np.sqrt(2.0 * np.pi), 0.3, 0.5 * radius))
    position, direction, half_bend = end_line(points, 6.0 * radius)
    reached, spread = cap_centre(matte, position, direction, radius, plateau, blur)
    if spread < 0.0:
        return None
    # the midline goes on bending on its way to the end's centre
    centre = position + reached * direction + reached * reached * half_bend
    direction = direction + 2.0 * reached * half_bend
    direction = direction / np.linalg.norm(direction)
    # sections inside the rounded end are narrower and carry no news of the axis
    before = (points - centre) @ direction < -0.25 * radius
    before |= np.arange(len(points)) < len(points) - 2 * int(np.ceil(2 * radius / SPACING_PX)) - 2
    points, normals, sections = points[before], normals[before], sections[before]
    if len(points) < _LEAST_POINTS:
        return None
    outline = end_outline(matte, centre, direction, radius, plateau, blur)
    tip_first = (points[::-1], normals[::-1], sections[::-1])
    return midline_of(*tip_first, centre, direction, radius, outline, tip_sigma_px=spread)


def midline_of(
    points: FloatArray,
    normals: FloatArray,
    sections: FloatArray,
    centre: FloatArray,
    direction: FloatArray,
    radius: float,
    outline: FloatArray,
    *,
    tip_sigma_px: float = 0.0,
) -> Midline:
    """Return the midline of measured sections (N, 4) at points (N, 2), tip first, and of the rounded end.

    centre (2,), direction (2,) unit and radius px of the end; outline (M, 2) px around it.
    """
    residual = ((points - smoothed(np.ascontiguousarray(points), 4)) * normals).sum(axis=1)
    sigma = max(LEAST_SIGMA_PX, 1.4826 * float(middle_of(np.abs(residual))) * 1.25)
    sigmas = sigma * np.sqrt(1.0 + np.square(residual / (3.0 * sigma)))
    return Midline(
        curve_px=_rounded(np.vstack([centre, points])),
        normal_px=np.vstack([[-direction[1], direction[0]], normals]),
        sigma_px=np.concatenate([[1.5 * sigma], sigmas]),
        half_width_px=np.concatenate([[radius], 0.5 * sections[:, 1]]),
        tip_px=_rounded(centre + radius * direction),
        tip_sigma_px=float(np.hypot(tip_sigma_px, LEAST_SIGMA_PX)),
        end_px=_rounded(outline),
        # a section's middle is the mean of two edges; neighbouring rays share pixels besides
        end_sigma_px=np.full(len(outline), max(LEAST_OUTLINE_PX, 2.0 * sigma)),
        plateau=float(middle_of(np.ascontiguousarray(sections[:, 2]))),
    )


def _rounded(values: FloatArray) -> FloatArray:
    return np.asarray(np.round(values / _QUANTUM_PX) * _QUANTUM_PX, dtype=np.float64)
