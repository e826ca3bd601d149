"""An operator without a browser: the link's messages, and a hand that steers the twin to where a trial wants it."""

import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from websockets.sync.client import ClientConnection, connect

from cathxr.storage.rig_file import example_rig
from cathxr.training.placing import PlacedTarget
from cathxr.twin import TwinWorld, scene, true_rig

from ...training_support.hand import controls_for

WAIT_S = 90.0
"""How long a test waits for what must come: a limit on hanging, not a measurement."""
NAMES = ("insertion_mm", "roll_deg", "anterior_deg", "left_deg")


class Operator:
    """A client that keeps the newest of each message, and every Event."""

    def __init__(self, port: int) -> None:
        self._connecting = connect(f"ws://127.0.0.1:{port}/ws?protocol=1", compression=None)
        self.link: ClientConnection = self._connecting.__enter__()
        self.newest: dict[str, dict[str, Any]] = {}
        self.events: list[dict[str, Any]] = []
        self.states: list[tuple[float, dict[str, Any]]] = []
        self._asked = 0
        # the twin of a live process with its default options
        self._body = TwinWorld(true_rig(example_rig(), 0), seed=0, settings=scene("smooth"), start_ns=0).body
        self._controls = np.array([30.0, 0.0, 0.0, 0.0])

    def hear(self) -> dict[str, Any]:
        """Return the next message."""
        message: dict[str, Any] = json.loads(self.link.recv(timeout=WAIT_S))
        self.newest[message["type"]] = message
        if message["type"] == "track":
            self.link.send(json.dumps({"type": "ack", "seq": message["seq"]}))
        if message["type"] == "event":
            self.events.append(message)
        if message["type"] == "training":
            self.states.append((time.monotonic(), message))
        return message

    def until(self, met: Callable[[], Any], what: str) -> Any:
        """Hear messages until something is so, and return it."""
        deadline = time.monotonic() + WAIT_S
        while not (found := met()):
            assert time.monotonic() < deadline, f"{what} did not come; the last state: {self.newest.get('training')}"
            self.hear()
        return found

    def ask(self, name: str, **args: Any) -> dict[str, Any]:
        """Return the answer to a command: its event `done`, or the refusal."""
        self._asked += 1
        mine = f"{id(self)}-{self._asked}"
        self.link.send(json.dumps({"type": "command", "name": name, "args": args, "id": mine}))
        while True:
            message = self.hear()
            if message["type"] == "refusal" and message["id"] == mine:
                return message
            if message["type"] == "event" and message["kind"] == "done" and message["payload"]["id"] == mine:
                return message

    def done(self, name: str, **args: Any) -> dict[str, Any]:
        """Return the result of a command that must be carried out."""
        answer = self.ask(name, **args)
        assert answer["type"] == "event", answer
        result: dict[str, Any] = answer["payload"]["result"]
        return result

    def refused(self, name: str, **args: Any) -> str:
        """Return the sentence of a command that must be refused."""
        answer = self.ask(name, **args)
        assert answer["type"] == "refusal", answer
        return str(answer["sentence"])

    def state(self) -> dict[str, Any]:
        """Return how training stands."""
        return self.newest.get("training", {"phase": None})

    def until_phase(self, *phases: str) -> dict[str, Any]:
        """Hear messages until training is in one of some phases."""
        self.until(lambda: self.state()["phase"] in phases, f"phase {phases}")
        return self.state()

    def steer_to(self, target: dict[str, Any]) -> None:
        """Steer the twin to where a target for the tip is reached."""
        place = PlacedTarget(
            target["key"], target["name"], target["kind"], np.array(target["position_mm"]), target["radius_mm"]
        )
        self._controls = controls_for(self._body, place, self._controls)
        self.done("steer", **dict(zip(NAMES, map(float, self._controls), strict=True)))

    def reach(self, count: int | None = None) -> None:
        """Steer to one target after another until the trial has ended, or so many more were reached."""
        reached = self.state()["now"]["reached"]
        while self._runs() and (count is None or self.state()["now"]["reached"] < reached + count):
            key, number = self.state()["now"]["target"], self.state()["now"]["number"]
            self.steer_to(next(each for each in self.state()["run"]["targets"] if each["key"] == key))
            self.until(
                lambda number=number: not self._runs() or self.state()["now"]["number"] != number,
                f"target {key}",
            )

    def _runs(self) -> bool:
        """Return whether the trial runs; one that paused itself, on a machine that stalled, is resumed."""
        if self.state()["phase"] == "paused":
            self.ask("training_resume")
            self.until_phase("running", "ended")
        return bool(self.state()["phase"] == "running")

    def training(self, trial: str) -> list[dict[str, Any]]:
        """Return the payloads of the Events of a trial, in the order they came."""
        return [
            each["payload"] for each in self.events if each["kind"] == "training" and each["payload"]["trial"] == trial
        ]

    def close(self) -> None:
        """End the link."""
        self.link.close()
