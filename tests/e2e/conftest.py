"""A browser that draws; a calibration as a real process, and a client that does what its page does."""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from .chromium import drawing_chromium

WAIT_S = 300.0
"""How long a test waits for what must come: a limit on hanging, not a measurement."""


class CalibrationPage:
    """A running `cathxr calibrate …` and a link to it."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "cathxr", "calibrate", *arguments, "--no-browser", "--port", "0"]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1, encoding="utf-8"
        )
        self._opened = ExitStack()
        self.states: list[dict[str, Any]] = []
        self._events: list[dict[str, Any]] = []
        self._asked = 0

    def connect(self) -> None:
        """Wait for the server and open the link."""
        self.url = self._address()
        address = f"ws{self.url.removeprefix('http')}/ws?protocol=1"
        self.link: ClientConnection = self._opened.enter_context(connect(address, compression=None))
        self.hello = str(self.link.recv(timeout=WAIT_S))

    def until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Return the first state, beginning with the last one known, for which `wanted` holds."""
        if self.states and wanted(self.states[-1]):
            return self.states[-1]
        while True:
            message = self._next()
            if message["type"].startswith("calibrate_") and wanted(message):
                return message

    def ask(self, name: str, **args: Any) -> dict[str, Any]:
        """Send a command; return the payload of its `done`, or its refusal."""
        self._asked += 1
        name_id = f"{name}-{self._asked}"
        self.link.send(json.dumps({"type": "command", "name": name, "args": args, "id": name_id}))
        while True:
            message = self._next()
            if message["type"] == "refusal" and message["id"] == name_id:
                return message
            if message["type"] == "event" and message["kind"] == "done" and message["payload"]["id"] == name_id:
                payload: dict[str, Any] = message["payload"]
                return payload

    def ended(self) -> dict[str, Any]:
        """Return what everybody is told at the end."""
        while not self._events:
            self._next()
        payload: dict[str, Any] = self._events[0]["payload"]
        return payload

    def finish(self) -> str:
        """Wait for the process's end; return all it said."""
        said, _ = self.process.communicate(timeout=WAIT_S)
        return self._said + said

    def close(self) -> None:
        self._opened.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(10.0)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()

    def _next(self) -> dict[str, Any]:
        deadline_s = time.monotonic() + WAIT_S
        try:
            message: dict[str, Any] = json.loads(self.link.recv(timeout=max(0.0, deadline_s - time.monotonic())))
        except (ConnectionClosed, TimeoutError) as error:
            raise AssertionError(f"nothing came: {error}; the last state: {self.states[-1:]}") from error
        if message["type"].startswith("calibrate_"):
            self.states.append(message)
        if message["type"] == "event" and message["kind"] == "calibration_ended":
            self._events.append(message)
        return message

    def _address(self) -> str:
        self._said = ""
        assert self.process.stdout is not None
        while line := self.process.stdout.readline():
            self._said += line
            found = re.search(r"Open (http://127\.0\.0\.1:\d+)/calibrate\.html", line)
            if found:
                return found[1]
        raise AssertionError(f"the calibration did not start: {self._said}")


@pytest.fixture
def start_calibration() -> Iterator[Callable[..., CalibrationPage]]:
    """A function that starts a calibration; all are ended with the test."""
    started: list[CalibrationPage] = []

    def start(*arguments: str) -> CalibrationPage:
        started.append(CalibrationPage(*arguments))
        started[-1].connect()
        return started[-1]

    yield start
    for each in started:
        each.close()


@pytest.fixture(scope="module")
def browser(require_tool: Callable[[str], Path]) -> Iterator[Browser]:
    """A browser that draws. Of the module: Playwright runs once at a time in a thread."""
    with drawing_chromium(require_tool("chromium")) as opened:
        yield opened
