"""A real server on a free port, and clients that behave or do not."""

import base64
import json
import os
import socket
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cathxr.core import ConfigError, Image, Pose, Status, Track
from cathxr.devices.clock import MonotonicClock
from cathxr.storage.rig_file import example_rig
from cathxr.wire.hub import Hub
from cathxr.wire.messages import Command
from cathxr.wire.scene import scene_description
from cathxr.wire.server import Lan, LiveServer

WAIT_S = 10.0
"""How long a test waits for what must come: a limit on hanging, not a measurement."""


def make_track(seq: int) -> Track:
    """Return a tracked Track whose tip's y is its seq in thousandths of a mm."""
    shape = np.stack([np.linspace(100.0, 0.0, 50), np.full(50, seq * 1e-3), np.zeros(50)], axis=1)
    pose = Pose(np.array([0.5, 0.5, 0.5, 0.5]), shape[0])
    return Track(
        seq=seq,
        t_ns=time.monotonic_ns(),
        status=Status.TRACKED,
        shape_box=shape,
        box_from_tip=pose,
        sigma_mm=0.1,
        latency_ns=5_000_000,
    )


def make_picture(camera: str, t_ns: int, value: int) -> Image:
    return Image(camera, seq=0, t_ns=t_ns, pixels=np.full((360, 640), value, dtype=np.uint8))


def carry_out(command: Command) -> Mapping[str, Any]:
    """The commands that the servers of these tests know."""
    match command.name:
        case "steer":
            return {"insertion_mm": command.args.get("insertion_mm")}
        case "slow":
            time.sleep(0.5)
            return {}
        case "refuse":
            raise ConfigError("The twin is not there: start with --source twin.")
        case "fail":
            raise KeyError("a fault of the program's own")
    raise ConfigError(f"There is no command {command.name}.")


class RawLink:
    """A WebSocket client on a bare socket: reads only when told to, sends whatever bytes it is given."""

    def __init__(self, port: int, *, receive_buffer: int | None = None, host: str | None = None) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if receive_buffer is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(WAIT_S)
        self.socket.connect(("127.0.0.1", port))
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [
            "GET /ws?protocol=1 HTTP/1.1",
            f"Host: {f'127.0.0.1:{port}' if host is None else host}",
            "Upgrade: websocket",
        ]
        lines += ["Connection: Upgrade", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Key: {key}"]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self._buffer = b""
        while b"\r\n\r\n" not in self._buffer:
            self._more()
        self.head, _, self._buffer = self._buffer.partition(b"\r\n\r\n")

    def _more(self) -> None:
        data = self.socket.recv(65536)
        if not data:
            raise EOFError
        self._buffer += data

    def _bytes(self, count: int) -> bytes:
        while len(self._buffer) < count:
            self._more()
        taken, self._buffer = self._buffer[:count], self._buffer[count:]
        return taken

    def frame(self) -> tuple[int, bytes]:
        """Return the next frame's opcode and content."""
        first, length = self._bytes(2)
        if length == 126:
            (length,) = struct.unpack("!H", self._bytes(2))
        elif length == 127:
            (length,) = struct.unpack("!Q", self._bytes(8))
        return first & 0x0F, self._bytes(length)

    def message(self) -> dict[str, Any]:
        """Return the next JSON message, past pings."""
        while True:
            opcode, content = self.frame()
            if opcode == 8:
                raise EOFError
            if opcode == 1:
                value: dict[str, Any] = json.loads(content)
                return value

    def ended(self) -> bool:
        """Read on until the server ends the link, and return True."""
        try:
            while True:
                self.message()
        except (EOFError, ConnectionError):
            return True

    def send(self, content: bytes, *, opcode: int = 1, final: bool = True) -> None:
        length = len(content)
        head = bytes([opcode | (0x80 if final else 0)])
        if length < 126:
            head += bytes([0x80 | length])
        else:
            head += bytes([0x80 | 126]) + struct.pack("!H", length)
        self.socket.sendall(head + bytes(4) + content)

    def close(self) -> None:
        self.socket.close()


@pytest.fixture(scope="session")
def kit() -> SimpleNamespace:
    """What test modules share: makers and the raw client."""
    return SimpleNamespace(track=make_track, picture=make_picture, RawLink=RawLink, WAIT_S=WAIT_S)


Start = Callable[..., LiveServer]


@pytest.fixture
def hub() -> Hub:
    return Hub()


@pytest.fixture
def start(hub: Hub, tmp_path: Path) -> Iterator[Start]:
    """A function that starts a server on free ports; all are stopped in the end, and none may have failed."""
    started: list[LiveServer] = []

    def begin(**options: Any) -> LiveServer:
        if options.pop("lan", False):
            options["lan"] = Lan(port=0, folder=tmp_path / "config")
        scene = options.pop("scene", None) or scene_description(example_rig(), "twin")
        options.setdefault("port", 0)
        server = LiveServer(hub, scene, commands=carry_out, clock=MonotonicClock(), **options)
        server.start()
        started.append(server)
        return server

    yield begin
    for server in started:
        server.stop()
        assert not server.running
        assert server.failure is None


@pytest.fixture
def server(start: Start) -> LiveServer:
    """A server on loopback only."""
    return start()
