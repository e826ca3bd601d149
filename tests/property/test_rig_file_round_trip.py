"""Every rig that can be written is read back the same, to the last bit."""

import dataclasses
from types import MappingProxyType

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cathxr.core import (
    LONGEST_READOUT_S,
    Catheter,
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
from cathxr.storage.rig_file import rig_from_text, rig_to_text

number = st.floats(-1e6, 1e6)
size = st.floats(1e-6, 1e6)
spread = st.floats(0.0, 1e3)
text = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
named = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8)


def vectors(length, each=number):
    return st.lists(each, min_size=length, max_size=length).map(np.array)


def units(length):
    wide = vectors(length, st.floats(-1.0, 1.0)).filter(lambda each: np.linalg.norm(each) > 1e-3)
    return wide.map(lambda each: each / np.linalg.norm(each))


def positive(root):
    """A covariance whose upper and lower half are the same to the last bit."""
    product = root @ root.T
    return (product + product.T) / 2


@st.composite
def provenances(draw, measured):
    names = draw(st.lists(st.sampled_from(sorted(measured)), unique=True))
    std = {name: draw(vectors(measured[name], spread) if measured[name] else spread.map(np.array)) for name in names}
    return Provenance(
        std=MappingProxyType(std),
        rms_px=draw(st.none() | spread),
        n=draw(st.none() | st.integers(0, 10**6)),
        date=draw(st.none() | text),
        method=draw(st.none() | text),
    )


@st.composite
def cameras(draw, name):
    measured = {"focal_px": 2, "centre_px": 2, "distortion": 5}
    of_lens, of_pose = draw(provenances(measured)), draw(provenances({"rotation_wxyz": 4, "translation_mm": 3}))
    if draw(st.booleans()):
        # Units from micro to kilo on each of the fifteen numbers, as radians beside pixels are.
        units_of_each = 10.0 ** draw(vectors(15, st.floats(-6.0, 3.0)))
        joint = positive(units_of_each[:, None] * draw(vectors(225, st.floats(-1.0, 1.0))).reshape(15, 15))
        of_pose = dataclasses.replace(of_pose, covariance=joint[:6, :6])
        if draw(st.booleans()):
            of_lens = dataclasses.replace(of_lens, covariance=joint[6:, 6:])
            of_pose = dataclasses.replace(of_pose, covariance_with_intrinsics=joint[:6, 6:])
    intrinsics = Intrinsics(draw(vectors(2, size)), draw(vectors(2)), draw(vectors(5)), of_lens)
    pose = Pose(draw(units(4)), draw(vectors(3)))
    sides = st.integers(16, 16384)
    return RigCamera(name, (draw(sides), draw(sides)), draw(size), intrinsics, pose, of_pose)


@st.composite
def rolls(draw):
    optional = [draw(st.none() | spread), draw(st.none() | number), draw(st.none() | number)]
    measured = {"counts_per_turn": 0, "gear_ratio": 0, "zero_count": 0, "zero_direction": 3}
    return Roll(
        draw(size), draw(size), draw(st.sampled_from([1, -1])), draw(number), draw(units(3)), *optional,
        draw(provenances(measured)),
    )  # fmt: skip


@st.composite
def rigs(draw):
    low = draw(vectors(3))
    markers = {}
    for camera in draw(st.lists(st.sampled_from(["top", "front"]), unique=True)):
        names = draw(st.lists(named, unique=True, max_size=3))
        each = provenances({"position_mm": 3})
        markers[camera] = tuple(Marker(name, draw(vectors(3)), draw(named), draw(each)) for name in names)
    timing = Timing(
        draw(number), draw(number), draw(number), draw(number),
        draw(provenances({"top_latency_s": 0, "front_offset_s": 0})),
        draw(st.floats(0.0, LONGEST_READOUT_S)), draw(st.floats(0.0, LONGEST_READOUT_S)),
    )  # fmt: skip
    catheter = Catheter(
        draw(text), draw(st.floats(0.1, 20.0)), draw(st.none() | number), draw(st.none() | st.floats(1.0, 360.0)),
        draw(provenances({"diameter_mm": 0})),
    )  # fmt: skip
    return Rig(
        draw(text), Roi(low, low + draw(vectors(3, st.floats(1.0, 1e6)))), catheter,
        {name: draw(cameras(name)) for name in ("top", "front")}, markers,
        draw(st.none() | rolls()), draw(st.just(Timing()) | st.just(timing)),
    )  # fmt: skip


def bits(value):
    """A value as plain nested data in which every float is its bits and every None stays one."""
    if dataclasses.is_dataclass(value):
        return {field.name: bits(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, dict | MappingProxyType):
        return {key: bits(each) for key, each in value.items()}
    if isinstance(value, tuple | list):
        return [bits(each) for each in value]
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, np.ndarray):
        return (value.shape, value.astype("<f8").tobytes())
    return value


@given(rigs())
@settings(max_examples=40, deadline=None)
def test_reading_what_was_written_gives_the_same_rig(rig):
    assert bits(rig_from_text(rig_to_text(rig))) == bits(rig)
