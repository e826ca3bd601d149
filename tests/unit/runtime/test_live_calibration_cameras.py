"""Telling cameras apart and locking them: the logic alone, with cameras that only say what they would do."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from cathxr.core import CathxrError, DataError, DeviceError, Health, Image
from cathxr.devices.camera_lock import LockedSettings
from cathxr.runtime.calibration_cameras import CamerasSession, Candidate, Choice
from cathxr.runtime.calibration_task import Ending


class Camera:
    """An adjustable camera that nobody reads."""

    def __init__(self, locked: LockedSettings | str) -> None:
        self.locked = locked
        self.is_automatic = True

    def __enter__(self) -> "Camera":
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def read(self, timeout_s: float) -> Image | None:
        return None

    @property
    def settings(self) -> Mapping[str, float]:
        return {"exposure": 33.0}

    def automatic(self) -> None:
        self.is_automatic = True

    def lock(self, timeout_s: float) -> LockedSettings:
        if isinstance(self.locked, str):
            raise DeviceError(self.locked)
        self.is_automatic = False
        return self.locked


FIRST = LockedSettings(exposure=80.0, brightness_before=120.0, brightness_after=119.0)
SECOND = LockedSettings(exposure=95.0, gain=4.0)


class Bench:
    """A session with two cameras, and what it saved."""

    def __init__(self, first: LockedSettings | str = FIRST, second: LockedSettings | str = SECOND) -> None:
        self.cameras = [Camera(first), Camera(second)]
        candidates = [Candidate(f"device-{i}", i, f"Camera {i}", each) for i, each in enumerate(self.cameras)]
        self.saved: dict[str, Choice] = {}
        self.refusal: str | None = None
        self.session = CamerasSession(candidates, rig=None, save=self.save)

    def save(self, choices: Mapping[str, Choice]) -> Ending:
        if self.refusal is not None:
            raise DataError(self.refusal)
        self.saved = dict(choices)
        return Ending("Saved.", True)

    def ask(self, name: str, **args: Any) -> Mapping[str, Any]:
        return self.session.handle(f"calibration_{name}", args)

    def work(self) -> None:
        """Do what is to be worked out, as the worker's thread would."""
        job = self.session.take_job()
        assert job is not None
        try:
            value = job.work()
        except CathxrError as error:
            job.failed(str(error))
        else:
            job.done(value)

    def see(self, *keys: str) -> None:
        for key in keys:
            image = Image(key, 0, 0, np.zeros((16, 16), np.uint8))
            self.session.look(image, self.session.examine(image))

    def choose(self) -> None:
        self.see("device-0", "device-1")
        self.ask("assign", key="device-1", role="top")
        self.ask("assign", key="device-0", role="front")


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_saving_locks_first_and_writes_what_was_locked(bench: Bench) -> None:
    bench.choose()
    assert bench.session.state().can_save
    assert bench.ask("accept") == {"saved": False}
    assert bench.session.state().stage == "solving"
    bench.work()
    assert bench.session.ending is not None
    assert {role: (each.candidate.device, each.locked) for role, each in bench.saved.items()} == {
        "top": (1, SECOND),
        "front": (0, FIRST),
    }


def test_locked_settings_are_shown_before_they_are_saved(bench: Bench) -> None:
    bench.choose()
    bench.session.note_health({})
    assert bench.session.state().devices[0].settings[0].value == "33"
    bench.ask("finish")
    bench.work()
    state = bench.session.state()
    assert state.stage == "done"
    assert [each.value for each in state.devices[0].settings] == ["80"]
    assert any("120 on automatic, 119 locked" in each.value for each in state.figures)
    assert bench.ask("accept")["saved"]


def test_back_to_automatic(bench: Bench) -> None:
    bench.choose()
    bench.ask("finish")
    bench.work()
    assert not bench.cameras[0].is_automatic
    bench.ask("continue")
    assert bench.cameras[0].is_automatic
    assert bench.session.state().stage == "collecting"


