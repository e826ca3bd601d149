"""Reads and writes a heart folder: heart.toml, the GLB it names, and what lies beside it. Format: docs/formats.md."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from cathxr.core import ConfigError, DataError
from cathxr.heart.acoustic_codes import CHANNELS, Scale
from cathxr.heart.glb import node_names, read_glb
from cathxr.heart.model import AcousticFile, HeartFolder, HeartSource, Landmark, Opening, Structure
from cathxr.heart.volume import Technical

SCHEMA = "cathxr-heart/1"

_Text = Annotated[str, Field(min_length=1)]
_Key = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
_Point = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]
_Row = Annotated[list[FiniteFloat], Field(min_length=4, max_length=4)]
_FileName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-]*$")]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _Source(_Table):
    title: _Text
    authors: _Text
    url: _Text
    licence: _Text
    licence_url: str = ""
    changes: str = ""


class _Structure(_Table):
    name: _Text
    label: Annotated[int, Field(ge=1, le=65535)]
    node: _Text
    colour: Annotated[str, Field(pattern=r"^#[0-9a-f]{6}$")]
    opacity: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0
    volume_ml: Annotated[FiniteFloat, Field(gt=0.0)] | None = None


class _Opening(_Table):
    name: _Text
    structure: _Key
    centroid_mm: _Point
    normal: _Point
    diameter_mm: Annotated[FiniteFloat, Field(gt=0.0)]


class _Landmark(_Table):
    name: _Text
    position_mm: _Point


class _Scale(_Table):
    curve: Literal["square", "asinh"]
    unit: _Text
    high: FiniteFloat
    low: FiniteFloat = 0.0
    centre: Annotated[FiniteFloat, Field(gt=0.0)] = 1.0
    width: Annotated[FiniteFloat, Field(gt=0.0)] = 1.0


class _Acoustic(_Table):
    file: _FileName
    shape: Annotated[list[Annotated[int, Field(ge=1, le=512)]], Field(min_length=3, max_length=3)]
    ct_from_voxel: Annotated[list[_Row], Field(min_length=4, max_length=4)]
    table: _Text
    channels: dict[Literal["impedance", "scatter", "attenuation", "interface"], _Scale]


class _Technical(_Table):
    modality: _Text
    phase: str = ""
    kernel: str = ""
    slice_thickness_mm: Annotated[FiniteFloat, Field(gt=0.0)] | None = None
    tube_voltage_kv: Annotated[FiniteFloat, Field(gt=0.0)] | None = None
    contrast: bool | None = None
    remarks: list[str] = Field(default_factory=list)


class _Document(_Table):
    schema_name: Literal["cathxr-heart/1"] = Field(alias="schema")
    name: _Text
    mesh: _FileName
    labels: _FileName | None = None
    source: _Source
    structures: Annotated[dict[_Key, _Structure], Field(min_length=1)]
    openings: dict[_Key, _Opening] = Field(default_factory=dict)
    landmarks: dict[_Key, _Landmark] = Field(default_factory=dict)
    acoustic: _Acoustic | None = None
    technical: _Technical | None = None


def read_heart(path: Path | str) -> HeartFolder:
    """Return the heart folder at `path`, its heart.toml and its GLB checked against each other.

    Raises:
        DataError: the folder or a file is missing, or the GLB is damaged or lacks a structure's node.
        ConfigError: heart.toml is not TOML, or a key is missing, unknown, or has a value it cannot have.
    """
    folder = Path(path)
    toml = folder / "heart.toml"
    document = _checked(toml, _parsed(toml))
    _check_references(toml, document)
    glb = folder / document.mesh
    nodes = node_names(read_glb(glb)[0], glb)
    for key, structure in document.structures.items():
        if structure.node not in nodes:
            raise DataError(
                f"{glb} has no part named {structure.node!r}, which structures.{key} of heart.toml names; "
                f"it has {', '.join(nodes) or 'no parts'}."
            )
    labels = None if document.labels is None else folder / document.labels
    if labels is not None and not labels.is_file():
        raise DataError(f"{labels} is missing, though heart.toml names it; put it there or take `labels` out.")
    acoustic = None if document.acoustic is None else _acoustic(toml, folder, document.acoustic)
    registration = folder / "registration.toml"
    return HeartFolder(
        path=folder,
        name=document.name,
        source=HeartSource(**document.source.model_dump()),
        structures={key: Structure(key=key, **each.model_dump()) for key, each in document.structures.items()},
        openings={key: _opening(toml, key, each) for key, each in document.openings.items()},
        glb=glb,
        landmarks={
            key: Landmark(key, each.name, np.array(each.position_mm)) for key, each in document.landmarks.items()
        },
        labels=labels,
        registration=registration if registration.is_file() else None,
        acoustic=acoustic,
        technical=None if document.technical is None else _technical(document.technical),
    )


def heart_toml(heart: HeartFolder) -> str:
    """Return the text of the heart.toml that `read_heart` reads back as `heart`; the same heart gives the same text."""
    document: dict[str, Any] = {"schema": SCHEMA, "name": heart.name, "mesh": heart.glb.name}
    if heart.labels is not None:
        document["labels"] = heart.labels.name
    document["source"] = dict(vars(heart.source))
    document["structures"] = {key: _without_key(each) for key, each in heart.structures.items()}
    document["openings"] = {
        key: {
            "name": each.name,
            "structure": each.structure,
            "centroid_mm": each.centroid_mm.tolist(),
            "normal": np.round(each.normal, 6).tolist(),
            "diameter_mm": each.diameter_mm,
        }
        for key, each in heart.openings.items()
    }
    document["landmarks"] = {
        key: {"name": each.name, "position_mm": each.position_mm.tolist()} for key, each in heart.landmarks.items()
    }
    if heart.acoustic is not None:
        document["acoustic"] = _acoustic_table(heart.acoustic)
    if heart.technical is not None:
        said = {name: value for name, value in vars(heart.technical).items() if value not in (None, "", ())}
        document["technical"] = said | ({"remarks": list(said["remarks"])} if "remarks" in said else {})
    return tomli_w.dumps(document)


def _without_key(structure: Structure) -> dict[str, Any]:
    """Return a structure's fields as TOML writes them: without its key, and without what is absent."""
    return {name: value for name, value in vars(structure).items() if name != "key" and value is not None}


