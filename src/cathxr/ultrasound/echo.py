"""The complex echo of every point of the polar image, before the beam's width blurs it."""

import math

import numba as nb
import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.ultrasound.field import AcousticField
from cathxr.ultrasound.plane import Beams
from cathxr.ultrasound.sampling import codes_at, first_code_at, packed
from cathxr.ultrasound.scatterers import UNIT, scatterers_at
from cathxr.ultrasound.settings import MOST_PARTS, IceSettings, Resolved

ELEVATION_NEAR_MM = 0.5
ELEVATION_SPREAD = 0.022
"""The beam's standard deviation across the image plane: hypot(near, spread · range), near field and then spread."""
NORMAL_REACH = 1.25
"""Voxels to either side over which a wall's direction is taken: nearer, walls along the beam show the voxels as dots;
further, the ends of a sharp edge make slanted walls look less slanted (by 3 degrees of 60 as it is)."""
_THREE_POINTS = 1.2247448713915890
"""Three equal points at 0 and ±this many standard deviations have the variance of the whole (sqrt(3/2))."""


LAYER_CELLS = 1.4
"""Distance between layers in cells: as wide as the field is correlated, so that they are all but independent."""
_FAINT = 0.5 / 255.0
_SLOPE = 2.5066282746310002
"""Width of a Gaussian by its area, in standard deviations: sqrt(2 pi)."""


def complex_echo(
    field: AcousticField, beams: Beams, settings: IceSettings, *, resolved: Resolved, loss_db: FloatArray
) -> FloatArray:
    """Return the echo (lines, samples, 2), real and imaginary, as a share of a perfect plane reflector's.

    echo = transmission · (scatter · scatterers · gain + wall). Scatterers: a complex random field of the volume, raised
    by the gain that the point spread function will take away, so that the speckle's root mean square is `scatter`.
    Wall: R · cos^n of incidence, with R = tanh(change of ln Z / 2), and the wall's normal from the slope of the
    impedance's code, which has the direction of the slope of the impedance whatever the code. A wall is a line of
    wall_mm, raised by what the pulse's length will take off its peak.
    """
    out = np.zeros((settings.lines, settings.samples, 2))
    # In mm of the transducer's frame: how wide the volume has an interface, and how wide it is drawn.
    slope_mm = field.interface_mm / _SLOPE / beams.ct_mm_per_mm
    line_mm = min(resolved.wall_mm, slope_mm)
    knobs = np.array(
        [
            settings.sector_rad,
            settings.depth_mm,
            settings.apex_mm,
            settings.incidence_power,
            resolved.cell_mm,
            resolved.correlation_mm,
            resolved.sigma_axial_mm,
            resolved.sigma_lateral_rad,
            field.interface_mm,
            10.0 ** (settings.myocardium_db / 20.0),
            slope_mm / line_mm,
            math.hypot(1.0, resolved.sigma_axial_mm / line_mm),
            float(resolved.layers),
        ]
    )
    _echo(field.rgba, beams.packed, packed(field.scales), knobs, settings.slices, loss_db, out)
    return out


@nb.njit(cache=True, nogil=True)
def _loss_at(loss_db: FloatArray, across: float, along: float) -> float:
    """Return the loss at shares (0 to 1) of the sector and of the depth, bilinear between the cells' middles."""
    lines, samples = loss_db.shape
    x = min(max(across * lines - 0.5, 0.0), lines - 1.0)
    y = min(max(along * samples - 0.5, 0.0), samples - 1.0)
    x0, y0 = int(x), int(y)
    x1, y1 = min(x0 + 1, lines - 1), min(y0 + 1, samples - 1)
    fx, fy = x - x0, y - y0
    low = loss_db[x0, y0] * (1.0 - fx) + loss_db[x1, y0] * fx
    high = loss_db[x0, y1] * (1.0 - fx) + loss_db[x1, y1] * fx
    return float(low * (1.0 - fy) + high * fy)


@nb.njit(cache=True, nogil=True)
def _facing(
    rgba: npt.NDArray[np.uint8], at: FloatArray, beam: FloatArray, spacing: FloatArray, power: float, normal: FloatArray
) -> float:
    """Return cos^n of incidence at a point (voxels) of a beam (unit, in the volume's axes); write the wall's normal."""
    i, j, k, reach = at[0], at[1], at[2], NORMAL_REACH
    normal[0] = (first_code_at(rgba, i + reach, j, k) - first_code_at(rgba, i - reach, j, k)) / spacing[0]
    normal[1] = (first_code_at(rgba, i, j + reach, k) - first_code_at(rgba, i, j - reach, k)) / spacing[1]
    normal[2] = (first_code_at(rgba, i, j, k + reach) - first_code_at(rgba, i, j, k - reach)) / spacing[2]
    steep = max(math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2), 1e-6)
    for axis in range(3):
        normal[axis] /= steep
    cosine = abs(normal[0] * beam[0] + normal[1] * beam[1] + normal[2] * beam[2])
    return float(min(cosine, 1.0) ** power)


