"""rig.toml: what was measured about one vision box. Reads it with checks, writes it back to the last bit."""

import os
from importlib import resources
from pathlib import Path

from cathxr.core import (
    LONGEST_READOUT_S,
    Catheter,
    ConfigError,
    Intrinsics,
    Marker,
    Pose,
    Provenance,
    Rig,
    RigCamera,
    Roi,
    Roll,
    Timing,
)
from cathxr.storage.atomic import written_whole
from cathxr.storage.rig_provenance import INTRINSICS, POSE, check_joint, read_provenance
from cathxr.storage.rig_text import rig_tables
from cathxr.storage.toml_table import Table, parsed, read_text
from cathxr.storage.toml_text import table_text

SCHEMA = "cathxr-rig/1"
_CAMERAS = ("top", "front")


def read_rig(path: str | os.PathLike[str]) -> Rig:
    """Return the rig of a rig.toml file.

    Raises:
        ConfigError: one sentence with the file, the key's path, what was expected, and what to do.
    """
    return rig_from_text(read_text(Path(path), what="a rig (rig.toml)"), name=str(path))


def write_rig(path: str | os.PathLike[str], rig: Rig, *, backup: bool = False) -> None:
    """Write `rig` to `path`, whole or not at all. With `backup`, an earlier file stays as rig.toml.bak, .bak2, ...

    Raises:
        ConfigError: the rig holds what rig.toml cannot say, such as a third camera; DataError: it cannot be written.
    """
    text = rig_to_text(rig)
    with written_whole(Path(path), backup=backup) as part:
        part.write_bytes(text.encode("utf-8"))


def rig_to_text(rig: Rig) -> str:
    """Return `rig` as the text of rig.toml; `rig_from_text` gives the same rig back, bit for bit.

    Raises:
        ConfigError: the rig holds what rig.toml cannot say.
    """
    try:
        text = "".join(_spaced(path) + table_text(path, values) for path, values in rig_tables(rig, SCHEMA))
    except ValueError as error:
        raise ConfigError(f"rig {rig.name!r}: {error}; correct that value before writing the rig.") from error
    rig_from_text(text, name=f"rig {rig.name!r}")
    return text


def rig_from_text(text: str, *, name: str = "rig.toml") -> Rig:
    """Return the rig of rig.toml's text; `name` is the file's name in the sentences.

    Raises:
        ConfigError: see `read_rig`.
    """
    return rig_from_table(Table(parsed(text, name=name), file=name))


def rig_from_table(root: Table) -> Rig:
    """Return the rig of a parsed document.

    Raises:
        ConfigError: see `read_rig`.
    """
    schema = root.asked("schema", example=f'schema = "{SCHEMA}"')
    if schema != SCHEMA:
        raise root.error(
            "schema",
            f'expected "{SCHEMA}", got {schema!r}; this program reads only that version: write schema = "{SCHEMA}".',
        )
    root.know("markers", "roll", "timing")
    name = root.text("name", example='name = "example box"', may_be_empty=True)
    roi = _roi(root.table("roi"))
    catheter = _catheter(root.table("catheter"))
    cameras = root.table("cameras")
    each_camera = {camera: _camera(cameras.table(camera), camera) for camera in _CAMERAS}
    cameras.finish()
    rig = Rig(
        name=name,
        roi=roi,
        catheter=catheter,
        cameras=each_camera,
        markers=_markers(root.table("markers")) if "markers" in root else {},
        roll=_roll(root.table("roll")) if "roll" in root else None,
        timing=_timing(root.table("timing")) if "timing" in root else Timing(),
    )
    root.finish()
    return rig


def example_rig_text() -> str:
    """Return the nominal example rig as the text of rig.toml, with comments."""
    return resources.files("cathxr.storage").joinpath("example_rig.toml").read_text(encoding="utf-8")


def example_rig() -> Rig:
    """Return the nominal example rig that ships with the package: two cameras, eight markers, an encoder."""
    return rig_from_text(example_rig_text(), name="example_rig.toml")


def _spaced(path: tuple[str, ...]) -> str:
    """Return the empty line before a table that begins a new subject."""
    return "\n" if path and len(path) < 3 else ""


def _roi(table: Table) -> Roi:
    low = table.vector("min_mm", 3, example="min_mm = [0.0, -60.0, -60.0]")
    high = table.vector("max_mm", 3, example="max_mm = [120.0, 60.0, 60.0]")
    table.finish()
    if not (high > low).all():
        raise table.error(
            "max_mm", f"expected more than min_mm on every axis, got {high.tolist()}; exchange or correct."
        )
    return Roi(low, high)


def _catheter(table: Table) -> Catheter:
    offset, sector = "transducer_offset_mm", "sector_deg"
    table.know(offset, sector)
    result = Catheter(
        name=table.text("name", example='name = "9F ICE"', may_be_empty=True),
        diameter_mm=table.number("diameter_mm", example="diameter_mm = 3.0", minimum=0.1, maximum=20.0),
        transducer_offset_mm=table.number(offset, example=f"{offset} = 8.0") if offset in table else None,
        sector_deg=(
            table.number(sector, example=f"{sector} = 90.0", above=0.0, maximum=360.0) if sector in table else None
        ),
        provenance=read_provenance(table, {"diameter_mm": 0, offset: 0, sector: 0}),
    )
    table.finish()
    return result


