"""rig.toml: what the example says, what may be left out, and one sentence for every mistake."""

import json
import re

import numpy as np
import pytest

from cathxr.core import ConfigError, DataError, Provenance, Rig, RigCamera
from cathxr.storage.rig_file import (
    example_rig,
    example_rig_text,
    read_rig,
    rig_from_text,
    rig_to_text,
    write_rig,
)

EXAMPLE = example_rig_text()


def changed(old, new, *, count=1):
    assert old in EXAMPLE
    return EXAMPLE.replace(old, new, count)


def without_table(header):
    """The example without the table `header`: from its line to the next table's."""
    pattern = re.compile(rf"^\[{re.escape(header)}\].*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)
    assert pattern.search(EXAMPLE)
    return pattern.sub("", EXAMPLE, count=1)


def test_the_example_is_the_architectures():
    rig = example_rig()
    assert rig.name == "example box"
    assert rig.cameras["top"].size_px == (1280, 720)
    assert rig.cameras["top"].rate_hz == 60.0
    assert rig.cameras["front"].intrinsics.distortion.tolist() == [-0.18, 0.06, 0.0, 0.0, 0.0]
    assert rig.cameras["front"].camera_from_box.translation_mm.tolist() == [-60.0, 0.0, 330.0]
    # The front camera looks along +y from the -y side, with box +z upwards in its picture (-y of the camera).
    assert np.allclose(rig.cameras["front"].camera_from_box.turn(np.array([0.0, 1.0, 0.0])), [0.0, 0.0, 1.0])
    assert np.allclose(rig.cameras["front"].camera_from_box.turn(np.array([0.0, 0.0, 1.0])), [0.0, -1.0, 0.0])
    assert [marker.name for marker in rig.markers["top"]] == ["mT1", "mT2", "mT3", "mT4"]
    assert rig.markers["front"][2].position_mm.tolist() == [120.0, 0.0, 60.0]
    assert rig.markers["front"][2].colour == "blue"
    assert rig.roll is not None
    assert (rig.roll.counts_per_turn, rig.roll.gear_ratio, rig.roll.direction, rig.roll.zero_count) == (2400, 2, 1, 0)


@pytest.mark.parametrize("header", ["roll", "markers.front", "markers.top"])
def test_optional_tables_may_be_absent(header):
    rig = rig_from_text(without_table(header))
    assert rig_to_text(rig_from_text(rig_to_text(rig))) == rig_to_text(rig)
    assert (rig.roll is None) == (header == "roll")
    assert set(rig.markers) == {"top", "front"} - {header.removeprefix("markers.")}


def test_every_optional_key_is_read():
    text = (
        changed("diameter_mm = 3.0", 'diameter_mm = 3.0\ntransducer_offset_mm = 8.0\nsector_deg = 90\n'
                "diameter_mm_std = 0.05")
        .replace(
            "distortion = [-0.18, 0.06, 0.0, 0.0, 0.0]",
            "distortion = [-0.18, 0.06, 0.0, 0.0, 0.0]\nstd = { focal_px = 1.5, centre_px = [0.4, 0.3] }\n"
            'rms_px = 0.21\nn = 24\ndate = 2025-05-08\nmethod = "ChArUco"',
            1,
        )
        .replace(
            "translation_mm = [-60.0, 0.0, 330.0]",
            "translation_mm = [-60.0, 0.0, 330.0]\ncovariance = ["
            + ",".join(str([1e-4 * (i == j) for j in range(6)]) for i in range(6))
            + "]",
            1,
        )
        .replace('colour = "red" }', 'colour = "red", std = 0.1, date = "2025-05-09" }', 1)
        .replace("zero_count = 0", "zero_count = 0\nbacklash_deg = 0.4\ntorsion_deg_per_mm = 0.01\n"
                 "torsion_deg_per_quarter_bend = 2.0\nstd = { backlash_deg = 0.1 }")
        + "[timing]\ntop_latency_s = 0.012\nfront_latency_s = 0.013\n"
        "encoder_latency_s = 0.001\nfront_offset_s = 0.002\nfront_readout_s = 0.016\n"
    )  # fmt: skip
    rig = rig_from_text(text)
    assert (rig.catheter.transducer_offset_mm, rig.catheter.sector_deg) == (8.0, 90.0)
    assert rig.catheter.provenance.std["diameter_mm"] == 0.05
    found = rig.cameras["top"].intrinsics.provenance
    assert found.std["focal_px"].tolist() == [1.5, 1.5]
    assert found.std["centre_px"].tolist() == [0.4, 0.3]
    assert (found.rms_px, found.n, found.date, found.method) == (0.21, 24, "2025-05-08", "ChArUco")
    covariance = rig.cameras["top"].pose_provenance.covariance
    assert covariance is not None
    assert np.array_equal(covariance, 1e-4 * np.eye(6))
    assert rig.markers["top"][0].provenance.std["position_mm"].tolist() == [0.1, 0.1, 0.1]
    assert rig.markers["top"][0].provenance.date == "2025-05-09"
    assert rig.roll is not None
    assert (rig.roll.backlash_deg, rig.roll.torsion_deg_per_mm, rig.roll.torsion_deg_per_quarter_bend) == (0.4, 0.01, 2)
    assert rig.roll.provenance.std["backlash_deg"] == 0.1
    assert rig.timing.front_latency_s == 0.013
    assert rig.timing.front_offset_s == 0.002
    assert (rig.timing.top_readout_s, rig.timing.front_readout_s) == (0.0, 0.016)
    assert "top_readout_s" not in rig_to_text(rig)
    assert rig_to_text(rig_from_text(rig_to_text(rig))) == rig_to_text(rig)


TOP_FOCAL = "focal_px = [1357.7, 1357.7]"
TOP_TURN = "rotation_wxyz = [0.0, 1.0, 0.0, 0.0]"
# Standard deviations 0.01 rad and mm; 1 px, 0.01 and 1e-4 for k1, k2, k3 and p1, p2.
POSE = (1e-4 * np.eye(6)).tolist()
LENS = np.diag([1.0, 1.0, 1.0, 1.0, 1e-4, 1e-4, 1e-8, 1e-8, 1e-4]).tolist()
NONE = np.zeros((6, 9)).tolist()
# p1 and p2 with a correlation of 3.
WRONG_LENS = (np.array(LENS) + np.pad([[0.0, 3e-8], [3e-8, 0.0]], ((6, 1), (6, 1)))).tolist()


def with_entry(matrix, row, column, value):
    """A matrix with one other entry."""
    changed_one = np.array(matrix)
    changed_one[row, column] = value
    return str(changed_one.tolist())


MISTAKES = {
    "wrong schema": (changed("cathxr-rig/1", "cathxr-rig/2"), "schema", "cathxr-rig/1"),
    "no schema": (changed('schema = "cathxr-rig/1"', ""), "schema", "add it"),
    "schema not text": (changed('"cathxr-rig/1"', "1"), "schema", "cathxr-rig/1"),
    "unknown key at the top": (changed("name =", "colour = 1\nname ="), "colour", "unknown"),
    "unknown key in a camera": (changed("rate_hz = 60.0", "rate_hz = 60.0\nfps = 60"), "cameras.top.fps", "unknown"),
    "a readout longer than a picture": (
        EXAMPLE + "\n[timing]\ntop_readout_s = 16.0\n", "timing.top_readout_s", "at most 0.1"
    ),
    "unknown key in a marker": (changed('"red" }', '"red", size = 2 }'), "markers.top.mT1.size", "unknown"),
    "unknown table": (EXAMPLE + "\n[extra]\n", "extra", "unknown"),
    "third camera": (EXAMPLE + "\n[cameras.side]\nrate_hz = 1\n", "cameras.side", "unknown"),
    "third marker group": (EXAMPLE + "\n[markers.side]\n", "markers.side", "unknown"),
    "missing top": (EXAMPLE.replace("cameras.top", "cameras.left"), "cameras.top", "add it"),
    "missing intrinsics": (without_table("cameras.front.intrinsics"), "cameras.front.intrinsics", "add it"),
    "missing pose": (without_table("cameras.top.camera_from_box"), "cameras.top.camera_from_box", "add it"),
    "missing roi": (without_table("roi"), "roi", "add it"),
    "missing catheter": (without_table("catheter"), "catheter", "add it"),
    "missing key": (changed("gear_ratio", "#"), "roll.gear_ratio", "add it"),
    "not a unit quaternion": (changed(TOP_TURN, "rotation_wxyz = [0.0, 1.1, 0.0, 0.0]"), "rotation_wxyz", "length 1.1"),
    "zero quaternion": (changed(TOP_TURN, "rotation_wxyz = [0, 0, 0, 0]"), "rotation_wxyz", "length 0"),
    "quaternion too short": (changed(TOP_TURN, "rotation_wxyz = [0.0, 1.0, 0.0]"), "rotation_wxyz", "4 finite numbers"),
    "wrong length": (changed(TOP_FOCAL, "focal_px = [1.0, 1.0, 1.0]"), "cameras.top.intrinsics.focal_px", "list of 3"),
    "a number for a list": (changed(TOP_FOCAL, "focal_px = 1357.7"), "focal_px", "2 finite numbers"),
    "text for a number": (changed("diameter_mm = 3.0", 'diameter_mm = "3"'), "catheter.diameter_mm", "the text '3'"),
    "bool for a number": (changed("rate_hz = 60.0", "rate_hz = true"), "cameras.top.rate_hz", "got true"),
    "bool in a list": (changed(TOP_FOCAL, "focal_px = [1357.7, true]"), "focal_px", "holding true"),
    "bool in a size": (changed("[1280, 720]", "[1280, true]"), "size_px", "whole numbers"),
    "bool for a direction": (changed("direction = 1 ", "direction = true "), "roll.direction", "1 or -1"),
    "size in fractions": (changed("[1280, 720]", "[1280.5, 720]"), "size_px", "whole numbers"),
    "nan": (changed("centre_px = [640.0", "centre_px = [nan"), "centre_px", "finite"),
    "infinity": (changed("rate_hz = 60.0", "rate_hz = inf"), "rate_hz", "inf"),
    "huge integer": (changed("rate_hz = 60.0", f"rate_hz = 1{'0' * 400}"), "rate_hz", "number"),
    "negative focal": (changed(TOP_FOCAL, "focal_px = [-1.0, 5.0]"), "focal_px", "greater than 0"),
    "roi inside out": (changed("max_mm = [120.0", "max_mm = [-1.0"), "roi.max_mm", "more than min_mm"),
    "direction": (changed("direction = 1 ", "direction = 2 "), "roll.direction", "1 or -1"),
    "zero direction": (changed("[0.0, -1.0, 0.0]", "[0.0, -2.0, 0.0]"), "roll.zero_direction", "length 2"),
    "counts": (changed("counts_per_turn = 2400", "counts_per_turn = 0"), "counts_per_turn", "greater than 0"),
    "table for text": (changed('name = "9F ICE"', "name = {}"), "catheter.name", "text"),
    "text for a table": (changed("[roll]", 'roll2 = 1\n[roll]').replace("[roll]", "[roll.roll]"), "roll", ""),
    "broken toml": (changed("[roi]", "[roi"), "rig.toml", "TOML"),
    "key twice": (changed("gear_ratio = 2.0", "gear_ratio = 2.0\ngear_ratio = 3.0"), "rig.toml", "TOML"),
    "empty text": ("", "schema", "add it"),
    "std of nothing": (changed("zero_count = 0", "zero_count = 0\nbacklash_deg_std = 1"), "backlash_deg_std", "beside"),
    "std not keyed": (changed(TOP_FOCAL, TOP_FOCAL + "\nstd = 0.1"), "cameras.top.intrinsics.std", "several"),
    "std of an unknown": (changed(TOP_FOCAL, TOP_FOCAL + "\nstd = { f = 1 }"), "intrinsics.std.f", "unknown"),
    "std twice": (changed(TOP_FOCAL, TOP_FOCAL + "\nfocal_px_std = 1\nstd = { focal_px = 1 }"), "focal_px_std", "two"),
    "std negative": (changed('"red" }', '"red", std = -1.0 }'), "markers.top.mT1.std", "at least 0"),
    "std bool": (changed('"red" }', '"red", std = true }'), "markers.top.mT1.std", "got true"),
    "n in fractions": (changed(TOP_FOCAL, TOP_FOCAL + "\nn = 2.5"), "intrinsics.n", "whole number"),
    "covariance shape": (changed(TOP_TURN, TOP_TURN + "\ncovariance = [[1.0]]"), "covariance", "6 rows"),
    "covariance not on the catheter": (
        changed("diameter_mm = 3.0", "diameter_mm = 3.0\ncovariance = []"), "catheter.covariance", "unknown"
    ),
    "lens covariance shape": (changed(TOP_FOCAL, TOP_FOCAL + "\ncovariance = []"), "intrinsics.covariance", "9 rows"),
    "lens covariance of a pose": (
        changed(TOP_FOCAL, TOP_FOCAL + f"\ncovariance = {np.eye(6).tolist()}"), "intrinsics.covariance", "9 rows"
    ),
    "lens covariance asymmetric": (
        changed(TOP_FOCAL, TOP_FOCAL + f"\ncovariance = {with_entry(LENS, 0, 8, 1e-4)}"),
        "intrinsics.covariance", "focal x y, centre x y",
    ),
    "lens covariance asymmetric in small numbers": (
        changed(TOP_FOCAL, TOP_FOCAL + f"\ncovariance = {with_entry(LENS, 6, 7, 1e-8)}"),
        "intrinsics.covariance", "symmetric",
    ),
    "lens covariance not positive": (
        changed(TOP_FOCAL, TOP_FOCAL + f"\ncovariance = {WRONG_LENS}"),
        "intrinsics.covariance", "positive semi-definite",
    ),
    "cross shape": (
        changed(TOP_TURN, TOP_TURN + f"\ncovariance = {POSE}\ncovariance_with_intrinsics = {POSE}"),
        "camera_from_box.covariance_with_intrinsics", "6 rows of 9",
    ),
    "cross nan": (
        changed(
            TOP_TURN, TOP_TURN + f"\ncovariance = {POSE}\ncovariance_with_intrinsics = {with_entry(NONE, 0, 0, np.nan)}"
        ),
        "camera_from_box.covariance_with_intrinsics", "finite",
    ),
    "cross without a pose's covariance": (
        changed(TOP_TURN, TOP_TURN + f"\ncovariance_with_intrinsics = {NONE}"),
        "camera_from_box.covariance_with_intrinsics", "beside it",
    ),
    "cross with an exact lens": (
        changed(
            TOP_TURN, TOP_TURN + f"\ncovariance = {POSE}\ncovariance_with_intrinsics = {with_entry(NONE, 0, 0, 1e-9)}"
        ),
        "camera_from_box.covariance_with_intrinsics", "fits",
    ),
    "cross larger than both allow": (
        changed(
            TOP_TURN, TOP_TURN + f"\ncovariance = {POSE}\ncovariance_with_intrinsics = {with_entry(NONE, 0, 0, 1.1e-2)}"
        ).replace(TOP_FOCAL, TOP_FOCAL + f"\ncovariance = {LENS}", 1),
        "camera_from_box.covariance_with_intrinsics", "fits",
    ),
    "covariance not positive": (
        changed(TOP_TURN, TOP_TURN + "\ncovariance = "
                + str([[1.0 if i == j else 2.0 * (i + j == 1) for j in range(6)] for i in range(6)])),
        "covariance",
        "positive semi-definite",
    ),
    "covariance asymmetric": (
        changed(TOP_TURN, TOP_TURN + "\ncovariance = "
                + str([[float(i == j or (i, j) == (0, 1)) for j in range(6)] for i in range(6)])),
        "covariance",
        "symmetric",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_one_sentence_with_its_place(case):
    text, place, says = MISTAKES[case]
    with pytest.raises(ConfigError) as caught:
        rig_from_text(text)
    sentence = str(caught.value)
    assert sentence.startswith("rig.toml: ")
    assert place in sentence
    assert says in sentence
    assert sentence.endswith(".")
    assert "\n" not in sentence
    assert len(sentence) < 400


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "no such file"),
        (b"", "empty"),
        (b"  \n", "empty"),
        (b"\xff\xfe\x00s", "UTF-8"),
        (b"x" * 4_000_001, "4 MB"),
        (b"\x89PNG\r\n\x1a\n\x00", "UTF-8"),
    ],
)
def test_a_file_that_is_no_rig(tmp_path, content, says):
    path = tmp_path / "rig.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError, match=re.escape(says)) as caught:
        read_rig(path)
    assert str(path) in str(caught.value)


