"""The link of a real server, with real clients: greeting, Tracks, acknowledgement, commands, hostile input."""

import json
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from cathxr.core import Event, Health
from cathxr.wire import transport
from cathxr.wire.hub import Hub
from cathxr.wire.messages import ACK_WINDOW, CloseCode, TrackMessage
from cathxr.wire.server import LiveServer


def _address(server: LiveServer) -> str:
    return f"ws://127.0.0.1:{server.port}/ws?protocol=1"


def _next(link: ClientConnection, kind: str) -> dict[str, Any]:
    """Return the next message of a kind, past others."""
    while True:
        message: dict[str, Any] = json.loads(link.recv(timeout=10))
        if message["type"] == kind:
            return message


def _end(link: ClientConnection) -> int:
    """Return the code with which the server ends a link, past what it still sends; 1006 when it is torn."""
    try:
        while True:
            link.recv(timeout=10)
    except ConnectionClosed as closed:
        return int(closed.rcvd.code) if closed.rcvd else 1006


@contextmanager
def _joined(server: LiveServer) -> Iterator[ClientConnection]:
    """Yield a link that has been greeted."""
    with connect(_address(server), compression=None) as link:
        _next(link, "session")
        yield link


def test_greets_then_tells_the_present_state(server: LiveServer, hub: Hub, kit: SimpleNamespace) -> None:
    with connect(_address(server)) as first:
        hello = json.loads(first.recv(timeout=10))
        assert (hello["type"], hello["protocol"], hello["role"], hello["source"]) == ("hello", 1, "operator", "twin")
        assert not hello["needs_pairing"]
        assert {"box", "tip", "ct"} <= hello["frames"].keys()
        assert "permessage-deflate" not in first.response.headers.get("Sec-WebSocket-Extensions", "")
        hub.publish_session(recording=True, name="run 1", seconds=2.0)
        assert _next(first, "session")["recording"] is False  # as it was before
        assert _next(first, "session")["name"] == "run 1"
        hub.publish_health([Health(1, "top", True, 0.01, 60.0, 0)], t_ns=1)
        assert _next(first, "health")["clients"] == 1
        hub.publish_track(kit.track(7))
        _next(first, "track")
        with connect(_address(server)) as second:
            messages = [json.loads(second.recv(timeout=10)) for _ in range(4)]
    assert [each["type"] for each in messages] == ["hello", "session", "track", "health"]
    assert messages[1]["name"] == "run 1"
    assert messages[2]["seq"] == 7
    assert messages[3]["clients"] == 2


def test_tracks_arrive_as_published(server: LiveServer, hub: Hub, kit: SimpleNamespace) -> None:
    with _joined(server) as link:
        for seq in range(20):
            track = kit.track(seq)
            hub.publish_track(track)
            message = TrackMessage.model_validate(_next(link, "track"))
            assert message.seq == seq
            assert message.tip is not None
            assert message.tip.position == (100.0, round(seq * 1e-3, 4), 0.0)
            assert message.t == pytest.approx(track.t_ns * 1e-9, abs=1e-6)  # the wire's own rounding


def test_events_reach_everyone_in_order(server: LiveServer, hub: Hub) -> None:
    with _joined(server) as one, _joined(server) as two:
        for number in range(30):
            hub.publish_event(Event(number, "truth", {"number": number}))
        for link in (one, two):
            assert [_next(link, "event")["payload"]["number"] for _ in range(30)] == list(range(30))


def test_ping_is_answered_with_the_hosts_clock(server: LiveServer) -> None:
    with _joined(server) as link:
        before = time.monotonic()
        link.send('{"type": "ping", "t": 12.5}')
        pong = _next(link, "pong")
        assert pong["client_t"] == 12.5
        assert before - 1e-6 <= pong["t"] <= time.monotonic() + 1e-6  # one clock, rounded to 1 us


def test_commands_are_answered_with_their_id(server: LiveServer) -> None:
    with _joined(server) as link:
        link.send('{"type": "command", "name": "steer", "args": {"insertion_mm": 40}, "id": "a"}')
        assert _next(link, "event")["payload"] == {"id": "a", "name": "steer", "result": {"insertion_mm": 40}}
        link.send('{"type": "command", "name": "refuse", "id": "b"}')
        refusal = _next(link, "refusal")
        assert (refusal["code"], refusal["id"]) == ("command", "b")
        assert "--source twin" in refusal["sentence"]


def test_a_faulty_command_is_refused_and_the_link_lives(server: LiveServer, caplog: pytest.LogCaptureFixture) -> None:
    with _joined(server) as link:
        link.send('{"type": "command", "name": "fail", "id": "c"}')
        assert "its log says why" in _next(link, "refusal")["sentence"]
        link.send('{"type": "ping", "t": 1}')
        _next(link, "pong")
    assert "a fault of the program's own" in caplog.text


