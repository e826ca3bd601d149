"""Choosing the cameras and locking their settings, on the page or on the console."""

from collections.abc import Mapping
from pathlib import Path

import click
import cv2
from rich.console import Console
from rich.table import Table

from cathxr.app.calibration_server import serve_calibration
from cathxr.app.camera_choice import write_camera_choice
from cathxr.app.page_options import PageChoice
from cathxr.app.twin_devices import twin_candidates
from cathxr.core import Clock, ConfigError, DeviceNotFound, Rig
from cathxr.devices.adjustable_camera import AdjustableCamera
from cathxr.devices.camera_lock import LockedSettings
from cathxr.devices.clock import MonotonicClock
from cathxr.devices.listing import list_cameras, listing_sentence, stable_name
from cathxr.runtime.calibration_cameras import CamerasSession, Candidate, Choice
from cathxr.runtime.calibration_task import Ending
from cathxr.storage.atomic import check_writable
from cathxr.storage.rig_file import example_rig, read_rig
from cathxr.wire.hub import Hub


def with_page(config: Path, *, rig_path: Path | None, source: str, seed: int, page: PageChoice) -> None:
    """Let a person choose on the page, lock the cameras and write the configuration.

    source: "cameras" or "twin".

    Raises:
        CathxrError: it could not start, or was cancelled: the configuration is untouched.
    """
    clock = MonotonicClock()
    check_writable(config, what="the configuration")
    rig = None if rig_path is None else read_rig(rig_path)
    if source == "twin":
        rig = rig or example_rig()
        candidates = twin_candidates(rig, seed=seed, clock=clock)
    else:
        candidates = found_candidates(rig, clock=clock)
    # The looking thread shares the processor with every camera's own: OpenCV's threads would only be in the way.
    cv2.setNumThreads(1)

    def save(choices: Mapping[str, Choice]) -> Ending:
        chosen = {role: (each.candidate.device, each.locked) for role, each in choices.items()}
        return Ending(write_camera_choice(config, chosen), True, (str(config),))

    def task(hub: Hub) -> CamerasSession:
        return CamerasSession(candidates, rig=rig, save=save)

    ending = serve_calibration(
        task, {each.key: each.camera for each in candidates}, rig=rig or example_rig(), kind=source,
        title=f"Choosing among {len(candidates)} cameras.", clock=clock, page=page,
    )  # fmt: skip
    click.echo(ending.sentence)


def found_candidates(rig: Rig | None, *, clock: Clock) -> tuple[Candidate, ...]:
    """Return every camera connected, closed. rig: whose picture size and rate are asked of them.

    Raises:
        DeviceNotFound: there is none.
    """
    devices = list_cameras()
    if not devices:
        raise DeviceNotFound(f"{listing_sentence(())} Without hardware, try --source twin.")
    candidates = []
    for number, each in enumerate(devices):
        key = f"device-{number}"
        camera = _adjustable(each.device, key, rig=rig, role="top", clock=clock)
        candidates.append(Candidate(key, stable_name(each.device), str(each), camera))
    return tuple(candidates)


def _adjustable(device: int | str, key: str, *, rig: Rig | None, role: str, clock: Clock) -> AdjustableCamera:
    """Return a camera, closed, that is asked for the size and rate which the rig states for a role."""
    if rig is None:
        return AdjustableCamera(device, key, clock=clock)
    wanted = rig.cameras[role]
    return AdjustableCamera(device, key, clock=clock, size_px=wanted.size_px, rate_hz=wanted.rate_hz)


def print_list() -> None:
    """Print the cameras found."""
    devices = list_cameras()
    if not devices:
        click.echo(listing_sentence(()))
        return
    table = Table("device", "name", "stays the same as")
    for each in devices:
        table.add_row(str(each.device), each.name, str(stable_name(each.device)))
    Console().print(table)


def without_page(config: Path, asked: Mapping[str, str], *, rig_path: Path | None) -> None:
    """Lock the two cameras, one after the other, and write the configuration. asked: device by role, as typed.

    Raises:
        CathxrError: a camera cannot be opened or locked, or the configuration cannot be written.
    """
    clock = MonotonicClock()
    check_writable(config, what="the configuration")
    rig = None if rig_path is None else read_rig(rig_path)
    devices = {role: int(text) if text.isdecimal() else text for role, text in asked.items()}
    if stable_name(devices["top"]) == stable_name(devices["front"]):
        raise ConfigError(f"--top and --front name the same camera ({asked['top']}): give two.")
    locked: dict[str, LockedSettings] = {}
    for role, device in devices.items():
        click.echo(f"The {role} camera settles …")
        with _adjustable(device, role, rig=rig, role=role, clock=clock) as camera:
            locked[role] = camera.lock_alone()
    table = Table("camera", "device", "locked at", "brightness automatic / locked")
    for role, each in locked.items():
        values = ", ".join(f"{name} {value:g}" for name, value in each.options.items()) or "nothing it lets us set"
        table.add_row(role, str(devices[role]), values, f"{each.brightness_before:.0f} / {each.brightness_after:.0f}")
    Console().print(table)
    for role, each in locked.items():
        for warning in each.warnings:
            click.echo(f"{role}: {warning}")
    click.echo(write_camera_choice(config, {role: (devices[role], each) for role, each in locked.items()}))
