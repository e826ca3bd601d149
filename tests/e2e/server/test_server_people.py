"""Several clients of one real server: names, following, views, locks; and what is told about the way in."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from websockets.sync.client import ClientConnection, connect

from cathxr.app.view_commands import view_commands
from cathxr.core import ConfigError
from cathxr.wire.hub import Hub
from cathxr.wire.packed import Packed
from cathxr.wire.server import LiveServer

Start = Callable[..., LiveServer]


class Page:
    """One client, and what it was sent."""

    def __init__(self, link: ClientConnection, wait_s: float) -> None:
        self._link, self._wait_s = link, wait_s
        self.id = str(self.until("hello")["client"])

    def send(self, **message: Any) -> None:
        self._link.send(json.dumps(message))

    def until(self, kind: str, wanted: Callable[[dict[str, Any]], bool] = lambda message: True) -> dict[str, Any]:
        """Return the next message of a kind for which `wanted` holds, past all others."""
        while True:
            message: dict[str, Any] = json.loads(self._link.recv(timeout=self._wait_s))
            if message["type"] == kind and wanted(message):
                return message

    def looks(self, x_mm: float, kind: str = "headset", **settings: Any) -> None:
        head = {"position_mm": [x_mm, 0.0, 0.0], "orientation_wxyz": [1.0, 0.0, 0.0, 0.0]}
        self.send(type="view", kind=kind, settings=settings, head=head, world=None)


@pytest.fixture
def enter(server: LiveServer, kit: SimpleNamespace) -> Callable[[], Any]:
    @contextmanager
    def entered() -> Iterator[Page]:
        address = f"ws://127.0.0.1:{server.port}/ws?protocol=1"
        with connect(address, compression=None) as link:
            yield Page(link, kit.WAIT_S)

    return entered


def test_an_instructor_follows_a_wearer_until_they_leave(enter: Callable[[], Any]) -> None:
    with enter() as instructor:
        with enter() as wearer:
            wearer.looks(1.0, ice=True)
            clients = instructor.until("clients", lambda each: any(one["kind"] == "headset" for one in each["clients"]))
            named = {each["id"]: each["name"] for each in clients["clients"]}
            assert named == {instructor.id: "Program 1", wearer.id: "Headset 1"}
            instructor.send(type="follow", client=wearer.id)
            assert instructor.until("following")["client"] == wearer.id
            first = instructor.until("view")
            assert (first["client"], first["settings"], first["head"]["position_mm"][0]) == (
                wearer.id,
                {"ice": True},
                1.0,
            )
            for step in range(40):
                wearer.looks(float(step))
            assert instructor.until("view", lambda each: each["head"]["position_mm"][0] == 39.0)["settings"] == {}
        told = instructor.until("following")
        assert told["client"] is None
        assert "Headset 1 has left" in told["sentence"]
        assert [each["id"] for each in instructor.until("clients")["clients"]] == [instructor.id]


def test_a_view_that_cannot_be_is_refused_and_the_link_stays(enter: Callable[[], Any]) -> None:
    with enter() as page:
        page.send(type="view", kind="desktop", settings={"a": {"b": {"c": {"d": {"e": {"f": {"g": 1}}}}}}})
        refusal = page.until("refusal")
        assert refusal["code"] == "message"
        assert "view" in refusal["sentence"]
        page.send(type="follow", client="no such one")
        assert "has left" in page.until("following")["sentence"]


def test_what_is_locked_is_told_to_all_and_to_whoever_comes(hub: Hub, enter: Callable[[], Any]) -> None:
    commands = view_commands(hub)
    with enter() as early:
        commands["lock_view"]({"values": {"mode": "2d"}, "sentence": "The trial shows 2D only."})
        assert early.until("lock")["values"] == {"mode": "2d"}
        with enter() as late:
            # Before the list of clients: a page that has had that and no lock may let go of what it held.
            lock = late.until("lock")
            assert (lock["values"], lock["sentence"]) == ({"mode": "2d"}, "The trial shows 2D only.")
            late.until("clients")
            commands["unlock_view"]({})
            assert late.until("lock")["values"] == {}
    for wrong in ({}, {"values": {}}, {"values": 3, "sentence": "x"}, {"values": {"mode": "2d"}, "sentence": ""}):
        with pytest.raises(ConfigError):
            commands["lock_view"](wrong)


def test_files_from_memory_go_packed_to_whoever_takes_that(start: Start, kit: SimpleNamespace) -> None:
    content = bytes(range(256)) * 40
    server = start(files={"/scene/labels.bin": Packed.of(content)})
    with httpx.Client(base_url=server.url, timeout=kit.WAIT_S, trust_env=False) as client:
        packed = client.get("/scene/labels.bin")
        assert packed.content == content
        assert packed.headers["content-encoding"] == "gzip"
        plain = client.get("/scene/labels.bin", headers={"accept-encoding": "identity"})
        assert plain.content == content
        assert "content-encoding" not in plain.headers
        held = {"if-none-match": packed.headers["etag"]}
        assert client.get("/scene/labels.bin", headers=held).status_code == 304


def test_the_way_in_is_told_and_coded_for_own_addresses_only(start: Start, kit: SimpleNamespace) -> None:
    server = start(lan=True)
    with httpx.Client(base_url=server.url, timeout=kit.WAIT_S, trust_env=False) as client:
        access = client.get("/api/access").json()
        assert access["local"] == server.url
        assert access["network"] == list(server.lan_urls)
        assert access["fingerprint"] == server.fingerprint
        assert server.pairing_code is not None
        assert server.pairing_code not in json.dumps(access)
        for address in (server.url, *server.lan_urls):
            code = client.get("/qr.svg", params={"address": address})
            assert code.headers["content-type"] == "image/svg+xml"
            assert code.text.startswith("<svg")
        for other in ("", "http://example.org", f"{server.url}/x"):
            answer = client.get("/qr.svg", params={"address": other})
            assert answer.status_code == 404
            assert "own addresses" in answer.json()["error"]
