"""The columns of the track CSV, and how each number is printed."""

import numpy as np

from cathxr.core import FloatArray, Status, Track

LEADING = (
    "seq", "t_s", "status", "reason", "tip_x_mm", "tip_y_mm", "tip_z_mm", "dir_x", "dir_y", "dir_z", "yaw_deg",
    "pitch_deg", "roll_deg", "sigma_mm", "length_mm",
)  # fmt: skip
"""Everything before the points."""

FEWEST_POINTS, MOST_POINTS = 2, 200


def header(points: int) -> list[str]:
    """Return the column names for `points` points: p00 is the tip, the last one the entry.

    Raises:
        ValueError: not 2 to 200 points.
    """
    if not FEWEST_POINTS <= points <= MOST_POINTS:
        raise ValueError(f"points: expected {FEWEST_POINTS} to {MOST_POINTS}, got {points}")
    return [*LEADING, *(f"p{i:02d}_{axis}_mm" for i in range(points) for axis in "xyz")]


def cells(track: Track, points: int) -> list[str]:
    """Return the row of one Track, as long as `header(points)`; a lost one is empty beyond its reason.

    Raises:
        ValueError: the Track has another number of points.
    """
    row = [str(track.seq), seconds_text(track.t_ns), track.status.value, track.reason]
    shape, direction, sigma = track.shape_box, track.direction_box, track.sigma_mm
    yaw, pitch, length = track.yaw_rad, track.pitch_rad, track.length_mm
    if shape is None or direction is None or sigma is None or yaw is None or pitch is None or length is None:
        return [*row, *[""] * (len(LEADING) - len(row) + 3 * points)]
    if len(shape) != points:
        raise ValueError(f"track {track.seq}: expected {points} points, got {len(shape)}")
    row += [_fixed(each, 6) for each in shape[0]]
    row += [_fixed(each, 9) for each in direction]
    row += [_fixed(float(np.degrees(each)), 7) for each in (yaw, pitch)]
    row.append("" if track.roll_rad is None else _fixed(float(np.degrees(track.roll_rad)), 7))
    return [*row, _fixed(sigma, 6), _fixed(length, 6), *_fixed_all(shape)]


def seconds_text(t_ns: int) -> str:
    """Return nanoseconds as seconds with nine decimals, exactly."""
    whole, rest = divmod(abs(t_ns), 1_000_000_000)
    return f"{'-' if t_ns < 0 else ''}{whole}.{rest:09d}"


def is_lost(status: str) -> bool:
    """Return whether a row of this status carries no pose."""
    return status == Status.LOST.value


def _fixed(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def _fixed_all(shape: FloatArray) -> list[str]:
    return [_fixed(each, 6) for each in shape.ravel().tolist()]
