"""The cameras' and the encoder's delays from a recorded motion: which signals to compare, what goes into the rig."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from cathxr.calibration.timing_signals import LIMIT_S, Lag, Signal, lag_between
from cathxr.core import CalibrationError, Detection, FloatArray, Provenance, Reading, Rig, Timing
from cathxr.geometry import CameraModel, nearest_to_rays

LEAST_MM, LEAST_RAD = 2.0, np.deg2rad(10.0)
LEAST_BEND_MM = 4.0
"""The tip must stand off its axis of turning by this much, for its azimuth to tell the roll."""
SYSTEMATIC_S = 1.5e-4
"""What the detection of a moving tube alone can do to the cameras' offset: 0.1 ms on the twin, whatever the noise."""
_GAIN_TOLERANCE = 0.08
_SIGNIFICANT = 4.0
_GAINS = (1.0, 0.25, 0.4, 0.5, 0.6, 0.67, 0.75, 0.85, 1.15, 1.33, 1.5, 1.67, 2.0, 2.5, 4.0)
_FAR_BETTER = 0.5
_COARSE_S = np.arange(-LIMIT_S, LIMIT_S + 1e-9, 0.02)


@dataclass(frozen=True, eq=False)
class TimingResult:
    """The rig with its new [timing]; cameras, encoder (None without one): the lags beyond what was known.

    camera_signals, encoder_signals: what was compared. warnings: sentences about a reversed roll, a wrong gear ratio,
    play in the gears.
    """

    rig: Rig
    cameras: Lag
    encoder: Lag | None
    camera_signals: tuple[Signal, Signal]
    encoder_signals: tuple[Signal, Signal] | None
    warnings: tuple[str, ...]


def calibrate_timing(
    rig: Rig, detections: Sequence[Detection], readings: Sequence[Reading], *, recorded: Timing, date: str
) -> TimingResult:
    """Return the rig with the delays that 10 to 15 s of to-and-fro motion show.

    detections: of both cameras, each at its own stamp; readings: the encoder's, empty without one. recorded: the
    [timing] that was already subtracted from those stamps.

    Raises:
        CalibrationError: the motion does not tell; the sentence says why.
    """
    top, front = (_seen(detections, name) for name in ("top", "front"))
    signals = plane_signals(rig, top, front)
    names = ("The tip in the top camera", "The tip in the front camera")
    cameras = lag_between(*signals, least_motion=LEAST_MM, names=names)
    cameras = replace(cameras, std_s=float(np.hypot(cameras.std_s, SYSTEMATIC_S)))
    encoder, encoder_signals = None, None
    warnings: list[str] = []
    if rig.roll is not None and readings:
        encoder, encoder_signals, warnings = _encoder(rig, top, front, readings, cameras.lag_s)
    timing = _timing(recorded, cameras, encoder, date=date)
    return TimingResult(replace(rig, timing=timing), cameras, encoder, signals, encoder_signals, tuple(warnings))


def plane_signals(rig: Rig, top: Sequence[Detection], front: Sequence[Detection]) -> tuple[Signal, Signal]:
    """Return the one coordinate of the tip that each camera measures alone: the turn, in mm, of its epipolar plane.

    All planes through both optical centres share that line; the plane that holds the tip is the same in both views.
    """
    models = {name: CameraModel.of(rig.cameras[name]) for name in ("top", "front")}
    axis = models["front"].centre_box - models["top"].centre_box
    axis = axis / np.linalg.norm(axis)
    middle = 0.5 * (rig.roi.min_mm + rig.roi.max_mm) - models["top"].centre_box
    ahead = middle - (middle @ axis) * axis
    distance = float(np.linalg.norm(ahead))
    ahead = ahead / distance
    aside = np.cross(axis, ahead)
    result = []
    for name, found in (("top", top), ("front", front)):
        rays = models[name].ray(np.stack([each.curve_px[0] for each in found]))
        result.append(Signal(_times(found), distance * np.arctan2(rays @ aside, rays @ ahead)))
    return result[0], result[1]


def _seen(detections: Sequence[Detection], name: str) -> list[Detection]:
    """Return one camera's detections that found the catheter, in order of time and without repeats."""
    found = sorted((each for each in detections if each.camera == name and each.found), key=lambda each: each.t_ns)
    distinct = [each for i, each in enumerate(found) if i == 0 or each.t_ns > found[i - 1].t_ns]
    if len(distinct) < 30:
        raise CalibrationError(
            f"The {name} camera shows the catheter in only {len(distinct)} pictures: record 10 to 15 s of motion in "
            "which it stays in view."
        )
    return [each for each in distinct if each.repeats == 0]


def _times(found: Sequence[Detection]) -> FloatArray:
    return np.array([each.t_ns for each in found], dtype=np.float64) * 1e-9


