"""`cathxr run`, `record`, `replay`, `export` and `track` as real processes on the twin."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from websockets.sync.client import connect

from cathxr.app.bench_live import live_process
from cathxr.storage.rig_file import example_rig, write_rig
from cathxr.storage.session import SessionReader
from cathxr.storage.track_csv import read_track_csv
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig

PAIRS = 6


def cathxr(*arguments: str, timeout_s: float = 240.0) -> subprocess.CompletedProcess[str]:
    """Run the command to its end."""
    command = [sys.executable, "-m", "cathxr", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session of three seconds, recorded from the twin by the command."""
    folder = tmp_path_factory.mktemp("recordings") / "first"
    done = cathxr("record", "--source", "twin", "--seconds", "3", "--out", str(folder))
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def live() -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A live system on the twin, with the truth published."""
    with live_process("--publish-truth") as process_and_port:
        yield process_and_port


def test_run_streams_tracks_that_lie_on_the_twins_truth(live: tuple[subprocess.Popen[str], int]) -> None:
    tips: dict[int, np.ndarray[tuple[int], np.dtype[np.float64]]] = {}
    truths = {}
    kinds = set()
    with connect(f"ws://127.0.0.1:{live[1]}/ws", compression=None) as link:
        deadline_s = time.monotonic() + 60.0
        while time.monotonic() < deadline_s and len(set(tips) & set(truths)) < 20:
            message = json.loads(link.recv(timeout=30))
            kinds.add(message["type"])
            if message["type"] == "track" and message["tip"] is not None:
                tips[message["seq"]] = np.array(message["tip"]["position"])
            elif message["type"] == "event" and message["kind"] == "truth":
                truths[message["payload"]["seq"]] = np.array(message["payload"]["tip"])
    assert {"hello", "session", "track", "event"} <= kinds
    errors = [float(np.linalg.norm(tips[seq] - truths[seq])) for seq in set(tips) & set(truths)]
    assert len(errors) >= 20
    assert np.mean(errors) < 0.5  # the target; measured 0.02 (docs/benchmarks.md)


def test_steering_moves_the_catheter_and_refusals_are_sentences(live: tuple[subprocess.Popen[str], int]) -> None:
    def ask(name: str, **args: object) -> None:
        link.send(json.dumps({"type": "command", "name": name, "args": args, "id": name}))

    def until(kind: str) -> dict[str, object]:
        for _ in range(3000):
            message: dict[str, object] = json.loads(link.recv(timeout=30))
            if message["type"] == kind and (kind != "event" or message["kind"] == "done"):
                return message
        raise AssertionError(f"no {kind} came")

    with connect(f"ws://127.0.0.1:{live[1]}/ws?protocol=1", compression=None) as link:
        ask("steer", insertion_mm=40.0, roll_deg=90.0, anterior_deg=0.0, left_deg=0.0)
        assert until("event")["payload"]["id"] == "steer"  # type: ignore[index]
        deadline_s = time.monotonic() + 60.0
        roll_deg, length_mm = np.nan, np.nan
        while time.monotonic() < deadline_s and not (abs(roll_deg - 90.0) < 0.5 and abs(length_mm - 40.0) < 0.5):
            message = until("track")
            if message["roll"] is not None and message["points"] is not None:
                roll_deg = np.degrees(float(message["roll"]))  # type: ignore[arg-type]
                length_mm = np.linalg.norm(np.diff(np.array(message["points"]), axis=0), axis=1).sum()
        # a count is 0.075 degrees, and the fit's entry is good to some tenths of a millimetre
        assert roll_deg == pytest.approx(90.0, abs=0.5)
        assert length_mm == pytest.approx(40.0, abs=0.5)
        ask("steer", insertion_mm=4000.0)
        assert "5 to 130" in str(until("refusal")["sentence"])
        ask("fly")
        assert "There is no command 'fly'" in str(until("refusal")["sentence"])
        ask("record_stop")
        assert "No recording runs" in str(until("refusal")["sentence"])


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for another process")
def test_ctrl_c_ends_run_cleanly_within_three_seconds() -> None:
    with live_process() as (process, _):
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        # the promise is three seconds; a machine shared with other work gets four times that
        said, _ = process.communicate(timeout=12.0)
    assert process.returncode == 0
    assert "Stopped." in said
    assert "Traceback" not in said


def test_recorded_session_has_truth_and_replays_bit_for_bit(session: Path) -> None:
    reader = SessionReader(session)
    tracks, truths = list(reader.tracks()), {each.seq: each for each in reader.truths()}
    assert reader.is_whole
    assert len(tracks) >= 5
    # the last truth follows its Track by a moment, in which the recording may have ended
    assert {each.seq for each in tracks[:-1]} <= set(truths)
    assert list(reader.readings())
    done = cathxr("replay", str(session), "--check")
    assert done.returncode == 0, done.stderr
    assert f"{len(tracks)} Tracks made anew" in done.stdout


def test_replay_serves_a_session_live(session: Path) -> None:
    command = [sys.executable, "-m", "cathxr", "replay", str(session), "--port", "0", "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout is not None
        found = next(filter(None, (re.search(r"http://127\.0\.0\.1:(\d+)", line) for line in process.stdout)))
        with connect(f"ws://127.0.0.1:{found.group(1)}/ws", compression=None) as link:
            hello = json.loads(link.recv(timeout=30))
            assert hello["source"] == "replay"
            for _ in range(200):
                message = json.loads(link.recv(timeout=30))
                if message["type"] == "track" and message["status"] == "tracked":
                    break
            assert message["status"] == "tracked"
    finally:
        process.kill()
        process.communicate()


def test_export_gives_the_track_table(session: Path, tmp_path: Path) -> None:
    done = cathxr("export", "csv", str(session), "--out", str(tmp_path / "track.csv"))
    assert done.returncode == 0, done.stderr
    rows = read_track_csv(tmp_path / "track.csv")
    assert len(rows) == len(list(SessionReader(session).tracks()))


def test_track_command_on_rendered_pictures(tmp_path: Path) -> None:
    rig = true_rig(example_rig(), 5)
    write_rig(tmp_path / "rig.toml", rig)
    world = TwinWorld(rig, seed=5, settings=scene("smooth"))
    truths = []
    for name in ("top", "front"):
        (tmp_path / name).mkdir()
        renderer = CameraRenderer(world, name)
        for seq in range(PAIRS):
            t_ns = 1_000_000_000 + seq * 400_000_000
            cv2.imwrite(str(tmp_path / name / f"{seq}.png"), renderer.picture(t_ns))
            if name == "top":
                truths.append(world.truth(t_ns).tip_box)
    out = tmp_path / "track.csv"
    arguments = [f"--{name}={tmp_path / name}" for name in ("top", "front")]
    done = cathxr("track", f"--rig={tmp_path / 'rig.toml'}", *arguments, f"--out={out}")
    assert done.returncode == 0, done.stderr
    assert f"{PAIRS} pairs: {PAIRS} tracked" in done.stdout
    tips = np.array([row.shape_box[0] for row in read_track_csv(out) if row.shape_box is not None])
    assert np.linalg.norm(tips - np.array(truths), axis=1).mean() < 0.06


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["run", "--source", "nowhere"], "There is no source 'nowhere'"),
        (["run", "--source", "cameras"], "give it with --rig"),
        (["run", "--rig", "missing.toml"], "missing.toml"),
        (["run", "--config", "missing.toml"], "There is no configuration file missing.toml"),
        (["run", "--scene", "disco"], "There is no scene 'disco'"),
        (["record", "--source", "sessions", "--out", "x"], "Only the twin or cameras can be recorded"),
        (["replay", "nowhere"], "There is no session folder nowhere"),
        (["export", "csv", "nowhere", "--out", "x.csv"], "nowhere"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(arguments: list[str], sentence: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "cathxr", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2] / "src")}
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, cwd=tmp_path, env=environment
    )
    assert done.returncode == 1
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[server]\nport = 99999\n", "server.port"),
        ("[server]\nprot = 1\n", "the key 'server.prot' is unknown"),
        ("[twin]\nseed = true\n", "twin.seed"),
        ("= 3\n", "is not valid TOML"),
    ],
)
def test_a_wrong_configuration_is_said_in_one_sentence(text: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text(text, encoding="utf-8")
    done = cathxr("run", "--config", str(path))
    assert done.returncode == 1
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1