def _acoustic_table(acoustic: AcousticFile) -> dict[str, Any]:
    """Return heart.toml's table of the acoustic volume."""
    return {
        "file": acoustic.file.name,
        "shape": list(acoustic.shape),
        "ct_from_voxel": np.round(acoustic.ct_from_voxel, 9).tolist(),
        "table": acoustic.table,
        "channels": {channel: _scale_table(acoustic.scales[channel]) for channel in CHANNELS},
    }


def _scale_table(scale: Scale) -> dict[str, Any]:
    """Return a scale's table, without what its curve does not use."""
    unused = ("low", "centre", "width") if scale.curve == "square" else ()
    return {name: value for name, value in vars(scale).items() if name not in unused}


def _acoustic(toml: Path, folder: Path, table: _Acoustic) -> AcousticFile:
    """Return the acoustic volume's description from its table."""
    file = folder / table.file
    if not file.is_file():
        raise DataError(f"{file} is missing, though heart.toml names it; put it there or take [acoustic] out.")
    scales: dict[str, Scale] = {channel: Scale(**scale.model_dump()) for channel, scale in table.channels.items()}
    k, j, i = table.shape
    try:
        return AcousticFile(file, (k, j, i), np.array(table.ct_from_voxel), scales, table.table)
    except ValueError as error:
        raise ConfigError(f"{toml}: acoustic is wrong: {error}. The format is in docs/formats.md.") from error


def _technical(table: _Technical) -> Technical:
    """Return what is said about the series."""
    return Technical(**{**table.model_dump(), "remarks": tuple(table.remarks)})


def _parsed(path: Path) -> dict[str, Any]:
    """Return a TOML file's content."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise DataError(
            f"{path} cannot be read ({error.strerror}); give a heart folder, one that holds heart.toml."
        ) from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path} is not UTF-8 text; save it as UTF-8.") from error
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path} is not valid TOML: {error}.") from error


def _checked(path: Path, content: Mapping[str, Any]) -> _Document:
    """Return heart.toml's content with every key and value checked."""
    try:
        return _Document.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"] if part != "[key]")
        found = f" (found {first['input']!r:.60})" if first["type"] not in ("missing", "extra_forbidden") else ""
        what = {"missing": "is missing", "extra_forbidden": "is not a key of this format; take it out"}.get(
            first["type"], f"is wrong: {first['msg']}{found}"
        )
        raise ConfigError(f"{path}: {where} {what}. The format is in docs/formats.md.") from error


def _check_references(path: Path, document: _Document) -> None:
    """Refuse structures that share a label or a node, and openings of structures that are not there."""
    for what in ("label", "node"):
        values = [getattr(each, what) for each in document.structures.values()]
        for value in values:
            if values.count(value) > 1:
                raise ConfigError(f"{path}: two structures have the {what} {value!r}; give each its own.")
    for key, opening in document.openings.items():
        if opening.structure not in document.structures:
            raise ConfigError(
                f"{path}: openings.{key} belongs to the structure {opening.structure!r}, which is not there; "
                f"name one of {', '.join(document.structures)}."
            )
    twice = sorted(set(document.openings) & set(document.landmarks))
    if twice:
        raise ConfigError(f"{path}: {twice[0]!r} is both an opening and a landmark; give one another name.")


def _opening(path: Path, key: str, table: _Opening) -> Opening:
    """Return an opening from its table."""
    try:
        return Opening(
            key, table.name, table.structure, np.array(table.centroid_mm), np.array(table.normal), table.diameter_mm
        )
    except ValueError as error:
        raise ConfigError(f"{path}: openings.{key} is wrong: {error}.") from error
