"""Collects detections and encoder reports of some seconds of motion, live, as `cathxr record` would."""

import threading
from pathlib import Path

import click

from cathxr.app.live_options import chosen_config
from cathxr.app.live_parts import live_parts
from cathxr.app.run_command import prepare, stop_signal
from cathxr.core import Clock, Detection, DeviceError, Reading
from cathxr.devices.clock import MonotonicClock
from cathxr.runtime.optical import OpticalSource
from cathxr.twin import TwinWorld

_READ_S = 0.25
_PICTURES_S = 20.0
_NS = 1_000_000_000
_LEAD_S = 1.0
_STROKES = ((58.0, -80.0), (92.0, 80.0))
_PAUSES_S = (0.95, 1.2, 1.05, 1.35)
"""Uneven on purpose: an even motion fits at more than one lag."""
_BEND_DEG = 60.0


def measured_live(
    source: str, rig_path: Path, *, config: Path | None, seconds: float, seed: int | None
) -> tuple[list[Detection], list[Reading]]:
    """Return the detections of both cameras and the encoder's reports of `seconds` of motion.

    Raises:
        CathxrError: a device is missing or gives nothing.
    """
    chosen = chosen_config(config, rig=rig_path, method=None, points=None, scene=None, seed=seed)
    clock = MonotonicClock()
    parts = live_parts(source, chosen, clock=clock)
    prepare(chosen.tracking, parts.rig)
    if parts.world is not None:
        moved_to_and_fro(parts.world, clock.now_ns(), seconds=seconds + _PICTURES_S)
    else:
        click.echo(
            "Bend the tip and keep the bend; push, pull and turn the catheter to and fro, about every two seconds."
        )
    with stop_signal() as stopping:
        assert parts.optical is not None
        return collected(parts.optical, clock, stopping, seconds=seconds)


def moved_to_and_fro(world: TwinWorld, start_ns: int, *, seconds: float) -> None:
    """Have a bent catheter pushed, pulled and turned to and fro from `start_ns` on."""
    t_ns = start_ns
    world.steer(t_ns, insertion_mm=75.0, roll_deg=0.0, anterior_deg=_BEND_DEG, left_deg=0.0)
    t_ns += round(_LEAD_S * _NS)
    index = 0
    while t_ns < start_ns + seconds * _NS:
        insertion, roll = _STROKES[index % 2]
        world.steer(t_ns, insertion_mm=insertion, roll_deg=roll)
        t_ns += round(_PAUSES_S[index % len(_PAUSES_S)] * _NS)
        index += 1


def collected(
    optical: OpticalSource, clock: Clock, stopping: threading.Event, *, seconds: float
) -> tuple[list[Detection], list[Reading]]:
    """Return what `seconds` of the opened cameras and encoder give, from the first complete pair on.

    Raises:
        DeviceError: no pictures come.
    """
    detections: list[Detection] = []
    readings: list[Reading] = []
    lock = threading.Lock()

    def take(reading: Reading) -> None:
        with lock:
            readings.append(reading)

    optical.readings.add("timing", take)
    opened_ns, started_ns = clock.now_ns(), 0
    with optical:
        while not stopping.is_set() and (not started_ns or clock.now_ns() - started_ns < seconds * _NS):
            moment = optical.read_moment(_READ_S)
            if moment is not None and moment.observation is not None and len(moment.images) > 1:
                started_ns = started_ns or clock.now_ns()
                detections += moment.observation.detections
            elif not started_ns and clock.now_ns() - opened_ns > _PICTURES_S * _NS:
                said = "; ".join(f"{e.source}: {e.last_error}" for e in optical.health(clock.now_ns()) if e.last_error)
                raise DeviceError(
                    f"No pictures came from both cameras within {_PICTURES_S:.0f} s ({said or 'no error known'})."
                )
    optical.readings.remove("timing")
    with lock:
        return detections, list(readings)
