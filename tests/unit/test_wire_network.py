"""This machine on the network: ports, names, folders."""

import asyncio
import socket
from pathlib import Path

import pytest

from cathxr.core import ConfigError
from cathxr.wire import network
from cathxr.wire.guard import host_name, is_loopback
from cathxr.wire.network import host_names, lan_addresses, listening_socket, user_folder


def test_any_port_and_the_next_free_one() -> None:
    with listening_socket("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with listening_socket("127.0.0.1", port) as second:
            assert port < second.getsockname()[1] < port + network.PORTS_TRIED


def test_small_messages_leave_at_once() -> None:
    """Nagle's algorithm would hold a Track that follows an event back for 40 ms: a client's delayed acknowledgement."""

    async def nodelay() -> int:
        accepted: asyncio.Future[int] = asyncio.get_running_loop().create_future()

        def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            accepted.set_result(writer.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
            writer.close()

        server = await asyncio.start_server(connected, sock=listening_socket("127.0.0.1", 0))
        async with server:
            _, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
            result = await accepted
            writer.close()
            await writer.wait_closed()
        return result

    assert asyncio.run(nodelay()) != 0


def test_says_when_no_port_is_free(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "PORTS_TRIED", 1)
    with listening_socket("127.0.0.1", 0) as taken, pytest.raises(ConfigError, match="give another with --port"):
        listening_socket("127.0.0.1", taken.getsockname()[1])


@pytest.mark.parametrize("port", [-1, 65536])
def test_says_when_a_port_does_not_exist(port: int) -> None:
    with pytest.raises(ConfigError, match="does not exist"):
        listening_socket("127.0.0.1", port)


def test_says_when_the_address_is_not_this_machines() -> None:
    with pytest.raises(ConfigError, match=r"203\.0\.113\.1"):
        listening_socket("203.0.113.1", 0)


def test_names_and_addresses_are_fit_for_a_certificate(monkeypatch: pytest.MonkeyPatch) -> None:
    assert all(not each.startswith("127.") for each in lan_addresses())
    monkeypatch.setattr(socket, "gethostname", lambda: "Lab-PC.example.org")
    assert host_names() == ("lab-pc.example.org", "lab-pc.local")
    monkeypatch.setattr(socket, "gethostname", lambda: "Büro PC")
    assert host_names() == ()


@pytest.mark.parametrize(
    ("platform", "environment", "expected"),
    [
        ("linux", {"XDG_CONFIG_HOME": "/x"}, Path("/x/cathxr")),
        ("linux", {"XDG_CONFIG_HOME": "relative"}, Path.home() / ".config/cathxr"),
        ("linux", {}, Path.home() / ".config/cathxr"),
        ("darwin", {}, Path.home() / "Library/Application Support/cathxr"),
        ("win32", {"APPDATA": "/roaming"}, Path("/roaming/cathxr")),
        ("win32", {}, Path.home() / "AppData/Roaming/cathxr"),
    ],
)
def test_settings_lie_where_the_platform_keeps_them(platform: str, environment: dict[str, str], expected: Path) -> None:
    assert user_folder(platform, environment) == expected


@pytest.mark.parametrize(
    ("host", "name"),
    [
        ("localhost", "localhost"),
        ("LocalHost:80", "localhost"),
        ("localhost.", "localhost"),
        ("127.0.0.1:8765", "127.0.0.1"),
        ("[::1]:8765", "::1"),
        ("", ""),
        (":80", ""),
    ],
)
def test_the_name_in_a_host_header(host: str, name: str) -> None:
    assert host_name(host) == name


@pytest.mark.parametrize(
    ("address", "loopback"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("::ffff:127.0.0.1", True),
        ("::ffff:10.0.0.1", False),
        ("192.168.1.5", False),
        ("0.0.0.0", False),
        ("", False),
        ("localhost", False),
    ],
)
def test_which_peers_are_this_machine(address: str, loopback: bool) -> None:
    assert is_loopback(address) is loopback
