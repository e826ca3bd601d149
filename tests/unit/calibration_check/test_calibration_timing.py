"""Lags between signals, and what they mean for the rig: right, with honest errors, or a sentence that says why not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from cathxr.app.calibrate_timing import timing
from cathxr.app.calibrate_timing_live import moved_to_and_fro
from cathxr.calibration.check_drawing import timing_png
from cathxr.calibration.timing import calibrate_timing
from cathxr.calibration.timing_signals import LIMIT_S, Lag, Signal, lag_between
from cathxr.core import CalibrationError, Detection, FloatArray, Observation, Reading, Rig, Timing
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig, read_rig, write_rig
from cathxr.storage.session import SessionWriter
from cathxr.twin import TwinWorld, scene, true_rig

_NS = 1_000_000_000


def motion(t_s: FloatArray, phases: FloatArray, period_s: float) -> FloatArray:
    """Return a hand's uneven motion to and fro, mm."""
    waves = ((15.0, 1.0), (4.0, 2.7), (2.0, 0.6))
    parts = [a * np.sin(2.0 * np.pi * t_s / (period_s * p) + each) for (a, p), each in zip(waves, phases, strict=True)]
    return np.asarray(np.sum(parts, axis=0))


def two_signals(
    seed: int, lag_s: float, *, noise: float = 0.1, memory: float = 0.0, rates: tuple[float, float] = (30.0, 30.0),
    play: float = 0.0,
) -> tuple[Signal, Signal]:  # fmt: skip
    rng = np.random.default_rng(seed)
    period, phases = rng.uniform(1.6, 2.6), rng.uniform(0.0, 2.0 * np.pi, 3)
    first_s, second_s = (np.arange(0.0, 12.0, 1.0 / each) + rng.uniform(0.0, 0.01) for each in rates)
    error = rng.normal(0.0, noise, len(first_s))
    for i in range(1, len(error)):
        error[i] = memory * error[i - 1] + np.sqrt(1.0 - memory**2) * error[i]
    moved = motion(first_s, phases, period)
    rate = motion(first_s + 1e-3, phases, period) - motion(first_s - 1e-3, phases, period)
    first = Signal(first_s, moved + error + 0.5 * play * np.sign(rate))
    second = Signal(second_s, motion(second_s - lag_s, phases, period) + rng.normal(0.0, noise, len(second_s)))
    return first, second


def found(signals: tuple[Signal, Signal], **options: bool) -> Lag:
    return lag_between(*signals, least_motion=2.0, names=("One", "The other"), **options)


@settings(max_examples=12)
@given(lag_s=st.floats(-0.3, 0.3), seed=st.integers(0, 1000))
def test_a_lag_is_found_with_its_sign(lag_s: float, seed: int) -> None:
    lag = found(two_signals(seed, lag_s))
    # six standard deviations, as stated; no room for a wrong sign but at lags of less than a millisecond
    assert abs(lag.lag_s - lag_s) < max(6.0 * lag.std_s, 3e-4)
    assert lag.std_s < 0.002


def test_play_does_not_bend_the_lag() -> None:
    lag = found(two_signals(3, 0.02, play=1.0), with_hysteresis=True)
    assert abs(lag.lag_s - 0.02) < 4.0 * lag.std_s
    assert lag.hysteresis == pytest.approx(1.0, abs=max(0.25, 4.0 * lag.hysteresis_std))


@pytest.mark.proof
@pytest.mark.parametrize(
    "options", [{"noise": 0.4}, {"noise": 0.3, "memory": 0.9}, {"noise": 0.2, "memory": 0.8, "rates": (30.0, 200.0)}]
)
def test_stated_errors_are_honest(options: dict[str, float]) -> None:
    """RMS of the normalised errors of 150 motions: 0.7 to 1.4, whether the noise has a memory or not."""
    errors = []
    for seed in range(150):
        lag_s = float(np.random.default_rng([seed, 1]).uniform(-0.05, 0.05))
        lag = found(two_signals(seed, lag_s, **options))  # type: ignore[arg-type]
        errors.append((lag.lag_s - lag_s) / lag.std_s)
    assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.4


