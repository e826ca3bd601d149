"""The network side of a real server: the certificate, roles, pairing, and the limit on guessing."""

import json
import os
import ssl
import stat
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from cathxr.wire.console import access_text, qr_text
from cathxr.wire.pairing import ATTEMPTS
from cathxr.wire.server import LiveServer


@pytest.fixture
def server(start: Any) -> LiveServer:
    """A server on the network, whose clients on this machine must pair too."""
    server: LiveServer = start(lan=True, force_pairing=True)
    return server


@pytest.fixture
def trust(server: LiveServer, tmp_path: Path) -> ssl.SSLContext:
    """What a client trusts that was given this server's certificate, and nothing else."""
    return ssl.create_default_context(cafile=str(tmp_path / "config" / "certificate.pem"))


def _lan_port(server: LiveServer) -> int:
    return int(server.lan_urls[0].rpartition(":")[2])


def _ask(link: ClientConnection, name: str, **args: Any) -> dict[str, Any]:
    link.send(json.dumps({"type": "command", "name": name, "args": args, "id": "x"}))
    while True:
        message: dict[str, Any] = json.loads(link.recv(timeout=10))
        if message["type"] in ("event", "refusal"):
            assert message.get("id", "x") == "x"
            return message


def test_https_is_verified_against_the_certificate(server: LiveServer, trust: ssl.SSLContext) -> None:
    for name in ("localhost", "127.0.0.1"):
        address = f"https://{name}:{_lan_port(server)}/api/health"
        assert httpx.get(address, verify=trust, trust_env=False, timeout=10).status_code == 200
    with pytest.raises(httpx.ConnectError, match=r"self.signed"):
        httpx.get(address, verify=ssl.create_default_context(), trust_env=False, timeout=10)


@pytest.mark.skipif(os.name != "posix", reason="file modes are POSIX's")
def test_nobody_else_may_read_the_key(server: LiveServer, tmp_path: Path) -> None:
    assert stat.S_IMODE((tmp_path / "config" / "key.pem").stat().st_mode) == 0o600


def test_a_viewer_becomes_an_operator_by_the_code(server: LiveServer, trust: ssl.SSLContext) -> None:
    address = f"wss://localhost:{_lan_port(server)}/ws?protocol=1"
    with connect(address, ssl=trust) as link:
        hello = json.loads(link.recv(timeout=10))
        assert (hello["role"], hello["needs_pairing"]) == ("viewer", True)
        refusal = _ask(link, "steer", insertion_mm=3)
        assert refusal["code"] == "role"
        assert "pair" in refusal["sentence"]
        wrong = f"{(int(server.pairing_code or 0) + 1) % 10**6:06d}"
        assert _ask(link, "pair", code=wrong)["code"] == "pairing"
        assert _ask(link, "steer", insertion_mm=3)["code"] == "role"
        assert _ask(link, "pair", code=server.pairing_code)["payload"]["result"] == {"role": "operator"}
        assert _ask(link, "steer", insertion_mm=3)["payload"]["result"] == {"insertion_mm": 3}
        with connect(address, ssl=trust) as other:  # the role is the link's, not the address's
            assert json.loads(other.recv(timeout=10))["role"] == "viewer"
            assert _ask(other, "steer", insertion_mm=3)["code"] == "role"


@pytest.mark.parametrize("code", [None, 123456, "", "12345", ["1"], {"a": 1}, "１２３４５６", "\x00", "x" * 9000])
def test_what_is_no_code_is_a_wrong_code(server: LiveServer, code: Any) -> None:
    with connect(f"ws://127.0.0.1:{server.port}/ws?protocol=1") as link:
        assert _ask(link, "pair", code=code)["code"] == "pairing"
        assert _ask(link, "steer")["code"] == "role"


def test_guessing_is_locked_out_on_every_link_of_an_address(server: LiveServer) -> None:
    address = f"ws://127.0.0.1:{server.port}/ws?protocol=1"
    for _ in range(ATTEMPTS):
        with connect(address) as link:
            assert "not the pairing code" in _ask(link, "pair", code="x")["sentence"]
    with connect(address) as link:
        refusal = _ask(link, "pair", code=server.pairing_code)  # even the right one, else guessing would go on
        assert "Too many" in refusal["sentence"]
        assert _ask(link, "steer")["code"] == "role"


def test_a_client_of_this_machine_may_command_at_once(start: Any) -> None:
    server = start(lan=True)
    with connect(f"ws://localhost:{server.port}/ws?protocol=1") as link:
        hello = json.loads(link.recv(timeout=10))
        assert (hello["role"], hello["needs_pairing"]) == ("operator", False)
        assert _ask(link, "steer", insertion_mm=1)["payload"]["result"] == {"insertion_mm": 1}
        assert _ask(link, "pair", code="")["payload"]["result"] == {"role": "operator"}


def test_a_client_that_comes_in_by_the_networks_address_is_a_viewer(start: Any, tmp_path: Path) -> None:
    server = start(lan=True)
    trust = ssl.create_default_context(cafile=str(tmp_path / "config" / "certificate.pem"))
    urls = [url for url in server.lan_urls if url.split("//")[1][0].isdigit()]
    if not urls:
        pytest.skip("this machine has no address on a network")
    with connect(urls[0].replace("https", "wss") + "/ws?protocol=1", ssl=trust) as link:
        assert json.loads(link.recv(timeout=10))["role"] == "viewer"


@pytest.mark.parametrize("origin", ["https://evil.example", "http://localhost:{port}"])
def test_other_origins_are_refused_over_https_too(server: LiveServer, trust: ssl.SSLContext, origin: str) -> None:
    port = _lan_port(server)
    headers = {"Origin": origin.format(port=port)}
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(f"wss://localhost:{port}/ws?protocol=1", ssl=trust, additional_headers=headers),
    ):
        pass
    assert refused.value.response.status_code == 403


def test_only_loopback_without_lan(start: Any) -> None:
    server = start()
    assert server.lan_urls == ()
    assert server.pairing_code is None
    assert "https" not in access_text(server)


def test_the_console_text_says_all_that_one_needs(server: LiveServer) -> None:
    text = access_text(server, asked_port=server.port + 1)
    assert server.url in text
    assert all(url in text for url in server.lan_urls)
    assert (server.pairing_code or "?") in text
    shown = "".join(text.split()).replace(":", "")
    assert (server.fingerprint or "?").replace(":", "") in shown
    assert f"Port {server.port + 1} is in use" in text
    assert qr_text("https://example.invalid").count("\n") > 10
