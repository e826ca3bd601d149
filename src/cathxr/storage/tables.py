"""The small tables beside recorded pictures: times.csv and roll.csv, with every check that a person's file needs."""

import csv
import os
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cathxr.core import DataError
from cathxr.storage.atomic import os_reason

_LATEST_S = Decimal(9_000_000_000)
"""Seconds beyond which nanoseconds no longer fit 64 bits."""


@dataclass(frozen=True, eq=False)
class PictureTimes:
    """When the pictures of each pair were taken: top_ns (N,), front_ns (N,), mid-exposure, on one clock."""

    top_ns: NDArray[np.int64]
    front_ns: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class RollCounts:
    """Encoder counts (N,) at t_ns (N,), on the clock of the pictures."""

    t_ns: NDArray[np.int64]
    count: NDArray[np.float64]


def read_times(path: str | os.PathLike[str]) -> PictureTimes:
    """Return the instants of times.csv: header seq,t_top_s,t_front_s; seq 0, 1, 2, ...; times going forwards.

    Raises:
        DataError: one sentence with the file, the line, what was expected, and what to do.
    """
    rows = _rows(Path(path), ("seq", "t_top_s", "t_front_s"))
    for index, (line, row) in enumerate(rows):
        if row[0] != index:
            raise DataError(f"{path}: line {line}: expected seq {index}, got {row[0]}; number the pairs 0, 1, 2, ...")
    top = _forwards(path, rows, 1, "t_top_s", may_repeat=False)
    return PictureTimes(top, _forwards(path, rows, 2, "t_front_s", may_repeat=False))


def read_roll(path: str | os.PathLike[str]) -> RollCounts:
    """Return the readings of roll.csv: header t_s,count; times never going backwards.

    Raises:
        DataError: see `read_times`.
    """
    rows = _rows(Path(path), ("t_s", "count"))
    return RollCounts(
        _forwards(path, rows, 0, "t_s", may_repeat=True), np.array([float(row[1]) for _, row in rows], dtype=np.float64)
    )


def _rows(path: Path, header: tuple[str, ...]) -> list[tuple[int, list[Decimal]]]:
    """Return each row's line number and numbers."""
    wanted = ",".join(header)
    result = []
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            first = next(reader, None)
            if first is None or tuple(each.strip() for each in first) != header:
                got = "an empty file" if first is None else f"{','.join(first)[:60]!r}"
                raise DataError(f"{path}: expected the first line {wanted}, got {got}; give the columns these names.")
            for row in reader:
                if any(each.strip() for each in row):
                    result.append((reader.line_num, _numbers(path, reader.line_num, row, header)))
    except OSError as error:
        raise DataError(f"{path}: cannot read the table ({os_reason(error)}); check the path.") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path}: expected a table of text ({wanted}), got something else; save it as CSV.") from error
    if not result:
        raise DataError(f"{path}: expected rows below {wanted}, got none; leave the option out without a table.")
    return result


def _numbers(path: Path, line: int, row: list[str], header: tuple[str, ...]) -> list[Decimal]:
    if len(row) != len(header):
        raise DataError(
            f"{path}: line {line}: expected {len(header)} values ({','.join(header)}), got {len(row)}; correct it."
        )
    result = []
    for name, cell in zip(header, row, strict=True):
        try:
            value = Decimal(cell.strip())
        except InvalidOperation:
            value = Decimal("NaN")
        if not value.is_finite() or abs(value) > _LATEST_S:
            raise DataError(
                f"{path}: line {line}: expected a number for {name}, got {cell.strip()[:40]!r}; correct it."
            )
        result.append(value)
    return result


def _forwards(
    path: str | os.PathLike[str], rows: list[tuple[int, list[Decimal]]], column: int, name: str, *, may_repeat: bool
) -> NDArray[np.int64]:
    """Return a column of seconds as nanoseconds (N,), after checking that time goes forwards."""
    result = np.array([int((row[column] * 1_000_000_000).to_integral_value()) for _, row in rows], dtype=np.int64)
    steps = np.diff(result)
    wrong = np.flatnonzero(steps < 0 if may_repeat else steps <= 0)
    if len(wrong):
        line, row = rows[int(wrong[0]) + 1]
        raise DataError(
            f"{path}: line {line}: expected {name} later than the line before, got {row[column]}; "
            "sort the rows by time and remove repeated ones."
        )
    return result