def _camera(table: Table, name: str) -> RigCamera:
    size = table.asked("size_px", example="size_px = [1280, 720]")
    whole = isinstance(size, list) and all(isinstance(each, int) and not isinstance(each, bool) for each in size)
    if not whole or len(size) != 2 or not all(16 <= each <= 16384 for each in size):
        raise table.error(
            "size_px", f"expected width and height, whole numbers from 16 to 16384, got {size}; as in [1280, 720]."
        )
    rate_hz = table.number("rate_hz", example="rate_hz = 60.0", above=0.0, maximum=1e6)
    intrinsics = _intrinsics(table.table("intrinsics"))
    placed = table.table("camera_from_box")
    pose, provenance = _pose(placed)
    check_joint(placed, provenance, intrinsics.provenance)
    table.finish()
    return RigCamera(name, (size[0], size[1]), rate_hz, intrinsics, pose, provenance)


def _intrinsics(table: Table) -> Intrinsics:
    focal = table.vector("focal_px", 2, example="focal_px = [1357.7, 1357.7]")
    if (focal <= 0).any():
        raise table.error("focal_px", f"expected two numbers greater than 0, got {focal.tolist()}; correct them.")
    centre = table.vector("centre_px", 2, example="centre_px = [640.0, 360.0]")
    distortion = table.vector("distortion", 5, example="distortion = [0.0, 0.0, 0.0, 0.0, 0.0] (k1 k2 p1 p2 k3)")
    provenance = read_provenance(table, {"focal_px": 2, "centre_px": 2, "distortion": 5}, covariance_of=INTRINSICS)
    table.finish()
    return Intrinsics(focal, centre, distortion, provenance)


def _pose(table: Table) -> tuple[Pose, Provenance]:
    quaternion = table.vector("rotation_wxyz", 4, example="rotation_wxyz = [0.0, 1.0, 0.0, 0.0]")
    translation = table.vector("translation_mm", 3, example="translation_mm = [-60.0, 0.0, 330.0]")
    provenance = read_provenance(table, {"rotation_wxyz": 4, "translation_mm": 3}, covariance_of=POSE)
    table.finish()
    try:
        return Pose(quaternion, translation), provenance
    except ValueError as error:
        length = float((quaternion @ quaternion) ** 0.5)
        raise table.error(
            "rotation_wxyz",
            f"expected a unit quaternion w x y z (length 1 within 0.001), got length {length:.6g}; "
            "check the four numbers and their order.",
        ) from error


def _markers(table: Table) -> dict[str, tuple[Marker, ...]]:
    table.know(*_CAMERAS)
    result = {}
    for camera in _CAMERAS:
        if camera in table:
            group = table.table(camera)
            result[camera] = tuple(_marker(group.table(name), name) for name in group.values)
    table.finish()
    return result


def _marker(table: Table, name: str) -> Marker:
    position = table.vector("position_mm", 3, example="position_mm = [0.0, -60.0, 0.0]")
    colour = table.text("colour", example='colour = "red"')
    provenance = read_provenance(table, {"position_mm": 3})
    table.finish()
    return Marker(name, position, colour, provenance)


def _roll(table: Table) -> Roll:
    optional = ("backlash_deg", "torsion_deg_per_mm", "torsion_deg_per_quarter_bend")
    table.know("zero_direction", *optional)
    counts = table.number("counts_per_turn", example="counts_per_turn = 2400", above=0.0)
    gear = table.number("gear_ratio", example="gear_ratio = 2.0", above=0.0)
    direction = table.asked("direction", example="direction = 1")
    if isinstance(direction, bool) or direction not in (1, -1):
        raise table.error("direction", f"expected 1 or -1, got {direction!r}; -1 where the gears reverse the sense.")
    zero_count = table.number("zero_count", example="zero_count = 0")
    zero = Roll(counts).zero_direction
    if "zero_direction" in table:
        zero = table.vector("zero_direction", 3, example="zero_direction = [0.0, -1.0, 0.0]")
    backlash = table.number(optional[0], example="backlash_deg = 0.5", minimum=0.0) if optional[0] in table else None
    torsion = [table.number(key, example=f"{key} = 0.02") if key in table else None for key in optional[1:]]
    measured = {
        "counts_per_turn": 0,
        "gear_ratio": 0,
        "zero_count": 0,
        "zero_direction": 3,
        **dict.fromkeys(optional, 0),
    }
    provenance = read_provenance(table, measured)
    table.finish()
    try:
        return Roll(counts, gear, int(direction), zero_count, zero, backlash, torsion[0], torsion[1], provenance)
    except ValueError as error:
        length = float((zero @ zero) ** 0.5)
        raise table.error(
            "zero_direction",
            f"expected a vector of length 1 (within 0.001), got length {length:.6g}; as in [0.0, -1.0, 0.0].",
        ) from error


def _timing(table: Table) -> Timing:
    keys = ("top_latency_s", "front_latency_s", "encoder_latency_s", "front_offset_s")
    readouts = ("top_readout_s", "front_readout_s")
    table.know(*keys, *readouts)
    values = {key: table.number(key, example=f"{key} = 0.012") for key in keys if key in table}
    for key in readouts:
        if key in table:
            values[key] = table.number(key, example=f"{key} = 0.016", minimum=0.0, maximum=LONGEST_READOUT_S)
    provenance = read_provenance(table, dict.fromkeys((*keys, *readouts), 0))
    table.finish()
    return Timing(**values, provenance=provenance)
