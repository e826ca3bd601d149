"""Reads and writes registration.toml. Format: docs/formats.md."""

import contextlib
import datetime
import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from cathxr.core import ConfigError, DataError, FloatArray, Pose
from cathxr.registration.model import Kind, LandmarkPair, Registration

SCHEMA = "cathxr-registration/1"

_Point = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]
_Error = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
_Std = Annotated[list[Annotated[FiniteFloat, Field(gt=0.0)]], Field(min_length=3, max_length=3)]
_Matrix = Annotated[list[_Point], Field(min_length=3, max_length=3)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _Pose(_Table):
    rotation_wxyz: Annotated[list[FiniteFloat], Field(min_length=4, max_length=4)]
    translation_mm: _Point


class _Landmark(_Table):
    box_mm: _Point
    ct_mm: _Point
    residual_mm: _Error | None = None
    held_out_mm: _Error | None = None
    box_std_mm: _Std | None = None
    ct_std_mm: _Std | None = None


class _Document(_Table):
    schema_name: Literal["cathxr-registration/1"] = Field(alias="schema")
    kind: Literal["placement", "rigid", "similarity", "affine"]
    method: Annotated[str, Field(min_length=1)]
    date: str | datetime.date | None = None
    scale: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1.0
    fre_mm: _Error | None = None
    tre_mm: _Error | None = None
    predicted_tre_mm: _Error | None = None
    worst_tre_mm: _Error | None = None
    fle_mm: _Error | None = None
    ct_from_box: _Pose
    linear: _Matrix | None = None
    covariance: list[list[FiniteFloat]] | None = None
    landmarks: dict[str, _Landmark] = Field(default_factory=dict)


def read_registration(path: Path | str) -> Registration:
    """Return the registration in the file at `path`.

    Raises:
        DataError: the file cannot be read.
        ConfigError: it is not TOML, or a key is missing, unknown, or has a value it cannot have.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise DataError(f"{file} cannot be read ({error.strerror}); give a registration.toml file.") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{file} is not UTF-8 text; save it as UTF-8.") from error
    try:
        return registration_from_table(tomllib.loads(text), name=str(file))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{file} is not valid TOML: {error}.") from error


def registration_from_table(values: Mapping[str, Any], *, name: str) -> Registration:
    """Return the registration in a parsed registration.toml, such as a session's copy; `name` is what errors name.

    Raises:
        ConfigError: a key is missing, unknown, or has a value it cannot have.
    """
    try:
        return _registration(_Document.model_validate(values))
    except ValidationError as error:
        raise ConfigError(f"{name}: {_first_fault(error)}. The format is in docs/formats.md.") from error
    except ValueError as error:
        raise ConfigError(f"{name}: {error}. The format is in docs/formats.md.") from error


def write_registration(path: Path | str, registration: Registration) -> None:
    """Write `registration` to `path` as `read_registration` reads it; an interrupted write leaves the old file.

    Raises:
        DataError: the file cannot be written.
    """
    file = Path(path)
    beside = file.with_name(file.name + ".part")
    try:
        beside.write_text(registration_toml(registration), encoding="utf-8", newline="\n")
        os.replace(beside, file)
    except OSError as error:
        with contextlib.suppress(OSError):
            beside.unlink()
        raise DataError(f"{file} cannot be written ({error.strerror}); check its folder.") from error


def registration_toml(registration: Registration) -> str:
    """Return the text of registration.toml; what is unknown is left out."""
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "kind": registration.kind.value,
        "method": registration.method,
        "date": registration.date,
        "scale": registration.scale,
        "fre_mm": registration.fre_mm,
        "tre_mm": registration.tre_mm,
        "predicted_tre_mm": registration.predicted_tre_mm,
        "worst_tre_mm": registration.worst_tre_mm,
        "fle_mm": registration.fle_mm,
        "linear": _listed(registration.linear),
        "covariance": _listed(registration.covariance),
        "ct_from_box": {
            "rotation_wxyz": registration.ct_from_box.rotation_wxyz.tolist(),
            "translation_mm": registration.ct_from_box.translation_mm.tolist(),
        },
    }
    pairs = {pair.name: _present(_pair_table(pair)) for pair in registration.landmarks}
    if pairs:
        document["landmarks"] = pairs
    return tomli_w.dumps(_present(document))


def _registration(document: _Document) -> Registration:
    """Return the registration that a checked document describes."""
    pose = document.ct_from_box
    return Registration(
        ct_from_box=Pose(np.array(pose.rotation_wxyz), np.array(pose.translation_mm)),
        kind=Kind(document.kind),
        method=document.method,
        scale=document.scale,
        date=None if document.date is None else str(document.date),
        fre_mm=document.fre_mm,
        tre_mm=document.tre_mm,
        predicted_tre_mm=document.predicted_tre_mm,
        landmarks=tuple(_pair(name, table) for name, table in document.landmarks.items()),
        linear=_array(document.linear),
        worst_tre_mm=document.worst_tre_mm,
        fle_mm=document.fle_mm,
        covariance=_array(document.covariance),
    )


def _pair(name: str, table: _Landmark) -> LandmarkPair:
    """Return a landmark pair from its table."""
    return LandmarkPair(
        name,
        np.array(table.box_mm),
        np.array(table.ct_mm),
        table.residual_mm,
        table.held_out_mm,
        _array(table.box_std_mm),
        _array(table.ct_std_mm),
    )


def _pair_table(pair: LandmarkPair) -> dict[str, Any]:
    """Return a landmark pair as TOML writes it."""
    return {
        "box_mm": pair.box_mm.tolist(),
        "ct_mm": pair.ct_mm.tolist(),
        "residual_mm": pair.residual_mm,
        "held_out_mm": pair.held_out_mm,
        "box_std_mm": _listed(pair.box_std_mm),
        "ct_std_mm": _listed(pair.ct_std_mm),
    }


def _array(values: Sequence[Any] | None) -> FloatArray | None:
    return None if values is None else np.array(values, dtype=np.float64)


def _listed(values: FloatArray | None) -> list[Any] | None:
    return None if values is None else list(values.tolist())


def _present(table: dict[str, Any]) -> dict[str, Any]:
    """Return the table without what is absent."""
    return {name: value for name, value in table.items() if value is not None}


def _first_fault(error: ValidationError) -> str:
    """Return the first fault that a document was found to have, with the key it is at."""
    first = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in first["loc"])
    if first["type"] == "missing":
        return f"{where} is missing"
    if first["type"] == "extra_forbidden":
        return f"{where} is not a key of this format; take it out"
    return f"{where} is wrong: {first['msg']} (found {first['input']!r:.60})"