def test_a_folder_is_no_rig(tmp_path):
    with pytest.raises(ConfigError, match="folder"):
        read_rig(tmp_path)


def test_windows_line_ends_and_byte_order_mark_are_fine(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_bytes(b"\xef\xbb\xbf" + EXAMPLE.replace("\n", "\r\n").encode())
    assert rig_to_text(read_rig(path)) == rig_to_text(example_rig())


def test_writing_keeps_a_backup_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "rig.toml"
    write_rig(path, example_rig(), backup=True)
    first = path.read_bytes()
    for _ in range(2):
        write_rig(path, rig_from_text(changed("example box", "second box")), backup=True)
    assert (tmp_path / "rig.toml.bak").read_bytes() == first
    assert sorted(each.name for each in tmp_path.iterdir()) == ["rig.toml", "rig.toml.bak", "rig.toml.bak2"]
    assert b"\r" not in path.read_bytes()


def test_writing_where_there_is_no_folder_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match="cannot write"):
        write_rig(tmp_path / "none" / "rig.toml", example_rig())


def test_what_rig_toml_cannot_say_is_refused(tmp_path):
    rig = example_rig()
    top = rig.cameras["top"]
    third = Rig(rig.name, rig.roi, rig.catheter, {**rig.cameras, "side": top})
    with pytest.raises(ConfigError, match=r"cameras\.side"):
        write_rig(tmp_path / "rig.toml", third)
    wrong = RigCamera("top", top.size_px, 60.0, top.intrinsics, top.camera_from_box, Provenance(rms_px=float("nan")))
    with pytest.raises(ConfigError, match="finite"):
        write_rig(tmp_path / "rig.toml", Rig(rig.name, rig.roi, rig.catheter, {**rig.cameras, "top": wrong}))
    assert list(tmp_path.iterdir()) == []


