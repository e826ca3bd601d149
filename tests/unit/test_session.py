"""Sessions: what is written comes back to the last bit, whole, cut off, or after the process was killed."""

import os
import re
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from cathxr.core import (
    ConfigError,
    DataError,
    Detection,
    Event,
    Health,
    Image,
    Observation,
    Pose,
    Reading,
    Status,
    Track,
)
from cathxr.storage.rig_file import example_rig, rig_to_text
from cathxr.storage.session import Picture, SessionReader, SessionWriter, export_csv
from cathxr.storage.session_json import decoded, encoded, observation_json, track_json
from cathxr.storage.session_schemas import SCHEMAS, TOPICS
from cathxr.storage.track_csv import read_track_csv

RANDOM = np.random.default_rng(5)


def detection(camera, seq, t_ns, *, found=True):
    if not found:
        return Detection(camera, seq, t_ns, reason="no catheter", repeats=3)
    n = 160
    return Detection(
        camera, seq, t_ns, RANDOM.normal(600, 200, (n, 2)), RANDOM.normal(size=(n, 2)), RANDOM.random(n),
        RANDOM.random(n), RANDOM.normal(600, 200, 2), 0.1 * RANDOM.random(),
    )  # fmt: skip


def track(seq, t_ns, status=Status.TRACKED):
    if status is Status.LOST:
        return Track(seq, t_ns, status, 'no catheter, "really"')
    quaternion = RANDOM.normal(size=4)
    return Track(
        seq, t_ns, status, "" if status is Status.TRACKED else "only one view", RANDOM.normal(0, 50, (50, 3)),
        Pose(quaternion / np.linalg.norm(quaternion), RANDOM.normal(0, 50, 3)), RANDOM.normal(), RANDOM.random(), 12345,
        seq % 4 == 1,
    )  # fmt: skip


def pair_items(seq):
    t_ns = 1_000_000_000 + seq * 33_333_333
    both = (detection("top", seq, t_ns), detection("front", seq, t_ns + 99, found=seq % 3 != 2))
    status = (Status.TRACKED, Status.COASTING, Status.LOST)[seq % 3]
    return (
        Observation(seq, t_ns, both, 99, RANDOM.normal() if seq % 2 else None, seq % 4 == 1),
        track(seq, t_ns, status),
        track(seq, t_ns + 1),
    )


def new_writer(folder, *, videos=False, config=None):
    return SessionWriter(
        folder, rig=example_rig(), config=config or {}, clock_pair=(123, "2025-05-08T10:00:00Z"), videos=videos
    )


