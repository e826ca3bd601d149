"""Reads landmarks from a file: landmarks.toml, a CSV table, or the landmarks of an earlier registration.toml."""

import csv
import io
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from cathxr.core import ConfigError, DataError, FloatArray

SCHEMA = "cathxr-landmarks/1"
_REGISTRATION_SCHEMA = "cathxr-registration/1"
_AXES = ("x", "y", "z")
_POINTS = {frame: tuple(f"{frame}_{axis}_mm" for axis in _AXES) for frame in ("box", "ct")}
_STDS = ("box_std_mm", "ct_std_mm")
_COLUMNS = ("name", *_POINTS["box"], *_POINTS["ct"], *_STDS)

_Point = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]
_Positive = Annotated[FiniteFloat, Field(gt=0.0)]
_Std = _Positive | Annotated[list[_Positive], Field(min_length=3, max_length=3)]


@dataclass(frozen=True, eq=False)
class Measured:
    """One landmark as a file gives it. box_mm, ct_mm (3,) mm and their stds (3,) mm; None: the file does not say."""

    name: str
    box_mm: FloatArray | None
    ct_mm: FloatArray | None
    box_std_mm: FloatArray | None = None
    ct_std_mm: FloatArray | None = None


class _Landmark(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    box_mm: _Point | None = None
    ct_mm: _Point | None = None
    box_std_mm: _Std | None = None
    ct_std_mm: _Std | None = None


class _Document(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    schema_name: Literal["cathxr-landmarks/1"] = Field(alias="schema")
    landmarks: Annotated[dict[Annotated[str, Field(min_length=1)], _Landmark], Field(min_length=1)]


def read_landmarks(path: Path | str) -> tuple[Measured, ...]:
    """Return the landmarks of a file, in its order. Format: docs/formats.md.

    Raises:
        DataError: the file cannot be read; ConfigError: it does not say what it must.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise DataError(f"{file} cannot be read ({error.strerror}); give a TOML or CSV file of landmarks.") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{file} is not UTF-8 text; save it as UTF-8.") from error
    if file.suffix.lower() == ".toml":
        return _from_toml(file, text)
    return _from_csv(file, text)


def _from_toml(file: Path, text: str) -> tuple[Measured, ...]:
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{file} is not valid TOML: {error}. A landmark may be given only once.") from error
    if content.get("schema") == _REGISTRATION_SCHEMA:
        content = _only_landmarks(content)
    try:
        document = _Document.model_validate(content)
    except ValidationError as error:
        raise ConfigError(f"{file}: {_first_fault(error)}. The format is in docs/formats.md.") from error
    return tuple(
        Measured(name, _point(each.box_mm), _point(each.ct_mm), _std(each.box_std_mm), _std(each.ct_std_mm))
        for name, each in document.landmarks.items()
    )


def _only_landmarks(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return what an earlier registration was made from, without its results."""
    tables = content.get("landmarks", {})
    results = ("residual_mm", "held_out_mm")
    kept = {name: {key: value for key, value in table.items() if key not in results} for name, table in tables.items()}
    return {"schema": SCHEMA, "landmarks": kept}


def _from_csv(file: Path, text: str) -> tuple[Measured, ...]:
    first = text.splitlines()[0] if text.strip() else ""
    separator = ";" if first.count(";") > first.count(",") else ","
    reader = csv.reader(io.StringIO(text), delimiter=separator, skipinitialspace=True)
    rows = [[cell.strip() for cell in row] for row in reader]
    rows = [row for row in rows if any(row)]
    if len(rows) < 2:
        raise ConfigError(f"{file} has no landmarks; write a line with {', '.join(_COLUMNS[:7])}, then one for each.")
    header = rows[0]
    _check_header(file, header)
    found: dict[str, Measured] = {}
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise ConfigError(
                f"{file}: row {number} has {len(row)} columns and the first row {len(header)}; make it match."
            )
        cells = dict(zip(header, row, strict=True))
        name = cells["name"]
        if not name:
            raise ConfigError(f"{file}: row {number} has no name; give each landmark one.")
        if name in found:
            raise ConfigError(f"{file}: the landmark {name!r} is there twice (row {number} again); keep one of them.")
        where = f"{file}: row {number} ({name})"
        points = {frame: _point_of(where, cells, columns) for frame, columns in _POINTS.items()}
        stds = [_number_of(where, cells, each) for each in _STDS]
        for column, std in zip(_STDS, stds, strict=True):
            if std is not None and std <= 0:
                raise ConfigError(
                    f"{where}: {column} must be greater than zero, {std:g} was given; leave it empty if it is unknown."
                )
        found[name] = Measured(name, points["box"], points["ct"], _std(stds[0]), _std(stds[1]))
    return tuple(found.values())


def _check_header(file: Path, header: Sequence[str]) -> None:
    """Refuse a table that lacks columns, or has some that are not known or there twice."""
    unknown = [each for each in header if each not in _COLUMNS]
    if unknown:
        raise ConfigError(f"{file}: the column {unknown[0]!r} is not known; the columns are {', '.join(_COLUMNS)}.")
    twice = [each for each in header if header.count(each) > 1]
    if twice:
        raise ConfigError(f"{file}: the column {twice[0]!r} is there twice; keep one of them.")
    missing = [] if "name" in header else ["name"]
    for columns in _POINTS.values():
        if any(each in header for each in columns):
            missing += [each for each in columns if each not in header]
    if not any(each in header for columns in _POINTS.values() for each in columns):
        missing += _POINTS["box"]
    if missing:
        told = "columns {} are" if len(missing) > 1 else "column {} is"
        raise ConfigError(f"{file}: the {told.format(', '.join(missing))} missing; add what was measured, in mm.")


def _point_of(where: str, cells: Mapping[str, str], columns: Sequence[str]) -> FloatArray | None:
    """Return the point in three cells; None where all are empty or absent."""
    values = [_number_of(where, cells, each) for each in columns]
    if all(each is None for each in values):
        return None
    for column, value in zip(columns, values, strict=True):
        if value is None:
            raise ConfigError(f"{where}: {column} is empty, though other coordinates are given; fill it in.")
    return np.array(values, dtype=np.float64)


def _number_of(where: str, cells: Mapping[str, str], column: str) -> float | None:
    text = cells.get(column, "")
    if not text:
        return None
    try:
        value = float(text)
    except ValueError as error:
        raise ConfigError(f"{where}: {column} is {text!r}, which is no number; write it as 12.5.") from error
    if not math.isfinite(value):
        raise ConfigError(f"{where}: {column} is {text!r}; give a finite number, or leave the landmark out.")
    return value


def _point(values: Sequence[float] | None) -> FloatArray | None:
    return None if values is None else np.array(values, dtype=np.float64)


def _std(value: float | Sequence[float] | None) -> FloatArray | None:
    """Return standard deviations along three axes (3,), mm, of one number for all or three."""
    return None if value is None else np.broadcast_to(np.array(value, dtype=np.float64), (3,)).copy()


def _first_fault(error: ValidationError) -> str:
    """Return the first fault of a document, with the key it is at."""
    first = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in first["loc"] if part not in ("[key]", "float", "list[constrained-float]"))
    if first["type"] == "missing":
        return f"{where} is missing"
    if first["type"] == "extra_forbidden":
        return f"{where} is not a key of this format; take it out"
    if first["type"] == "finite_number":
        return f"{where} is {first['input']!r}; give a finite number, or leave the landmark out"
    return f"{where} is wrong: {first['msg']} (found {first['input']!r:.60})"