def test_tracks_flow_while_a_command_takes_long(server: LiveServer, hub: Hub, kit: SimpleNamespace) -> None:
    with _joined(server) as link:
        link.send('{"type": "command", "name": "slow", "id": "s"}')
        for seq in range(3 * ACK_WINDOW):
            hub.publish_track(kit.track(seq))
            assert _next(link, "track")["seq"] == seq  # `_next` would swallow the answer, had it come before
            link.send(json.dumps({"type": "ack", "seq": seq}))
        assert _next(link, "event")["payload"]["id"] == "s"


@pytest.mark.parametrize("query", ["?protocol=2", "?protocol=", "?protocol=1.0", "?protocol=" + "9" * 3000])
def test_another_protocol_is_refused_in_words(server: LiveServer, query: str) -> None:
    with connect(f"ws://127.0.0.1:{server.port}/ws{query}") as link:
        refusal = json.loads(link.recv(timeout=10))
        assert _end(link) == CloseCode.PROTOCOL
    assert refusal["code"] == "protocol"
    assert "reload the page" in refusal["sentence"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "null",
        "[]",
        '"ack"',
        '{"type": "ack"}',
        '{"type": "ack", "seq": "1"}',
        '{"type": "ack", "seq": 1, "more": 2}',
        '{"type": "hello"}',
        '{"type": ["ack"]}',
        '{"type": "ping", "t": NaN}',
        '{"type": "ping", "t": Infinity}',
        '{"type": "ping", "t": 1e999}',
        '{"type": "ping", "t": ' + "9" * 5000 + "}",
        '{"type": "command", "name": "steer", "args": {"roll_deg": NaN}}',
        '{"type": "command", "name": "steer", "args": []}',
        '{"type": "command", "name": "' + "x" * 65 + '"}',
        '{"type": "command", "name": "steer", "args": {"a": ' + "[" * 200 + "]" * 200 + "}}",
        '{"type": "command", "name": "\\ud800"}',
        "[" * 15000,
    ],
)
def test_what_is_no_message_is_refused_and_the_link_lives(server: LiveServer, text: str) -> None:
    with _joined(server) as link:
        link.send(text)
        refusal = _next(link, "refusal")
        assert refusal["code"] == "message"
        assert len(refusal["sentence"]) < 300  # hostile input is not echoed at length
        link.send('{"type": "ping", "t": 1}')
        _next(link, "pong")


def test_many_bad_messages_end_the_link(server: LiveServer) -> None:
    with _joined(server) as link:
        for _ in range(10):
            link.send(b"\x00binary")
        assert _end(link) == CloseCode.MISUSE


def test_a_flood_ends_the_link(server: LiveServer) -> None:
    with _joined(server) as link:
        with suppress(ConnectionClosed):
            for _ in range(200_000):
                link.send('{"type":"ack","seq":0}')
        assert _end(link) == CloseCode.MISUSE


def test_an_oversize_message_ends_the_link(server: LiveServer) -> None:
    with _joined(server) as link:
        link.send('{"type": "ping", "t": 1' + " " * 20_000 + "}")
        assert _end(link) == CloseCode.TOO_BIG


def test_an_oversize_message_in_pieces_ends_the_link(server: LiveServer, kit: SimpleNamespace) -> None:
    link = kit.RawLink(server.port)
    link.message()
    link.send(b'{"type": "ping", "t": 1', final=False)
    with suppress(ConnectionError):
        for _ in range(20):
            link.send(b" " * 2000, opcode=0, final=False)
    assert link.ended()
    link.close()


@pytest.mark.parametrize("junk", [b"\xff" * 64, b"\x81\x05hello", b"\x83\x80\x00\x00\x00\x00", b"\x88\x81\0\0\0\0\0"])
def test_bytes_that_are_no_frames_harm_nobody(server: LiveServer, hub: Hub, kit: SimpleNamespace, junk: bytes) -> None:
    with _joined(server) as good:
        bad = kit.RawLink(server.port)
        bad.message()
        bad.socket.sendall(junk)
        bad.close()
        hub.publish_track(kit.track(1))
        assert _next(good, "track")["seq"] == 1


def test_a_client_too_many_is_told_so(start: Any) -> None:
    server = start(max_clients=2)
    with _joined(server), _joined(server), connect(_address(server)) as third:
        refusal = json.loads(third.recv(timeout=10))
        assert refusal["code"] == "busy"
        assert _end(third) == CloseCode.BUSY


def test_the_window_holds_back_a_client_that_stops_acknowledging(
    server: LiveServer, hub: Hub, kit: SimpleNamespace
) -> None:
    with _joined(server) as link:
        hub.publish_track(kit.track(0))
        _next(link, "track")
        link.send('{"type": "ack", "seq": 0}')
        link.send('{"type": "ping", "t": 1}')
        _next(link, "pong")  # the server has read the ack
        got = []
        for seq in range(1, 101):
            hub.publish_track(kit.track(seq))
            if seq <= ACK_WINDOW:
                got.append(_next(link, "track")["seq"])
        assert got == list(range(1, ACK_WINDOW + 1))
        link.send('{"type": "ping", "t": 2}')
        assert json.loads(link.recv(timeout=10))["type"] == "pong"  # not one Track more before the ack
        link.send(json.dumps({"type": "ack", "seq": ACK_WINDOW}))
        assert _next(link, "track")["seq"] == 100  # the newest, and nothing in between
        hub.publish_health([], t_ns=0)
        assert _next(link, "health")["skipped"] == 100 - ACK_WINDOW - 1


