"""How a rig's values were measured: the optional keys std, covariance, rms_px, n, date and method of a table."""

from collections.abc import Mapping
from datetime import date, datetime
from typing import Any

import numpy as np

from cathxr.core import FloatArray, Provenance
from cathxr.storage.toml_table import Table, described

_ROUNDING = 1e-6
"""How far correlations may be from symmetric and from positive: printed digits."""


POSE, INTRINSICS = "rotation (rad) then translation (mm)", "focal x y, centre x y, k1 k2 p1 p2 k3"
_SIZES = {POSE: 6, INTRINSICS: 9}


def read_provenance(table: Table, measured: Mapping[str, int], *, covariance_of: str = "") -> Provenance:
    """Return the provenance stated in `table`, whose measured values are `measured`: name to length (0: a number).

    covariance_of: POSE or INTRINSICS where the table may hold a covariance.

    Raises:
        ConfigError: one of the keys does not say what it must.
    """
    table.know("std", "rms_px", "n", "date", "method", *(f"{name}_std" for name in measured))
    there = {name: length for name, length in measured.items() if name in table}
    return Provenance(
        std=_deviations(table, there),
        covariance=_covariance(table, covariance_of) if covariance_of else None,
        covariance_with_intrinsics=_with_intrinsics(table) if covariance_of == POSE else None,
        rms_px=table.number("rms_px", example="rms_px = 0.21", minimum=0.0) if "rms_px" in table else None,
        n=table.integer("n", example="n = 24", minimum=0, maximum=10**12) if "n" in table else None,
        date=_date(table) if "date" in table else None,
        method=table.text("method", example='method = "ChArUco"', may_be_empty=True) if "method" in table else None,
    )


def provenance_values(provenance: Provenance, measured: int) -> dict[str, Any]:
    """Return the TOML keys of `provenance` for a table that has `measured` measured values."""
    values: dict[str, Any] = {}
    std = {name: np.asarray(each, dtype=np.float64).tolist() for name, each in provenance.std.items()}
    if std:
        values["std"] = next(iter(std.values())) if measured == 1 else std
    for name in ("covariance", "covariance_with_intrinsics"):
        matrix = getattr(provenance, name)
        if matrix is not None:
            values[name] = np.asarray(matrix, dtype=np.float64).tolist()
    for name, kind in (("rms_px", float), ("n", int), ("date", str), ("method", str)):
        value = getattr(provenance, name)
        if value is not None:
            values[name] = kind(value)
    return values


def _deviations(table: Table, there: Mapping[str, int]) -> dict[str, FloatArray]:
    """Return the standard deviation of each value that states one, in the value's own shape."""
    result: dict[str, FloatArray] = {}
    if "std" in table:
        value = table.values["std"]
        if isinstance(value, dict):
            keyed = table.table("std")
            for name, length in there.items():
                if name in keyed:
                    result[name] = _deviation(keyed, name, length)
            keyed.know(*there)
            keyed.finish()
        elif len(there) == 1:
            ((name, length),) = there.items()
            result[name] = _deviation(table, "std", length)
        else:
            names = ", ".join(there)
            raise table.error(
                "std",
                f"expected a table, for this table has several measured values, got {described(value)}; "
                f"write std = {{ name = value }} with names from: {names}.",
            )
    for name, length in there.items():
        key = f"{name}_std"
        if key in table:
            if name in result:
                raise table.error(key, "expected one standard deviation, got two (std states it too); remove one.")
            result[name] = _deviation(table, key, length)
    stray = next((key for key in table.values if key.endswith("_std") and key[:-4] not in there), None)
    if stray is not None:
        raise table.error(stray, f"expected {stray[:-4]} beside it, got none; add the value or remove this key.")
    return result


def _deviation(table: Table, key: str, length: int) -> FloatArray:
    """Return a standard deviation, shape () for length 0, else (length,); one number stands for all."""
    value = table.values[key]
    if length == 0 or not isinstance(value, list):
        number = table.number(key, example=f"{key} = 0.05", minimum=0.0)
        result = np.array(number) if length == 0 else np.full(length, number)
    else:
        result = table.vector(key, length, example=f"{key} = {[0.05] * length}")
        if (result < 0).any():
            raise table.error(key, f"expected standard deviations of at least 0, got {result.min():g}; correct it.")
    result.setflags(write=False)
    return result


def check_joint(table: Table, pose: Provenance, intrinsics: Provenance) -> None:
    """Return when a camera's pose and intrinsics can have the covariance that is stated between them.

    table: the camera's [camera_from_box].

    Raises:
        ConfigError: no errors can be related like that.
    """
    cross = pose.covariance_with_intrinsics
    if cross is None:
        return
    key = "covariance_with_intrinsics"
    if pose.covariance is None:
        raise table.error(key, "expected covariance beside it, got none; add it or leave this key out.")
    lens = intrinsics.covariance
    if lens is None:
        parts = (("focal_px", 2), ("centre_px", 2), ("distortion", 5))
        lens = np.diag(np.square(np.concatenate([intrinsics.std.get(name, np.zeros(size)) for name, size in parts])))
    if not _is_positive(np.block([[pose.covariance, cross], [cross.T, lens]])):
        raise table.error(
            key,
            "expected what fits the covariances of the pose and of the intrinsics (together positive semi-definite), "
            "got another; calibrate the markers again after the intrinsics, or leave the key out.",
        )


def _covariance(table: Table, of: str) -> FloatArray | None:
    table.know("covariance")
    if "covariance" not in table:
        return None
    matrix = table.matrix("covariance", _SIZES[of], _SIZES[of])
    scale = _scale(matrix)
    if (np.abs(matrix - matrix.T) > _ROUNDING * np.outer(scale, scale)).any() or (np.diag(matrix) < 0).any():
        raise table.error(
            "covariance",
            f"expected a symmetric matrix with a diagonal of at least 0, got another; write {of}, "
            "or leave the key out.",
        )
    if not _is_positive(matrix):
        raise table.error(
            "covariance", "expected a positive semi-definite matrix, got one that is not; correct it or leave it out."
        )
    matrix.setflags(write=False)
    return matrix


def _with_intrinsics(table: Table) -> FloatArray | None:
    key = "covariance_with_intrinsics"
    table.know(key)
    if key not in table:
        return None
    matrix = table.matrix(key, 6, 9)
    matrix.setflags(write=False)
    return matrix


def _scale(matrix: FloatArray) -> FloatArray:
    """Return the standard deviations of a covariance; for an exact value the least positive number that works."""
    diagonal = np.diag(matrix).clip(min=0.0)
    return np.sqrt(np.where(diagonal > 0, diagonal, 1e-300))


def _is_positive(matrix: FloatArray) -> bool:
    """Return whether a covariance is positive semi-definite within the rounding of printed digits, in any units."""
    scale = _scale(matrix)
    # Radians, mm, px and lens coefficients differ by orders of magnitude: judge the correlations.
    correlation = matrix / np.outer(scale, scale)
    if not np.isfinite(correlation).all() or np.abs(correlation).max() > 1.0 + _ROUNDING:
        return False
    return bool(np.linalg.eigvalsh(0.5 * (correlation + correlation.T)).min() > -_ROUNDING)


def _date(table: Table) -> str:
    value = table.asked("date", example='date = "2025-05-08"')
    if isinstance(value, date | datetime):
        return value.isoformat()
    return table.text("date", example='date = "2025-05-08"', may_be_empty=True)
