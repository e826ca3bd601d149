"""Puts a roll calibration together: the encoder, what is done, where it is shown, and what is written at the end."""

import datetime
from dataclasses import dataclass, field, replace
from pathlib import Path

import click

from cathxr.app.calibrate_roll_console import run_on_console
from cathxr.app.calibrate_roll_hand import HandTruth, SimulatedHand, hand_truth
from cathxr.app.calibration_server import serve_running
from cathxr.app.config import Config, read_config
from cathxr.app.page_options import PageChoice
from cathxr.app.plugins import make_encoder
from cathxr.calibration.roll import JigCalibration, changes
from cathxr.core import Clock, ConfigError, DeviceError, Rig, Roll
from cathxr.devices.clock import MonotonicClock
from cathxr.devices.encoder_fake import FakeBoard, FakePort
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.runtime.calibration_readings import ReadingsCalibration
from cathxr.runtime.calibration_roll import RollSession, RollSteps
from cathxr.runtime.calibration_running import Outlet
from cathxr.runtime.calibration_task import Ending
from cathxr.storage.atomic import check_writable
from cathxr.storage.rig_file import read_rig, write_rig

_NS = 1_000_000_000
_ANSWER_S = 3.0
_POLL_S = 0.02
_BOOT_S = 0.5


@dataclass(frozen=True)
class RollChoice:
    """What a person chose. source: "encoder" or "twin"; page: None for the console."""

    source: str = "encoder"
    config: Path | None = None
    device: str | None = None
    seed: int = 0
    steps: RollSteps = field(default_factory=RollSteps)
    page: PageChoice | None = None
    confirms_itself: bool = False
    dry_run: bool = False


def calibrate_roll(rig_path: Path, choice: RollChoice) -> None:
    """Measure a rig's [roll] with the jig and write it; returns when a person has accepted it.

    Raises:
        CathxrError: it could not start, or was cancelled: the rig is untouched.
    """
    rig = read_rig(rig_path)
    if rig.roll is None:
        raise ConfigError(
            f"The rig {rig_path} has no [roll]: add counts_per_turn, gear_ratio, direction and zero_count to it first."
        )
    if not choice.dry_run:
        check_writable(rig_path, what="the rig")
    clock = MonotonicClock()
    hand = None
    if choice.source == "twin":
        hand = SimulatedHand(hand_truth(rig.roll, choice.seed), seed=choice.seed, clock=clock)
    encoder = _encoder(rig, choice, hand, clock=clock)
    saver = RollSaver(rig_path, encoder, clock=clock, dry_run=choice.dry_run)
    session = RollSession(
        rig.roll,
        steps=choice.steps,
        date=datetime.date.today().isoformat(),
        save=saver.save,
        on_step=None if hand is None else hand.begin,
    )

    def running(outlet: Outlet) -> ReadingsCalibration:
        return ReadingsCalibration(session, encoder, outlet=outlet, clock=clock)

    if hand is not None:
        click.echo(f"This is a simulation, without hardware: a simulated hand does each step (seed {choice.seed}).")
    title = "Measuring roll with the jig."
    if choice.page is None:
        ending = run_on_console(running, title=title, confirms_itself=choice.confirms_itself)
    else:
        ending = serve_running(
            running, rig=rig, kind="twin" if hand else "cameras", title=title, clock=clock, page=choice.page
        )
    click.echo(ending.sentence)
    if hand is not None and session.result is not None:
        click.echo(_comparison(hand.truth, session.result.roll))


class RollSaver:
    """Sets the board's zero and then writes the rig: in this order, a failure leaves no rig whose zero is not set."""

    def __init__(self, rig_path: Path, encoder: SerialEncoder, *, clock: Clock, dry_run: bool) -> None:
        self._rig_path, self._encoder, self._clock, self._dry_run = rig_path, encoder, clock, dry_run

    def save(self, result: JigCalibration, count: int) -> Ending:
        """Have the board call its present position `count`, and write the rig's [roll].

        Raises:
            CathxrError: the board does not answer, or the rig cannot be written: then it is untouched.
        """
        if self._dry_run:
            return Ending(f"Nothing was written into {self._rig_path}, and the board is as it was (--dry-run).", True)
        rig = read_rig(self._rig_path)  # anew: a camera may have been calibrated meanwhile
        before = rig.roll
        if before is None:
            raise ConfigError(f"The rig {self._rig_path} has lost its [roll] meanwhile: begin again.")
        self._encoder.set_zero(count)
        self._wait()
        gears = set(changes(before, result.roll)) - {"backlash_deg"}
        if gears:
            # The mark that the board keeps is of the rig's numbers, and these change.
            self._encoder.adopt(result.roll)
            self._wait()
        write_rig(self._rig_path, replace(rig, roll=result.roll), backup=True)
        sentence = f"Roll is in {self._rig_path} (the earlier file is beside it), and the board has its zero."
        return Ending(sentence, True, (str(self._rig_path),))

    def _wait(self) -> None:
        """Wait until the board has carried out what it was told."""
        deadline_ns = self._clock.now_ns() + round(_ANSWER_S * _NS)
        while (state := self._encoder.state) is None or not state.valid:
            now_ns = self._clock.now_ns()
            if now_ns >= deadline_ns:
                raise DeviceError(
                    f"The board has not taken its zero within {_ANSWER_S:g} s; the rig is as it was. Check the USB "
                    "cable, then begin again."
                )
            self._clock.wait_until_ns(now_ns + round(_POLL_S * _NS))


def _encoder(rig: Rig, choice: RollChoice, hand: SimulatedHand | None, *, clock: Clock) -> SerialEncoder:
    if hand is not None:
        board = FakeBoard(hand.count_at, start_ns=clock.now_ns())
        port = FakePort(board, clock, name="simulation", waits_s=_BOOT_S)
        return SerialEncoder(rig, clock=clock, options={"port": port.name, "open_port": port.open})
    chosen = (Config() if choice.config is None else read_config(choice.config)).encoder
    options = dict(chosen.options)
    if choice.device is not None:
        options["port"] = choice.device
    driver = chosen.driver or "serial"
    encoder = make_encoder(driver, rig, clock=clock, options=options)
    if not isinstance(encoder, SerialEncoder):
        raise ConfigError(
            f"The encoder driver {driver!r} has no board whose zero could be set: calibrate roll needs the driver "
            "serial; without hardware, try --source twin."
        )
    return encoder


def _comparison(truth: HandTruth, found: Roll) -> str:
    """Return the simulation's truth beside what was found."""
    backlash = "left out" if found.backlash_deg is None else f"{found.backlash_deg:.3f}"
    return (
        f"The simulation's truth, and what was found: backlash {truth.backlash_deg:.3f} and {backlash} degrees; "
        f"gear_ratio {truth.gear_ratio:g} and {found.gear_ratio:g}; direction {truth.direction} and {found.direction}."
    )