def test_what_does_not_tell_is_a_sentence() -> None:
    t_s = np.arange(0.0, 12.0, 1.0 / 30.0)
    moved, other = two_signals(1, 0.0)
    with pytest.raises(CalibrationError, match="hardly moved"):
        found((moved, Signal(t_s, np.sin(t_s))))
    with pytest.raises(CalibrationError, match="turns of direction"):
        found((moved, Signal(t_s, 5.0 * t_s)))
    with pytest.raises(CalibrationError, match="same motion"):
        found((moved, Signal(t_s, motion(t_s, np.array([0.3, 2.0, 4.0]), 1.31))))
    with pytest.raises(CalibrationError, match=r"repeats every 0\.2"):
        found((Signal(t_s, 10.0 * np.sin(2.0 * np.pi * 4.0 * t_s)),) * 2)
    with pytest.raises(CalibrationError, match="together for only"):
        found((moved, Signal(other.t_s + 8.0, other.value)))
    with pytest.raises(CalibrationError, match="usable values"):
        found((moved, Signal(t_s[:9], t_s[:9])))
    with pytest.raises(CalibrationError, match=r"in time|same motion"):
        found((moved, Signal(other.t_s + LIMIT_S + 0.3, other.value)))


@pytest.mark.parametrize("times", [[0.0, 1.0, 1.0], [0.0, 2.0, 1.0], [0.0, np.nan, 2.0]])
def test_a_signal_is_in_order(times: list[float]) -> None:
    with pytest.raises(ValueError, match="Signal"):
        Signal(np.array(times), np.zeros(3))


@pytest.fixture(scope="module")
def rig() -> Rig:
    return true_rig(example_rig(), 1)


def session(
    rig: Rig, *, front_s: float, encoder_s: float, sense: int = 1, play_deg: float = 0.0
) -> tuple[list[Detection], list[Reading]]:
    """Return what devices would report whose stamps are late by so much beyond what the rig's [timing] says."""
    world = TwinWorld(rig, seed=1, settings=scene("smooth"))
    moved_to_and_fro(world, 0, seconds=14.0)
    rng = np.random.default_rng(1)
    known = {"top": 0.0, "front": rig.timing.front_offset_s}
    detections, readings = [], []
    for camera, late_s in (("top", 0.0), ("front", front_s)):
        model = CameraModel.of(rig.cameras[camera])
        for seq in range(12 * 30):
            t_ns = _NS + seq * _NS // 30 + (5_000_000 if camera == "front" else 0)
            shape = world.state(t_ns).shape_box
            curve = model.project(shape[3:40]) + rng.normal(0.0, 0.05, 2)
            stamp = t_ns + round((late_s - known[camera]) * _NS)
            row = np.ones(len(curve))
            detections.append(
                Detection(camera, seq, stamp, curve, np.tile([0.0, 1.0], (len(curve), 1)), row, row, curve[0], 0.05)
            )
    assert rig.roll is not None
    followed = world.controls(_NS).roll_deg
    for seq in range(12 * 200):
        t_ns = _NS + seq * _NS // 200
        roll = world.controls(t_ns).roll_deg
        followed = min(max(followed, roll - 0.5 * play_deg), roll + 0.5 * play_deg)
        count = round(sense * followed / 360.0 * rig.roll.counts_per_turn * rig.roll.gear_ratio)
        readings.append(Reading(seq, t_ns + round((encoder_s - rig.timing.encoder_latency_s) * _NS), count))
    return detections, readings


def test_delays_go_into_the_rig_and_are_gone_the_next_time(rig: Rig) -> None:
    detections, readings = session(rig, front_s=0.012, encoder_s=0.021)
    first = calibrate_timing(rig, detections, readings, recorded=rig.timing, date="2025-05-08")
    after = first.rig.timing
    assert after.front_offset_s == pytest.approx(0.012, abs=5e-4)
    assert first.encoder is not None
    # the encoder's own error and the catheter's slow settling: five of its stated standard deviations
    assert after.encoder_latency_s == pytest.approx(0.021, abs=5.0 * first.encoder.std_s)
    assert after.provenance.date == "2025-05-08"
    assert set(after.provenance.std) == {"front_offset_s", "encoder_latency_s"}
    assert timing_png(first).startswith(b"\x89PNG")
    again = calibrate_timing(
        first.rig, *session(first.rig, front_s=0.012, encoder_s=0.021), recorded=after, date="2025-05-09"
    )
    assert again.cameras.lag_s == pytest.approx(0.0, abs=5e-4)
    assert again.rig.timing.front_offset_s == pytest.approx(0.012, abs=5e-4)
    assert again.encoder is not None
    assert again.encoder.lag_s == pytest.approx(0.0, abs=5.0 * again.encoder.std_s)


def test_a_reversed_roll_and_play_are_told(rig: Rig) -> None:
    result = calibrate_timing(
        rig, *session(rig, front_s=0.0, encoder_s=0.01, sense=-1, play_deg=3.0), recorded=Timing(), date="2025-05-08"
    )
    assert any("direction in [roll] seems reversed" in each for each in result.warnings)
    assert any("between the two directions" in each for each in result.warnings)


