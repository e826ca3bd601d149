"""A Rig as the tables of rig.toml, in the order a person reads them."""

from collections.abc import Iterator
from typing import Any

from cathxr.core import Rig, RigCamera, Roll, Timing
from cathxr.storage.rig_provenance import provenance_values

_Part = tuple[tuple[str, ...], dict[str, Any]]


def rig_tables(rig: Rig, schema: str) -> Iterator[_Part]:
    """Yield each table's path and values; joined as text they are rig.toml.

    Raises:
        ValueError: the rig names a marker twice.
    """
    yield (), {"schema": schema, "name": rig.name}
    yield ("roi",), {"min_mm": rig.roi.min_mm.tolist(), "max_mm": rig.roi.max_mm.tolist()}
    yield ("catheter",), _catheter(rig)
    for name, camera in rig.cameras.items():
        yield from _camera(name, camera)
    for name, markers in rig.markers.items():
        values: dict[str, Any] = {}
        for marker in markers:
            if marker.name in values:
                raise ValueError(f"markers.{name}: expected each name once, got {marker.name!r} twice")
            values[marker.name] = {"position_mm": marker.position_mm.tolist(), "colour": marker.colour}
            values[marker.name].update(provenance_values(marker.provenance, 1))
        yield ("markers", name), values
    if rig.roll is not None:
        yield ("roll",), _roll(rig.roll)
    timing = _timing(rig.timing)
    if repr(timing) != repr(_timing(Timing())):
        yield ("timing",), timing


def _catheter(rig: Rig) -> dict[str, Any]:
    catheter = rig.catheter
    values: dict[str, Any] = {"diameter_mm": float(catheter.diameter_mm)}
    for key in ("transducer_offset_mm", "sector_deg"):
        value = getattr(catheter, key)
        if value is not None:
            values[key] = float(value)
    return {"name": catheter.name, **values, **provenance_values(catheter.provenance, len(values))}


def _camera(name: str, camera: RigCamera) -> Iterator[_Part]:
    yield ("cameras", name), {"size_px": [int(each) for each in camera.size_px], "rate_hz": float(camera.rate_hz)}
    intrinsics = camera.intrinsics
    yield (
        ("cameras", name, "intrinsics"),
        {
            "focal_px": intrinsics.focal_px.tolist(),
            "centre_px": intrinsics.centre_px.tolist(),
            "distortion": intrinsics.distortion.tolist(),
            **provenance_values(intrinsics.provenance, 3),
        },
    )
    pose = camera.camera_from_box
    yield (
        ("cameras", name, "camera_from_box"),
        {
            "rotation_wxyz": pose.rotation_wxyz.tolist(),
            "translation_mm": pose.translation_mm.tolist(),
            **provenance_values(camera.pose_provenance, 2),
        },
    )


def _roll(roll: Roll) -> dict[str, Any]:
    values: dict[str, Any] = {
        "counts_per_turn": _count(roll.counts_per_turn),
        "gear_ratio": float(roll.gear_ratio),
        "direction": int(roll.direction),
        "zero_count": _count(roll.zero_count),
        "zero_direction": roll.zero_direction.tolist(),
    }
    for key in ("backlash_deg", "torsion_deg_per_mm", "torsion_deg_per_quarter_bend"):
        value = getattr(roll, key)
        if value is not None:
            values[key] = float(value)
    return {**values, **provenance_values(roll.provenance, len(values))}


def _timing(timing: Timing) -> dict[str, Any]:
    keys = ("top_latency_s", "front_latency_s", "encoder_latency_s", "front_offset_s")
    readouts = {key: float(getattr(timing, key)) for key in ("top_readout_s", "front_readout_s")}
    values = {key: float(getattr(timing, key)) for key in keys} | {key: each for key, each in readouts.items() if each}
    return {**values, **provenance_values(timing.provenance, len(values))}


def _count(value: float) -> int | float:
    """Return a whole number of counts as an integer where that loses nothing (a float's sign of zero included)."""
    number = float(value)
    return int(number) if number.is_integer() and abs(number) < 2**53 and repr(number) != "-0.0" else number
