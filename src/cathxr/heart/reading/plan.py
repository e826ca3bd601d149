"""How slices become a regular volume: the pitch, what is missing, and where each plane of voxels comes from."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import DataError, FloatArray
from cathxr.heart.reading.stack import Stack

MIN_SLICES = 4
MAX_BRIDGED_MM = 6.0
"""Across a wider gap a wall of the heart may begin and end unseen: the series is refused."""
MAX_MISSING = 0.05
"""Share of a series that may be interpolated; one slice always may."""
_JITTER = 0.1
_STRAIGHT_PX = 0.1
_LISTED = 4


@dataclass(frozen=True, eq=False)
class Plan:
    """Planes of the volume. below, above (K,): indices of slices; weight (K,): the share of the slice above.

    is_sheared: slices slide against one another (a tilted gantry), so that each is moved within its own plane.
    """

    pitch_mm: float
    below: np.ndarray
    above: np.ndarray
    weight: FloatArray
    is_sheared: bool
    remarks: tuple[str, ...]


def plan_of(stack: Stack) -> Plan:
    """Return how to make a regular volume of the stack, whose slices all lie at positions of their own.

    Raises:
        DataError: there are too few slices, or too many are missing; it names where.
    """
    along = stack.along_mm
    if len(along) < MIN_SLICES:
        what = "one slice" if len(along) == 1 else f"{len(along)} slices"
        raise DataError(f"The series holds only {what}, which is no volume; give the folder of the whole series.")
    steps = np.diff(along)
    # A distance that occurs: the mean of the middle two would be none where half of the slices lie twice as far apart.
    pitch = float(np.quantile(steps, 0.5, method="lower"))
    # Step by step, not from the start: a pitch of 0.625 mm written as 0.6 and 0.7 would drift by whole slices.
    planes = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(steps / pitch), 1.0))])
    fitted = float(np.polyfit(planes, along, 1)[0])
    is_regular = bool(np.abs(along - along[0] - planes * fitted).max() <= _JITTER * fitted)
    pitch = fitted if is_regular else pitch
    gaps = np.flatnonzero(steps > 1.5 * pitch)
    missing = int(np.rint(steps[gaps] / pitch - 1.0).sum())
    _check_gaps(stack, gaps, missing, pitch)
    remarks = [f"{_gap(stack, each, pitch)}: interpolated." for each in gaps[:_LISTED]]
    if len(gaps) > _LISTED:
        remarks.append(f"Slices are missing at {len(gaps) - _LISTED} further places: interpolated.")
    if not is_regular:
        remarks.append(
            f"The distances of slices vary, {steps.min():.2f} to {steps.max():.2f} mm: interpolated to {pitch:.2f} mm."
        )
    is_sheared = _is_sheared(stack)
    if is_sheared:
        remarks.append(f"The slices slide by {_tilt_deg(stack):.1f}° (a tilted gantry): brought to orthogonal axes.")
    below, above, weight = _sources(along, pitch, is_regular=is_regular)
    return Plan(pitch, below, above, weight, is_sheared, tuple(remarks))


def _check_gaps(stack: Stack, gaps: np.ndarray, missing: int, pitch: float) -> None:
    steps = np.diff(stack.along_mm)
    count = len(stack.frames)
    if steps.max() <= MAX_BRIDGED_MM and missing <= max(1.0, MAX_MISSING * count):
        return
    if pitch > MAX_BRIDGED_MM:
        raise DataError(
            f"The slices lie {pitch:.1f} mm apart, too far for a heart's walls; choose a series with thinner slices "
            "(`cathxr heart info` lists them)."
        )
    named = "; ".join(_gap(stack, each, pitch) for each in gaps[:_LISTED])
    more = f"; and {len(gaps) - _LISTED} further gaps" if len(gaps) > _LISTED else ""
    raise DataError(
        f"{named or f'The distances of slices vary up to {steps.max():.1f} mm'}{more}. That is too much to "
        "interpolate; export the whole series again."
    )


def _gap(stack: Stack, index: int, pitch: float) -> str:
    ends = sorted(stack.named_mm(float(stack.along_mm[each])) for each in (index, index + 1))
    count = max(1, round((stack.along_mm[index + 1] - stack.along_mm[index]) / pitch - 1.0))
    what = "a slice is missing" if count == 1 else f"{count} slices are missing"
    low, high = (f"{each:.1f}".replace("-", "−") for each in ends)
    return f"Between {low} and {high} mm {what}"


def _is_sheared(stack: Stack) -> bool:
    return bool((np.abs(stack.slide_mm) > _STRAIGHT_PX * np.array(stack.spacing_mm)).any())


def _tilt_deg(stack: Stack) -> float:
    height = stack.along_mm[-1] - stack.along_mm[0]
    return float(np.rad2deg(np.arctan2(np.linalg.norm(stack.slide_mm[-1] - stack.slide_mm[0]), height)))


def _sources(along: FloatArray, pitch: float, *, is_regular: bool) -> tuple[np.ndarray, np.ndarray, FloatArray]:
    """Return for each plane the slices on both sides and the share of the upper one."""
    count = round((along[-1] - along[0]) / pitch) + 1 if is_regular else int((along[-1] - along[0]) / pitch + 1e-6) + 1
    wanted = along[0] + np.arange(count) * pitch
    above = np.clip(np.searchsorted(along, wanted), 1, len(along) - 1)
    below = above - 1
    weight = np.clip((wanted - along[below]) / (along[above] - along[below]), 0.0, 1.0)
    near_below, near_above = wanted - along[below] <= _JITTER * pitch, along[above] - wanted <= _JITTER * pitch
    weight = np.where(near_below, 0.0, np.where(near_above, 1.0, weight))
    return below, above, weight