@pytest.mark.parametrize("tracks", [1500])
def test_a_stalled_reader_delays_nobody_and_finds_little_that_is_stale(
    server: LiveServer, hub: Hub, kit: SimpleNamespace, tracks: int
) -> None:
    stalled = kit.RawLink(server.port, receive_buffer=16 * 1024)
    stalled.message()
    with _joined(server) as good:
        for seq in range(tracks):
            hub.publish_track(kit.track(seq))
            assert _next(good, "track")["seq"] == seq  # each one, while the other reads nothing
    stale = 0
    while (message := stalled.message())["type"] != "track" or message["seq"] != tracks - 1:
        stale += message["type"] == "track"
    stalled.close()
    # What the buffers hold: twice 32 KiB to send and twice 16 KiB to receive in the system, 8 KiB in the process, and
    # a Track of this test is at least 1000 bytes. Without the limit it would be all of them.
    assert stale < (2 * 32 + 2 * 16 + 8) * 1024 / 1000 + 10


def test_a_stalled_reader_that_acknowledged_finds_a_window_at_most(
    server: LiveServer, hub: Hub, kit: SimpleNamespace
) -> None:
    link = kit.RawLink(server.port)
    hub.publish_track(kit.track(0))
    while (message := link.message())["type"] != "track":
        pass
    link.send(json.dumps({"type": "ack", "seq": message["seq"]}).encode())
    link.send(b'{"type": "ping", "t": 1}')
    while link.message()["type"] != "pong":
        pass
    with _joined(server) as good:
        for seq in range(501):
            assert _next(good, "track")["seq"] == seq  # 0 comes with the greeting
            hub.publish_track(kit.track(seq + 1))
    link.send(b'{"type": "ack", "seq": 12}')
    got = []
    for _ in range(ACK_WINDOW + 1):
        while (message := link.message())["type"] != "track":
            pass
        got.append(message["seq"])
    link.close()
    assert got == [*range(1, ACK_WINDOW + 1), 501]


def test_a_link_that_leaves_pings_unanswered_is_ended(
    start: Any, hub: Hub, kit: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transport, "PING_EVERY_S", 0.5)
    monkeypatch.setattr(transport, "PING_TIMEOUT_S", 0.1)
    monkeypatch.setattr(transport, "LINGER_S", 0.05)
    server = start()
    silent = kit.RawLink(server.port, receive_buffer=4096)
    silent.message()
    deadline = time.monotonic() + kit.WAIT_S
    with _joined(server) as good:
        seq = 0
        while hub.clients > 1:  # the silent one's buffers full of Tracks, so that no closing message gets through
            assert time.monotonic() < deadline, "the silent link is still there"
            hub.publish_track(kit.track(seq := seq + 1))
            _next(good, "track")
    assert silent.ended()
    silent.close()


def test_reconnecting_resyncs(server: LiveServer, hub: Hub, kit: SimpleNamespace) -> None:
    with _joined(server) as link:
        hub.publish_track(kit.track(1))
        _next(link, "track")
        link.socket.shutdown(socket.SHUT_RDWR)  # torn, not closed
    hub.publish_track(kit.track(2))
    with connect(_address(server)) as link:
        assert _next(link, "track")["seq"] == 2


def test_fifty_clients_get_the_newest(server: LiveServer, hub: Hub, kit: SimpleNamespace) -> None:
    with ExitStack() as stack:
        links = [stack.enter_context(_joined(server)) for _ in range(50)]
        assert hub.clients == 50
        for seq in range(20):
            hub.publish_track(kit.track(seq))
        for link in links:
            while _next(link, "track")["seq"] != 19:
                pass


def test_publishing_from_many_threads_loses_no_event(server: LiveServer, hub: Hub) -> None:
    def publish(first: int) -> None:
        for number in range(first, first + 25):
            hub.publish_event(Event(0, "count", {"number": number}))

    with _joined(server) as link:
        threads = [threading.Thread(target=publish, args=(25 * each,)) for each in range(8)]
        for thread in threads:
            thread.start()
        got = {_next(link, "event")["payload"]["number"] for _ in range(200)}
        for thread in threads:
            thread.join()
    assert got == set(range(200))


def test_the_example_client_in_another_process_prints_the_tip(
    server: LiveServer, hub: Hub, kit: SimpleNamespace, repo_root: Path
) -> None:
    hub.publish_track(kit.track(42))
    command = [sys.executable, str(repo_root / "examples" / "print_tip.py"), f"ws://127.0.0.1:{server.port}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        assert client.stdout.readline().split() == ["42", "tracked", "[100.0,", "0.042,", "0.0]"]
        client.kill()


def test_the_example_is_the_one_in_the_docs(repo_root: Path) -> None:
    example = (repo_root / "examples" / "print_tip.py").read_text(encoding="utf-8")
    assert len(example.splitlines()) <= 20
    assert f"```python\n{example}```" in (repo_root / "docs" / "wire.md").read_text(encoding="utf-8")