def test_a_wrong_gear_is_told(rig: Rig) -> None:
    assert rig.roll is not None
    wrong = replace(rig, roll=replace(rig.roll, gear_ratio=1.5))
    result = calibrate_timing(wrong, *session(rig, front_s=0.0, encoder_s=0.01), recorded=Timing(), date="2025-05-08")
    assert any("gear_ratio" in each for each in result.warnings)


def test_without_readings_only_the_cameras_are_measured(rig: Rig) -> None:
    detections, _ = session(rig, front_s=-0.007, encoder_s=0.0)
    result = calibrate_timing(rig, detections, [], recorded=Timing(encoder_latency_s=0.004), date="2025-05-08")
    assert result.encoder is None
    assert result.rig.timing.encoder_latency_s == 0.004
    assert result.rig.timing.front_offset_s == pytest.approx(-0.007, abs=5e-4)
    with pytest.raises(CalibrationError, match="front camera shows"):
        calibrate_timing(rig, [each for each in detections if each.camera == "top"], [], recorded=Timing(), date="")


def test_the_command_writes_the_rig_with_a_backup(rig: Rig, tmp_path: Path) -> None:
    path, folder = tmp_path / "rig.toml", tmp_path / "session"
    write_rig(path, rig)
    before = path.read_bytes()
    detections, readings = session(rig, front_s=0.009, encoder_s=0.015)
    writer = SessionWriter(folder, rig=rig, config={}, clock_pair=(0, "2025-05-08T10:00:00Z"), videos=False)
    half = len(detections) // 2
    for seq, (top, front) in enumerate(zip(detections[:half], detections[half:], strict=True)):
        writer.write_observation(Observation(seq, top.t_ns, (top, front), front.t_ns - top.t_ns))
    for reading in readings:
        writer.write_reading(reading)
    writer.close()
    arguments = ["--rig", str(path), "--session", str(folder)]
    dry = CliRunner().invoke(timing, [*arguments, "--dry-run"])
    assert dry.exit_code == 0, dry.output
    assert path.read_bytes() == before
    done = CliRunner().invoke(timing, arguments)
    assert done.exit_code == 0, done.output
    assert read_rig(path).timing.front_offset_s == pytest.approx(0.009, abs=5e-4)
    assert (tmp_path / "rig.toml.bak").read_bytes() == before
    assert (tmp_path / "rig_calibration" / "timing.png").is_file()
    neither = CliRunner().invoke(timing, ["--rig", str(path)])
    assert neither.exit_code == 1
    assert "either --session, or --source" in neither.output


@pytest.mark.proof
def test_live_drivers_with_late_stamps_are_put_right(rig: Rig) -> None:
    """The twin's drivers with stamps that are late by known amounts: measured live, written, measured again: gone."""
    from threading import Event

    from cathxr.app.calibrate_timing_live import collected
    from cathxr.devices.clock import MonotonicClock
    from cathxr.runtime.optical import OpticalSource
    from cathxr.tracking import make_tracker
    from cathxr.twin.drivers import TwinCamera, TwinEncoder
    from cathxr.vision import make_detector

    late = {"top": 0.0, "front": 0.011, "encoder": 0.018}

    def measured(used: Rig) -> Rig:
        clock = MonotonicClock()
        world = TwinWorld(rig, seed=1, settings=scene("smooth"), start_ns=clock.now_ns())
        moved_to_and_fro(world, clock.now_ns(), seconds=40.0)
        options = {name: {"world": world, "stamp_error_s": each} for name, each in late.items()}
        cameras = {
            name: TwinCamera(used, name, clock=clock, options={**options[name], "rate_hz": 15.0})
            for name in ("top", "front")
        }
        encoder = TwinEncoder(used, clock=clock, options=options["encoder"])
        detectors = {name: make_detector("model", used, name) for name in cameras}
        tracker = make_tracker("model", used)
        source = OpticalSource(used, cameras, detectors=detectors, tracker=tracker, clock=clock, encoder=encoder)
        detections, readings = collected(source, clock, Event(), seconds=12.0)
        return calibrate_timing(used, detections, readings, recorded=used.timing, date="2025-05-08").rig

    once = measured(rig)
    twice = measured(once)
    # the cameras to the detection's own 0.15 ms and the encoder to a few of its stated 1.5 ms
    for each in (once, twice):
        assert each.timing.front_offset_s == pytest.approx(0.011, abs=1e-3)
        assert each.timing.encoder_latency_s == pytest.approx(0.018, abs=6e-3)
    assert twice.timing.front_offset_s - once.timing.front_offset_s == pytest.approx(0.0, abs=1e-3)