@nb.njit(cache=True, nogil=True)
def _wall(before: float, here: float, beyond: float, whole: float, narrowing: float) -> float:
    """Return a wall's echo from the interface's code at a point, and one standard deviation before and beyond it.

    The volume holds an interface as a Gaussian slope, wider than a wall looks. Three values on the way through it tell
    how far the point is from its middle (in standard deviations, from the logarithm's slope) and how high it is there:
    the echo is drawn as a narrower line of that height. whole: reflection for a code of 1.
    """
    place = math.log((before + _FAINT) / (beyond + _FAINT))
    place = min(max(place, -2.0), 2.0)
    reflection = math.tanh(whole * here * here * math.exp(0.5 * place * place))
    return float(reflection * math.exp(-0.5 * (narrowing * place) ** 2))


@nb.njit(cache=True, nogil=True)
def _scatterers_of(
    beams: FloatArray, reach: float, angle: float, line_rad: float, knobs: FloatArray, out: FloatArray
) -> float:
    """Write the scatterers' sum at a point of a line; return the gain that keeps its level as the beam widens.

    Several layers across the image plane add up, as within a beam's thickness: the speckle changes more slowly when
    the catheter rolls. And lines lie further apart than the lattice's points at depth: the mean of several places on
    the way to the next line keeps the speckle from boiling when the transducer moves.
    """
    apex, cell, correlation, lateral, layers = knobs[2], knobs[4], knobs[5], knobs[7], int(knobs[12])
    spacing = reach * line_rad * beams[12]
    parts = min(max(math.ceil(spacing / cell), 1), MOST_PARTS)
    out[:] = 0.0
    for part in range(parts):
        turned = angle + ((part + 0.5) / parts - 0.5) * line_rad
        x, z = reach * math.cos(turned) - apex, reach * math.sin(turned)
        for layer in range(layers):
            y = LAYER_CELLS * (layer - 0.5 * (layers - 1)) * cell / beams[12]
            scatterers_at(
                (beams[0] + x * beams[3] + y * beams[6] + z * beams[9]) * beams[13] / cell,
                (beams[1] + x * beams[4] + y * beams[7] + z * beams[10]) * beams[14] / cell,
                (beams[2] + x * beams[5] + y * beams[8] + z * beams[11]) * beams[15] / cell,
                out,
            )
    scale = 1.0 / (UNIT * parts * math.sqrt(layers))
    out[0] *= scale
    out[1] *= scale
    width = (reach * lateral * beams[12]) ** 2 + spacing * spacing * (1.0 - 1.0 / (parts * parts)) / 12.0
    return float(math.sqrt(math.sqrt(1.0 + 2.0 * width / (correlation * correlation))))


@nb.njit(cache=True, nogil=True)
def _echo(
    rgba: npt.NDArray[np.uint8],
    beams: FloatArray,
    scales: FloatArray,
    knobs: FloatArray,
    slices: int,
    loss_db: FloatArray,
    out: FloatArray,
) -> None:
    sector, depth, apex = knobs[0], knobs[1], knobs[2]
    lines, samples = out.shape[0], out.shape[1]
    line_rad = sector / lines
    voxel_mm = beams[13:16]
    code, pair, at, beam, normal = np.empty(4), np.empty(2), np.empty(3), np.empty(3), np.empty(3)
    slope = knobs[8] / _SLOPE
    axial_gain = math.sqrt(math.sqrt(1.0 + 2.0 * (knobs[6] * beams[12] / knobs[5]) ** 2))
    for line in range(lines):
        angle = ((line + 0.5) / lines - 0.5) * sector
        for sample in range(samples):
            r = (sample + 0.5) * depth / samples
            reach = apex + r
            x, z = reach * math.cos(angle) - apex, reach * math.sin(angle)
            for axis in range(3):
                beam[axis] = math.cos(angle) * beams[3 + axis] + math.sin(angle) * beams[9 + axis]
                beam[axis] *= voxel_mm[axis] / beams[12]
                at[axis] = beams[axis] + x * beams[3 + axis] + z * beams[9 + axis]
            facing = _facing(rgba, at, beam, voxel_mm, knobs[3], normal) * knobs[11]
            scatter, wall = 0.0, 0.0
            out_of_plane = _THREE_POINTS * math.hypot(ELEVATION_NEAR_MM, ELEVATION_SPREAD * r)
            for part in range(slices):
                y = (part - 1) * out_of_plane if slices == 3 else 0.0
                i, j, k = at[0] + y * beams[6], at[1] + y * beams[7], at[2] + y * beams[8]
                codes_at(rgba, i, j, k, code)
                scatter += scales[0] * code[1] * code[1] / slices
                here = code[3]
                di, dj, dk = (
                    normal[0] * slope / voxel_mm[0],
                    normal[1] * slope / voxel_mm[1],
                    normal[2] * slope / voxel_mm[2],
                )
                codes_at(rgba, i - di, j - dj, k - dk, code)
                before = code[3]
                codes_at(rgba, i + di, j + dj, k + dk, code)
                wall += _wall(before, here, code[3], scales[2] * knobs[8], knobs[10]) / slices
            speckle = _scatterers_of(beams, reach, angle, line_rad, knobs, pair) * axial_gain * scatter * knobs[9]
            passed = 10.0 ** (-0.05 * _loss_at(loss_db, (line + 0.5) / lines, r / depth))
            out[line, sample, 0] = passed * (speckle * pair[0] + facing * wall)
            out[line, sample, 1] = passed * speckle * pair[1]