def test_a_lens_and_its_pose_keep_their_covariances():
    cross = with_entry(NONE, 0, 0, 0.5e-2)
    rig = rig_from_text(
        changed(TOP_TURN, TOP_TURN + f"\ncovariance = {POSE}\ncovariance_with_intrinsics = {cross}").replace(
            TOP_FOCAL, TOP_FOCAL + f"\ncovariance = {LENS}", 1
        )
    )
    again = rig_from_text(rig_to_text(rig)).cameras["top"]
    np.testing.assert_array_equal(again.intrinsics.provenance.covariance, LENS)
    np.testing.assert_array_equal(again.pose_provenance.covariance_with_intrinsics, json.loads(cross))
    assert rig.cameras["front"].pose_provenance.covariance_with_intrinsics is None


def test_a_pose_may_state_its_relation_to_a_lens_that_states_only_std():
    cross = with_entry(NONE, 0, 0, 0.5e-2)
    text = changed(TOP_TURN, TOP_TURN + f"\ncovariance = {POSE}\ncovariance_with_intrinsics = {cross}")
    rig = rig_from_text(text.replace(TOP_FOCAL, TOP_FOCAL + "\nstd = { focal_px = 1.0 }", 1))
    assert rig.cameras["top"].pose_provenance.covariance_with_intrinsics is not None


def test_a_rig_without_covariances_is_written_without_them():
    assert "covariance" not in rig_to_text(example_rig())
