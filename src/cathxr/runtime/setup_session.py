"""The walk through the set-up on a live system: looks when asked, keeps what it saw, tells the clients."""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cathxr.core import CathxrError, Clock, ConfigError, Health, PixelArray, Reading, Rig
from cathxr.runtime.commands import Command, only
from cathxr.runtime.moment import HealthReport, Moment
from cathxr.runtime.setup_devices import TurnWatch, camera_checks, rig_check
from cathxr.runtime.setup_network import headset_check, network_checks
from cathxr.runtime.setup_nouns import SUBJECTS, SetupCheck, Subject
from cathxr.runtime.setup_pictures import (
    CAMERAS,
    Camera,
    crosses_are_in,
    light_checks,
    marker_check,
    not_yet,
    sightings,
    which_check,
    which_said,
)
from cathxr.runtime.training_worker import Worker
from cathxr.wire.setup_messages import SetupCheckState, SetupState

AVERAGED = 8
"""Pictures of each camera that are averaged: the noise falls, and what stands still stays."""
_PATIENCE_S = 5.0
_CLOSING_S = 1.0


class Station(Protocol):
    """The part of a live system that is looked at."""

    def health_report(self) -> HealthReport: ...


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What lies outside the rig. headsets: how many are connected; addresses: this computer's; lan: it is served."""

    headsets: Callable[[], int]
    addresses: Callable[[], tuple[str, ...]]
    lan: bool


class SetupSession:
    """Checks the set-up when an operator asks. A context manager; `take` and `hear` come from the system's threads.

    publish: hands a state to the clients.
    """

    def __init__(
        self, rig: Rig, *, station: Station, clock: Clock, publish: Callable[[SetupState], None], around: Surroundings
    ) -> None:
        self._rig, self._station, self._clock = rig, station, clock
        self._publish, self._around = publish, around
        self._turns = TurnWatch()
        self._worker = Worker("setup")
        self._lock = threading.Lock()
        self._kept: dict[tuple[Subject, Camera | str], tuple[SetupCheck, ...]] = {}
        self._adding: _Mean | None = None
        self._looking = False
        self._crosses: bool | None = None

    def __enter__(self) -> "SetupSession":
        self._worker.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._worker.close(_CLOSING_S)

    def take(self, moment: Moment) -> None:
        """Take a Moment's pictures while somebody waits for some."""
        adding = self._adding
        if adding is not None:
            adding.add({name: each.pixels for name, each in moment.images.items()})

    def hear(self, reading: Reading) -> None:
        """Take an encoder reading."""
        self._turns.take(reading)

    def commands(self) -> dict[str, Command]:
        """Return what operators may ask."""
        return {"setup_check": self._check}

    def _check(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("setup_check", args, ("pictures", "said"))
        pictures, said = args.get("pictures", True), args.get("said", "")
        if not isinstance(pictures, bool):
            raise ConfigError(f"setup_check: pictures must be true or false, {pictures!r} was given.")
        if said not in ("", "right", "swapped"):
            raise ConfigError(f'setup_check: said must be "right" or "swapped", {said!r} was given.')
        if said:
            self._keep(which_said(said, t_ns=self._clock.now_ns()))
        if pictures and not self._looking:  # who asks meanwhile gets the same answer
            self._looking = True
            self._worker.do(self._look)
        else:
            self._tell(busy=self._looking)
        return {}

    def _look(self) -> None:
        """Look at new pictures, in the worker's thread."""
        self._adding = adding = _Mean()
        try:
            self._tell(busy=True)
            pictures = adding.wait(_PATIENCE_S)
            if pictures is not None:
                self._judge(pictures)
        except CathxrError as error:
            self._keep(SetupCheck("markers", "fiducials", "wrong", "cannot be looked for", str(error)))
        finally:
            self._adding, self._looking = None, False
            self._tell(busy=False)

    def _judge(self, pictures: Mapping[Camera, PixelArray]) -> None:
        """Keep what pictures say; what they cannot tell now stays as it was measured last."""
        now_ns = self._clock.now_ns()
        seen = sightings(self._rig, pictures)
        self._crosses = crosses_are_in(seen)
        if self._crosses:
            for each in seen.values():
                self._keep(marker_check(self._rig, each, t_ns=now_ns))
            which = which_check(self._rig, pictures, t_ns=now_ns)
            if which.verdict != "unknown" or ("which", "") not in self._kept:
                self._keep(which)
            return
        for name, pixels in pictures.items():
            found = tuple(light_checks(self._rig, name, pixels, t_ns=now_ns))
            self._keep(*(each for each in found if each.subject == "light"))
            self._keep(*(each for each in found if each.subject == "focus"))

    def _keep(self, *checks: SetupCheck) -> None:
        """Keep checks of one subject and camera, in the place of earlier ones."""
        with self._lock:
            self._kept[(checks[0].subject, checks[0].camera)] = checks

    def checks(self) -> tuple[SetupCheck, ...]:
        """Return every check in the order in which a new owner goes through them."""
        sources: Sequence[Health] = self._station.health_report().sources
        with self._lock:
            kept = dict(self._kept)
        found = [
            *camera_checks(self._rig, sources),
            *kept.pop(("which", ""), (which_said(""),)),
            self._turns.check(self._rig, sources),
            *network_checks(self._around.addresses(), lan=self._around.lan),
            headset_check(self._around.headsets(), lan=self._around.lan),
            rig_check(self._rig),
        ]
        for name in CAMERAS:
            for subject in ("light", "focus", "markers"):
                found += kept.pop((subject, name), ()) or not_yet(subject, name, crosses=self._crosses)
        for rest in kept.values():
            found += rest
        return tuple(sorted(found, key=lambda each: SUBJECTS.index(each.subject)))

    def _tell(self, *, busy: bool) -> None:
        checks = [
            SetupCheckState(
                subject=each.subject, title=each.title, verdict=each.verdict, found=each.found, then=each.then,
                camera=each.camera, t=None if each.t_ns is None else round(each.t_ns * 1e-9, 3),
            )
            for each in self.checks()
        ]  # fmt: skip
        self._publish(SetupState(t=round(self._clock.now_ns() * 1e-9, 3), busy=busy, checks=checks))


class _Mean:
    """The mean of some pictures of both cameras, added in one thread and waited for in another."""

    def __init__(self) -> None:
        self._sums: dict[Camera, NDArray[np.uint16]] = {}
        self._count = 0
        self._done = threading.Event()

    def add(self, pictures: Mapping[str, PixelArray]) -> None:
        """Add a pair's pictures, until there are enough. A pair without one of them is passed over."""
        if self._done.is_set() or not all(name in pictures for name in CAMERAS):
            return
        for name in CAMERAS:
            if name in self._sums:
                self._sums[name] += pictures[name]
            else:
                self._sums[name] = pictures[name].astype(np.uint16)
        self._count += 1
        if self._count == AVERAGED:
            self._done.set()

    def wait(self, timeout_s: float) -> dict[Camera, PixelArray] | None:
        """Return the mean pictures; None when they did not come in time."""
        if not self._done.wait(timeout_s):
            return None
        return {name: ((each + AVERAGED // 2) // AVERAGED).astype(np.uint8) for name, each in self._sums.items()}