def test_a_role_has_one_device_and_can_be_given_back(bench: Bench) -> None:
    bench.choose()
    bench.ask("assign", key="device-0", role="top")
    roles = {each.key: each.role for each in bench.session.state().devices}
    assert roles == {"device-0": "top", "device-1": ""}
    assert not bench.session.state().can_save
    bench.ask("assign", key="device-0", role="")
    assert {each.role for each in bench.session.state().devices} == {""}


def test_a_doubtful_lock_is_not_saved_unasked() -> None:
    bench = Bench(LockedSettings(exposure=1.0, warnings=("The locked picture is 40% darker.",)))
    bench.choose()
    bench.ask("accept")
    bench.work()
    state = bench.session.state()
    assert (state.stage, state.advice, bench.saved) == ("done", "The locked picture is 40% darker.", {})
    assert bench.ask("accept")["saved"]  # a person insists


def test_a_camera_that_cannot_be_locked_fails_with_its_sentence() -> None:
    bench = Bench("The camera 0 did not settle within 30 s.")
    bench.choose()
    bench.ask("finish")
    bench.work()
    state = bench.session.state()
    assert (state.stage, state.advice) == ("failed", "The camera 0 did not settle within 30 s.")
    bench.ask("continue")
    assert bench.session.state().stage == "collecting"


def test_a_file_that_cannot_be_written_fails_with_its_sentence(bench: Bench) -> None:
    bench.choose()
    bench.refusal = "config.toml: cannot write it (No space left on device); check the folder and the disk."
    bench.ask("accept")
    bench.work()
    assert bench.session.ending is None
    assert bench.session.state().advice == bench.refusal


def test_a_device_without_pictures_cannot_be_chosen_for_saving(bench: Bench) -> None:
    bench.choose()
    bench.session.note_health({"device-0": Health(0, "device-0", False, None, 0.0, 0, "It is unplugged.")})
    state = bench.session.state()
    assert not state.can_save
    assert state.devices[0].trouble == "It is unplugged."
    bench.see("device-0")
    assert bench.session.state().can_save


@pytest.mark.parametrize(
    ("name", "args", "sentence"),
    [
        ("assign", {"key": "device-7", "role": "top"}, "There is no device 'device-7': there are device-0, device-1"),
        ("assign", {"key": "device-0", "role": "left"}, "There is no camera 'left'"),
        ("assign", {"key": 0, "role": "top"}, "key must be a text"),
        ("assign", {"key": "device-0"}, "takes key, role; key was given"),
        ("finish", {}, "Choose a top and a front camera first"),
        ("accept", {}, "Choose a top and a front camera first"),
        ("capture", {}, "There is no command 'calibration_capture' here"),
    ],
)
def test_refusals_are_sentences(bench: Bench, name: str, args: dict[str, Any], sentence: str) -> None:
    with pytest.raises(CathxrError, match=sentence):
        bench.ask(name, **args)


def test_nothing_is_chosen_or_locked_twice_while_cameras_are_locked(bench: Bench) -> None:
    bench.choose()
    bench.ask("finish")
    for name, args in (("finish", {}), ("accept", {}), ("continue", {}), ("assign", {"key": "device-0", "role": ""})):
        with pytest.raises(CathxrError, match="locked"):
            bench.ask(name, **args)


def test_cancelling_saves_nothing(bench: Bench) -> None:
    bench.choose()
    assert bench.ask("cancel") == {"saved": False, "sentence": "Cancelled: nothing was written.", "paths": []}
    assert bench.saved == {}


def test_advice_leads_through(bench: Bench) -> None:
    assert "Choose the top and the front camera" in bench.session.state().advice
    bench.see("device-0", "device-1")
    bench.ask("assign", key="device-1", role="top")
    assert "Choose the front camera" in bench.session.state().advice
    bench.ask("assign", key="device-0", role="front")
    assert bench.session.state().advice.startswith("Save:")