def same(a, b):
    """Equal to the last bit, through dataclasses, arrays and containers."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same(getattr(a, name), getattr(b, name)) for name in a.__dataclass_fields__)
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return a == b and type(a) is type(b)


@pytest.fixture
def recorded(tmp_path):
    """A session of 30 pairs and what went into it."""
    items = {topic: [] for topic in TOPICS}
    writer = new_writer(tmp_path / "session", config={"source": "twin", "seed": 3, "none": None, "path": Path("x")})
    for seq in range(30):
        for topic, value, write in zip(
            ("/observation", "/track", "/truth"),
            pair_items(seq),
            (writer.write_observation, writer.write_track, writer.write_truth),
            strict=True,
        ):
            items[topic].append(value)
            write(value)
        items["/reading"].append(Reading(seq, 1_000_000_000 + seq * 33_000_000, -17 * seq, 1, 2))
        writer.write_reading(items["/reading"][-1])
    items["/event"].append(Event(5_000_000_000, "steer", {"roll_deg": 0.1 + 0.2, "name": "µ", "list": [1, None]}))
    items["/health"].append(Health(5_000_000_001, "camera top", False, None, 29.7, 3, "unplugged"))
    writer.write_event(items["/event"][0])
    writer.write_health(items["/health"][0])
    writer.close()
    writer.close()
    return tmp_path / "session", items


@pytest.mark.parametrize("topic", ["/observation", "/track"])
def test_sessions_of_before_the_rolls_flag_are_read_as_not_predicted(topic):
    observation, track_, _ = pair_items(3)
    values = observation_json(observation) if topic == "/observation" else track_json(track_)
    assert values.pop("roll_predicted") is False
    back = decoded(topic, encoded(values))
    assert same(back, observation if topic == "/observation" else track_)


def test_everything_comes_back_to_the_last_bit(recorded):
    folder, items = recorded
    reader = SessionReader(folder)
    assert reader.is_whole
    for topic, method in (
        ("/observation", reader.observations),
        ("/track", reader.tracks),
        ("/truth", reader.truths),
        ("/reading", reader.readings),
        ("/event", reader.events),
        ("/health", reader.health),
    ):
        assert same(list(method()), items[topic]), topic
    everything = list(reader)
    assert len(everything) == sum(len(each) for each in items.values())
    instants = [each.value.t_ns for each in everything]
    assert instants == sorted(instants)


def test_the_description_comes_back(recorded):
    folder, _ = recorded
    reader = SessionReader(folder)
    assert rig_to_text(reader.rig) == rig_to_text(example_rig())
    assert reader.config == {"source": "twin", "seed": 3, "path": "x"}
    assert reader.clock_pair == (123, "2025-05-08T10:00:00Z")
    assert {"cathxr", "python", "packages"} <= set(reader.versions)
    assert reader.registration is None


def test_the_mcap_library_reads_it_with_schemas(recorded):
    folder, items = recorded
    with (folder / "session.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert {each.topic for each in summary.channels.values()} == set(SCHEMAS)
        assert {each.encoding for each in summary.schemas.values()} == {"jsonschema"}
        assert {each.message_encoding for each in summary.channels.values()} == {"json"}
        count = sum(1 for _ in reader.iter_messages(topics="/track"))
        assert count == len(items["/track"])


def test_out_of_order_instants_are_sorted_across_chunks(tmp_path):
    writer = new_writer(tmp_path / "s")
    instants = [100, 300, 200, 50, 400, 350]
    for index, t_ns in enumerate(instants):
        writer.write_reading(Reading(index, t_ns, 0))
        if index % 2:
            writer.flush()
    writer.close()
    assert [each.t_ns for each in SessionReader(tmp_path / "s").readings()] == sorted(instants)


def test_a_log_cut_anywhere_gives_what_came_before(tmp_path):
    writer = new_writer(tmp_path / "s")
    for seq in range(40):
        writer.write_reading(Reading(seq, seq, seq))
        if seq % 10 == 9:
            writer.flush()
    writer.close()
    log = tmp_path / "s" / "session.mcap"
    whole = log.read_bytes()
    counts = set()
    for cut in range(8, len(whole), 97):
        log.write_bytes(whole[:cut])
        reader = SessionReader(tmp_path / "s")
        assert not reader.is_whole
        seqs = [each.seq for each in reader.readings()]
        assert seqs == list(range(len(seqs)))
        counts.add(len(seqs))
    assert counts == {0, 10, 20, 30, 40}


def test_damage_in_the_middle_is_a_sentence(recorded):
    folder, _ = recorded
    log = folder / "session.mcap"
    whole = bytearray(log.read_bytes())
    for at in range(3000, 3200):
        whole[at] ^= 0x5A
    log.write_bytes(whole)
    with pytest.raises(DataError, match="damaged"):
        list(SessionReader(folder))


@pytest.mark.parametrize("content", [b"", b"no mcap at all"])
def test_a_log_of_something_else_is_a_sentence(recorded, content):
    folder, _ = recorded
    (folder / "session.mcap").write_bytes(content)
    with pytest.raises(DataError, match="expected an MCAP file"):
        SessionReader(folder)


def test_no_session_there_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match="expected a session folder"):
        SessionReader(tmp_path)


def test_an_unknown_key_in_the_description_is_a_sentence(recorded):
    folder, _ = recorded
    path = folder / "session.toml"
    path.write_text("extra = 1\n" + path.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(ConfigError, match="extra"):
        SessionReader(folder)


def test_an_existing_session_is_never_written_into(recorded):
    folder, items = recorded
    before = {each.name: each.read_bytes() for each in folder.iterdir()}
    with pytest.raises(DataError, match="choose another name"):
        new_writer(folder)
    assert {each.name: each.read_bytes() for each in folder.iterdir()} == before
    assert len(list(SessionReader(folder).tracks())) == len(items["/track"])


def test_a_disk_without_space_is_a_sentence(tmp_path):
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no /dev/full, the device whose disk is always full")
    writer = new_writer(tmp_path / "s")
    os.dup2(os.open(full, os.O_WRONLY), writer._stream.fileno())
    writer.write_observation(pair_items(0)[0])
    with pytest.raises(DataError, match="No space left"):
        writer.flush()
    with pytest.raises(DataError, match="No space left"):
        writer.write_reading(Reading(0, 0, 0))
    writer.close()


def test_a_folder_that_cannot_be_made_is_a_sentence(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(DataError, match="cannot write the session"):
        new_writer(tmp_path / "file" / "session")


def test_nan_is_refused(tmp_path):
    writer = new_writer(tmp_path / "s")
    with pytest.raises(ValueError, match="not JSON compliant"):
        writer.write_event(Event(0, "x", {"value": float("nan")}))
    writer.close()


@pytest.mark.parametrize("shape", [(48, 64), (48, 64, 3)])
def test_lossless_pictures_come_back_with_their_instants(tmp_path, shape):
    writer = new_writer(tmp_path / "s", videos=True)
    images = [Image("top", 7 + 2 * i, 1000 + i, RANDOM.integers(0, 256, shape, dtype=np.uint8)) for i in range(12)]
    for image in images:
        writer.write_image(image)
    writer.close()
    reader = SessionReader(tmp_path / "s")
    assert same(list(reader.images("top")), images)
    assert list(reader.images("front")) == []
    assert list(reader.pictures())[3] == Picture("top", 13, 1003, 3)


def test_without_videos_pictures_are_passed_over(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.write_image(Image("top", 0, 0, np.zeros((48, 64), dtype=np.uint8)))
    writer.close()
    assert sorted(each.name for each in (tmp_path / "s").iterdir()) == ["session.mcap", "session.toml"]


def test_a_camera_that_changes_its_size_is_a_sentence(tmp_path):
    writer = new_writer(tmp_path / "s", videos=True)
    writer.write_image(Image("top", 0, 0, np.zeros((48, 64), dtype=np.uint8)))
    with pytest.raises(DataError, match="changed its pictures"):
        writer.write_image(Image("top", 1, 1, np.zeros((50, 64), dtype=np.uint8)))
    writer.close()


def test_export_writes_the_track_table(recorded, tmp_path):
    folder, items = recorded
    out = tmp_path / "track.csv"
    assert export_csv(SessionReader(folder), out) == 30
    rows = read_track_csv(out)
    for row, each in zip(rows, items["/track"], strict=True):
        assert (row.seq, row.status, row.reason) == (each.seq, each.status, each.reason)
        if each.shape_box is not None:
            assert row.shape_box is not None
            assert np.abs(row.shape_box - each.shape_box).max() <= 0.5e-6 + 1e-12  # six decimals
    assert export_csv(SessionReader(folder), out, points=7) == 30
    shape = read_track_csv(out)[0].shape_box
    assert shape is not None
    assert len(shape) == 7


KILLED = """
    import sys, time
    import numpy as np
    from cathxr.core import Image, Reading
    from cathxr.storage.rig_file import example_rig
    from cathxr.storage.session import SessionWriter
    writer = SessionWriter(sys.argv[1], rig=example_rig(), config={}, clock_pair=(0, "now"), videos=True)
    noise = np.random.default_rng(0).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    seq = 0
    while True:
        now = time.monotonic_ns()
        writer.write_reading(Reading(seq, now, seq))
        if seq % 4 == 0:
            writer.write_image(Image("top", seq, now, np.roll(noise, seq, axis=1)))
        print(seq, now, flush=True)
        seq += 1
        time.sleep(0.01)
"""


def test_a_killed_recording_loses_at_most_its_last_second(tmp_path):
    folder = tmp_path / "killed"
    command = [sys.executable, "-c", textwrap.dedent(KILLED), str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        begun = int(first.split()[1])
        last = begun
        while last - begun < 2_500_000_000:
            last = int(process.stdout.readline().split()[1])
        process.kill()
        killed = time.monotonic_ns()
        rest = re.findall(r"^\d+ (\d+)$", process.stdout.read(), re.MULTILINE)
    last = max([last, *map(int, rest)])
    reader = SessionReader(folder)
    assert not reader.is_whole
    readings = list(reader.readings())
    assert [each.seq for each in readings] == list(range(len(readings)))
    assert readings[-1].t_ns >= last - 1_000_000_000
    images = list(reader.images("top"))
    assert images[-1].t_ns >= last - 1_000_000_000
    noise = np.random.default_rng(0).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    assert all(np.array_equal(each.pixels, np.roll(noise, each.seq, axis=1)) for each in images)
    assert killed > last