def _encoder(
    rig: Rig, top: Sequence[Detection], front: Sequence[Detection], readings: Sequence[Reading], offset_s: float
) -> tuple[Lag, tuple[Signal, Signal], list[str]]:
    """Return the encoder's lag behind the top camera, the signals, and what else they tell."""
    assert rig.roll is not None
    ordered = sorted(readings, key=lambda each: each.t_ns)
    kept = [each for i, each in enumerate(ordered) if i == 0 or each.t_ns > ordered[i - 1].t_ns]
    roll = Signal(
        np.array([each.t_ns for each in kept]) * 1e-9, np.array([rig.roll.angle_rad(each.count) for each in kept])
    )
    times, tips = _tips(rig, top, front, offset_s)
    sense, centre, radius = _circle(times, tips, roll)
    if radius < LEAST_BEND_MM:
        raise CalibrationError(
            f"The tip stands only {radius:.1f} mm off the axis it turns about, at least {LEAST_BEND_MM:.0f} mm are "
            "needed to see its roll: bend the tip, keep the bend, and turn the catheter to and fro."
        )
    off = (tips[:, 1:] - centre) @ np.array([1.0, 1j])
    azimuth = Signal(times, np.unwrap(np.angle(off)))
    signed = Signal(roll.t_s, sense * roll.value)
    names = ("The tip's turn in the pictures", "The encoder")
    lag = lag_between(azimuth, signed, least_motion=LEAST_RAD, names=names, with_hysteresis=True)
    warnings = []
    if sense < 0:
        warnings.append(
            f"direction in [roll] seems reversed: the tip turns the other way than the encoder says; set direction = "
            f"{-rig.roll.direction}."
        )
    if abs(lag.gain - 1.0) > _GAIN_TOLERANCE:
        warnings.append(
            f"The tip turns {lag.gain:.2f} times as far as the encoder says: check counts_per_turn and gear_ratio in "
            "[roll], and that the bend was kept."
        )
    play = abs(lag.hysteresis)
    if play > max(_SIGNIFICANT * lag.hysteresis_std, np.deg2rad(0.2)):
        warnings.append(
            f"The tip and the encoder differ by {np.rad2deg(play):.1f}° ± {np.rad2deg(lag.hysteresis_std):.1f}° "
            "between the two directions of turning: play in the gears (backlash_deg in [roll]), or friction in the "
            "inlet."
        )
    return lag, (azimuth, signed), warnings


def _tips(
    rig: Rig, top: Sequence[Detection], front: Sequence[Detection], offset_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return (instants (N,) of the top camera, the rounded end's centre then (N, 3) mm in `box`)."""
    front_s, front_px = _times(front), np.stack([each.curve_px[0] for each in front])
    top_s, top_px = _times(top), np.stack([each.curve_px[0] for each in top])
    known = Signal(front_s, front_px[:, 0]).known_at(top_s + offset_s)
    top_s, top_px = top_s[known], top_px[known]
    cameras = [CameraModel.of(rig.cameras[name]) for name in ("top", "front")]
    rays = np.stack([cameras[0].ray(top_px), cameras[1].ray(CubicSpline(front_s, front_px)(top_s + offset_s))])
    return top_s, nearest_to_rays(np.stack([each.centre_box for each in cameras]), rays)


def _circle(times: FloatArray, tips: FloatArray, roll: Signal) -> tuple[int, FloatArray, float]:
    """Return (sense of turning, +1 or -1 against the encoder's; centre (2,) y, z; radius) of the tip's circle, mm.

    y + iz = centre + radius * exp(i (sense * roll + phase)), by linear least squares at the best of coarse lags.
    """
    place = tips[:, 1:] @ np.array([1.0, 1j])
    best: tuple[float, int, complex, float] = (np.inf, 1, 0j, 0.0)
    angle = Signal(roll.t_s, roll.value).smoothed()
    for gain in _GAINS:
        # the encoder's own scale unless another fits far better: the gear ratio is wrong then, and with it the centre
        bar = best[0] if gain == 1.0 else _FAR_BETTER * best[0]
        for lag in _COARSE_S:
            good = roll.known_at(times + lag)
            if good.sum() < 30:
                continue
            turn = np.exp(1j * gain * angle(times[good] + lag))
            for sense, each in ((1, turn), (-1, turn.conj())):
                design = np.column_stack([np.ones_like(each), each])
                solution = np.linalg.solve(design.conj().T @ design + 1e-9 * np.eye(2), design.conj().T @ place[good])
                left = float(np.mean(np.abs(place[good] - design @ solution) ** 2))
                if left < min(bar, best[0]):
                    best = (left, sense, complex(solution[0]), abs(complex(solution[1])))
    if not np.isfinite(best[0]):
        raise CalibrationError("The encoder and the cameras were hardly running at the same time: record again.")
    return best[1], np.array([best[2].real, best[2].imag]), best[3]


def _timing(recorded: Timing, cameras: Lag, encoder: Lag | None, *, date: str) -> Timing:
    """Return the [timing] to write: what was subtracted already, plus what is left."""
    std = {"front_offset_s": np.asarray(cameras.std_s)}
    if encoder is not None:
        std["encoder_latency_s"] = np.asarray(encoder.std_s)
    elif "encoder_latency_s" in recorded.provenance.std:
        std["encoder_latency_s"] = recorded.provenance.std["encoder_latency_s"]
    method = "cross-correlation of a to-and-fro motion: the tip in both cameras" + (
        "" if encoder is None else ", its azimuth against the encoder"
    )
    return replace(
        recorded,
        front_offset_s=recorded.front_offset_s + cameras.lag_s,
        encoder_latency_s=recorded.encoder_latency_s + (0.0 if encoder is None else encoder.lag_s),
        provenance=Provenance(std=std, n=len(cameras.t_s), date=date, method=method),
    )
