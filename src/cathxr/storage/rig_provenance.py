"""How a rig's values were measured: the optional keys std, covariance, rms_px, n, date and method of a table."""

from collections.abc import Mapping
from datetime import date, datetime
from typing import Any

import numpy as np

from cathxr.core import FloatArray, Provenance
from cathxr.storage.toml_table import Table, described

_ASYMMETRY = 1e-6
"""How far a covariance may be from symmetric and from positive, relative to its largest entry: printed digits."""


def read_provenance(table: Table, measured: Mapping[str, int], *, is_pose: bool = False) -> Provenance:
    """Return the provenance stated in `table`, whose measured values are `measured`: name to length (0: a number).

    Raises:
        ConfigError: one of the keys does not say what it must.
    """
    table.know("std", "rms_px", "n", "date", "method", *(f"{name}_std" for name in measured))
    there = {name: length for name, length in measured.items() if name in table}
    return Provenance(
        std=_deviations(table, there),
        covariance=_covariance(table) if is_pose else None,
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
    if provenance.covariance is not None:
        values["covariance"] = np.asarray(provenance.covariance, dtype=np.float64).tolist()
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


def _covariance(table: Table) -> FloatArray | None:
    table.know("covariance")
    if "covariance" not in table:
        return None
    matrix = table.matrix("covariance", 6)
    size = max(float(np.abs(matrix).max()), 1e-300)
    off = float(np.abs(matrix - matrix.T).max())
    if off > _ASYMMETRY * size or (np.diag(matrix) < 0).any():
        raise table.error(
            "covariance",
            "expected a symmetric matrix with a diagonal of at least 0, got another; "
            "write rotation (rad) then translation (mm), or leave the key out.",
        )
    # Rotation and translation differ in scale by orders of magnitude: judge positivity on the correlations.
    spread = np.sqrt(np.where(np.diag(matrix) > 0, np.diag(matrix), size))
    if float(np.linalg.eigvalsh(matrix / np.outer(spread, spread)).min()) < -_ASYMMETRY:
        raise table.error(
            "covariance", "expected a positive semi-definite matrix, got one that is not; correct it or leave it out."
        )
    matrix.setflags(write=False)
    return matrix


def _date(table: Table) -> str:
    value = table.asked("date", example='date = "2025-05-08"')
    if isinstance(value, date | datetime):
        return value.isoformat()
    return table.text("date", example='date = "2025-05-08"', may_be_empty=True)
