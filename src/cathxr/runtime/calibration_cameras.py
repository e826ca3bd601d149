"""Which device is which camera: seen live, suggested by the fiducials, chosen by a person, then locked. No threads."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal, Protocol

from cathxr.core import CalibrationError, CathxrError, ConfigError, Health, Image, Rig, Source
from cathxr.devices.camera_lock import LockedSettings
from cathxr.runtime.calibration_roles import suggested_role
from cathxr.runtime.calibration_task import CANCELLED, CommandTable, Ending, Job, text_of
from cathxr.wire.calibration_messages import CalibrationStage, CamerasState, DeviceState, Figure

ROLES = ("top", "front")
LOCK_S = 30.0
"""A camera at 5 Hz in bad light needs this long to settle, and nobody waits longer."""
_SUGGEST_NS = 1_500_000_000

Role = Literal["", "top", "front"]
_ROLES_OF: Mapping[str, Role] = MappingProxyType({"": "", "top": "top", "front": "front"})


class Adjustable(Source[Image], Protocol):
    """A camera that can be left to its automatic settings and locked."""

    @property
    def settings(self) -> Mapping[str, float]: ...

    def automatic(self) -> None: ...

    def lock(self, timeout_s: float) -> LockedSettings: ...


@dataclass(frozen=True, eq=False)
class Candidate:
    """One camera found. key: lower-case letters, digits and -; device: what the configuration will call it."""

    key: str
    device: int | str
    label: str
    camera: Adjustable

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z0-9-]{1,40}", self.key):
            raise ValueError(f"key: expected lower-case letters, digits and -, got {self.key!r}")


@dataclass(frozen=True, eq=False)
class Choice:
    """A device in its role, with the settings that it stays at."""

    candidate: Candidate
    locked: LockedSettings


Save = Callable[[Mapping[str, Choice]], Ending]
"""Writes what was chosen, by role; raises CathxrError, and then nothing is written."""


class CamerasSession:
    """Tells the devices apart and locks those chosen. A Task.

    rig: whose fiducials suggest the roles; None: no suggestions. save: writes what a person accepts.
    """

    def __init__(self, candidates: Sequence[Candidate], *, rig: Rig | None, save: Save) -> None:
        self.ending: Ending | None = None
        self._candidates = {each.key: each for each in candidates}
        self._rig, self._save = rig, save
        self._stage: CalibrationStage = "collecting"
        self._sentence = ""
        self._roles: dict[str, Role] = {}
        self._suggestions: dict[str, Role] = {}
        self._asked_ns: dict[str, int] = {}
        self._seen: set[str] = set()
        self._troubles: dict[str, str] = {}
        self._locked: dict[str, LockedSettings] = {}
        self._settings: dict[str, Mapping[str, float]] = {}
        self._generation = 0
        self._job: Job[Any] | None = None
        self._commands = CommandTable(
            {
                "calibration_assign": (("key", "role"), self._assign),
                "calibration_finish": ((), self._finish),
                "calibration_continue": ((), self._continue),
                "calibration_accept": ((), self._accept),
                "calibration_cancel": ((), self._cancel),
            }
        )

    def examine(self, image: Image) -> Role | None:
        """Return which camera the fiducials say this is, "" where they do not say, None when it was not asked."""
        last_ns = self._asked_ns.get(image.camera)
        if self._rig is None or self._stage != "collecting" or (last_ns and image.t_ns - last_ns < _SUGGEST_NS):
            return None
        self._asked_ns[image.camera] = image.t_ns
        return suggested_role(self._rig, image.pixels)

    def look(self, image: Image, found: Role | None) -> None:
        """Take note that a camera gives pictures, and what the fiducials say of it."""
        self._seen.add(image.camera)
        self._troubles.pop(image.camera, None)
        if found is not None:
            self._suggestions[image.camera] = found

    def note_health(self, sources: Mapping[str, Health]) -> None:
        """Take note of cameras that fail, and of the settings as they stand."""
        for key, health in sources.items():
            if not health.running and health.last_error:
                self._troubles[key] = health.last_error
                self._suggestions.pop(key, None)
        self._settings = {key: dict(each.camera.settings) for key, each in self._candidates.items()}

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Carry out a command. Raises as `Task.handle`."""
        return self._commands.handle(name, args)

    def take_job(self) -> Job[Any] | None:
        """Return the locking that was asked for."""
        job, self._job = self._job, None
        return job

    def state(self) -> CamerasState:
        """Return what the page shows."""
        return CamerasState(
            stage=self._stage,
            advice=self._advice(),
            devices=[self._device_state(each) for each in self._candidates.values()],
            can_save=self.ending is None and self._stage in ("collecting", "done") and self._is_complete,
            figures=self._figures(),
        )

    def _device_state(self, candidate: Candidate) -> DeviceState:
        key = candidate.key
        locked = self._locked.get(key)
        values = self._settings.get(key, {}) if locked is None else locked.options
        return DeviceState(
            key=key,
            device=str(candidate.device),
            label=candidate.label,
            role=self._roles.get(key, ""),
            suggestion=self._suggestion(key),
            settings=[
                Figure(
                    label=name.replace("_", " ").capitalize(),
                    value=f"{value:g}",
                    level="plain" if locked is None else "good",
                )
                for name, value in values.items()
            ],
            trouble=self._troubles.get(key, ""),
        )

    def _suggestion(self, key: str) -> Role:
        """Return what the fiducials say, unless they say the same of two devices."""
        role = self._suggestions.get(key, "")
        return role if role and list(self._suggestions.values()).count(role) == 1 else ""

    def _figures(self) -> list[Figure]:
        """Return how bright the locked pictures are, and what is to be said about them."""
        figures = []
        for key, locked in self._locked.items():
            role = self._roles.get(key, "")
            if role:
                text = f"{locked.brightness_before:.0f} on automatic, {locked.brightness_after:.0f} locked (of 255)"
                figures.append(Figure(label=f"{role}: brightness", value=text))
                figures += [Figure(label=f"{role}: note", value=each, level="warn") for each in locked.warnings]
        return figures

    def _advice(self) -> str:
        """Return one sentence: what to do next."""
        if self.ending is not None:
            return self.ending.sentence
        if self._stage == "solving":
            return "The cameras come to rest and are locked: keep light and scene as they are."
        if self._sentence:
            return self._sentence
        if not self._candidates:
            return "No camera is connected: check the cables and start again."
        missing = [role for role in ROLES if role not in self._roles.values()]
        if not missing:
            return "Save: the cameras then settle and are locked as they are, so set the light for use first."
        suggested = {role: key for key in self._candidates if (role := self._suggestion(key)) in missing}
        if suggested:
            named = " and ".join(f"{key} is {role}" for role, key in suggested.items())
            return f"The fiducials say that {named}: choose it if that is right."
        how = "wave a hand before one of them to see which it is"
        if self._rig is not None:
            how += ", or put both crosses in, so that the fiducials tell"
        return f"Choose the {' and the '.join(missing)} camera: {how}."

    @property
    def _is_complete(self) -> bool:
        """Whether both roles are taken, by devices that give pictures."""
        ready = {role for key, role in self._roles.items() if key in self._seen and key not in self._troubles}
        return ready == set(ROLES)

    def _assign(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        key, wanted = text_of(args, "key"), text_of(args, "role")
        role = _ROLES_OF.get(wanted)
        if key not in self._candidates:
            raise ConfigError(f"There is no device {key!r}: there are {', '.join(self._candidates)}.")
        if role is None:
            raise ConfigError(f"There is no camera {wanted!r}: a device is top, front, or neither.")
        if self._stage == "solving":
            raise CalibrationError("The cameras are being locked: choose again when that is done.")
        self._roles = {other: each for other, each in self._roles.items() if each != role and other != key}
        if role:
            self._roles[key] = role
        if any(each not in self._locked for each in self._roles) or not self._is_complete:
            self._stage = "collecting"
        self._sentence = ""
        return {}

    def _finish(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self._need_complete()
        self._lock(then_save=False)
        return {}

    def _continue(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self._stage == "solving":
            raise CalibrationError("The cameras are being locked: wait until that is done.")
        for each in self._candidates.values():
            each.camera.automatic()
        self._stage, self._sentence, self._locked = "collecting", "", {}
        self._generation += 1
        return {}

    def _accept(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self._need_complete()
        if self._stage != "done":
            self._lock(then_save=True)
            return {"saved": False}  # the end is told by the event calibration_ended
        self._write()
        assert self.ending is not None, "writing ends it"
        return self.ending.result

    def _cancel(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self.ending = CANCELLED
        return self.ending.result

    def _need_complete(self) -> None:
        if self._stage == "solving":
            raise CalibrationError("The cameras are being locked already: wait until that is done.")
        if not self._is_complete:
            raise CalibrationError("Choose a top and a front camera first, both of which give pictures.")

    def _lock(self, *, then_save: bool) -> None:
        """Have the chosen cameras locked; with `then_save`, write at once what gives no reason for doubt."""
        self._stage, self._sentence = "solving", ""
        self._generation += 1
        generation, chosen = self._generation, [self._candidates[key] for key in self._roles]

        def work() -> dict[str, LockedSettings]:
            return {each.key: each.camera.lock(LOCK_S) for each in chosen}

        def done(locked: Mapping[str, LockedSettings]) -> None:
            if generation != self._generation:
                return
            self._locked, self._stage = dict(locked), "done"
            doubts = [warning for each in locked.values() for warning in each.warnings]
            self._sentence = doubts[0] if doubts else "The cameras are locked: look at their pictures, then save."
            if then_save and not doubts:
                try:
                    self._write()
                except CathxrError as error:
                    self._stage, self._sentence = "failed", str(error)

        def failed(sentence: str) -> None:
            if generation == self._generation:
                self._stage, self._sentence = "failed", sentence

        self._job = Job(work, done, failed)

    def _write(self) -> None:
        chosen: dict[str, Choice] = {
            role: Choice(self._candidates[key], self._locked[key]) for key, role in self._roles.items()
        }
        self.ending = self._save(chosen)
