"""This machine on the network: its names and addresses, the sockets to listen on, the user's folder for settings."""

import contextlib
import errno
import os
import socket
import sys
from collections.abc import Mapping
from pathlib import Path

from cathxr.core import ConfigError

PORTS_TRIED = 20
"""How many ports, counted up from the one that was asked for, are tried before giving up."""


def lan_addresses() -> tuple[str, ...]:
    """Return this machine's IPv4 addresses on the network, the one that others most likely reach first."""
    found: list[str] = []
    # Connecting a datagram socket sends nothing: it only asks which address the system would send from. A machine
    # without a network has no route.
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))
        found.append(probe.getsockname()[0])
    with contextlib.suppress(OSError):  # the machine does not know its own name
        found += [str(info[4][0]) for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)]
    usable = [each for each in found if not each.startswith(("127.", "0."))]
    return tuple(dict.fromkeys(usable))


def host_names() -> tuple[str, ...]:
    """Return what this machine is called on the local network: its name, and its name under .local."""
    name = socket.gethostname().rstrip(".").lower()
    # Letters, digits, dots and hyphens only: what else a system allows has no place in a certificate.
    if not name or not all(each.isascii() and (each.isalnum() or each in ".-") for each in name):
        return ()
    first = name.partition(".")[0]
    return tuple(dict.fromkeys((name, f"{first}.local")))


def listening_socket(host: str, port: int) -> socket.socket:
    """Return a socket that listens on `host`, on `port` or the next free one; 0 lets the system choose.

    Raises:
        ConfigError: none of the ports is free, or the machine has no such address.
    """
    if not 0 <= port <= 65535:
        raise ConfigError(f"The port {port} does not exist: choose one from 1 to 65535, or 0 for any free one.")
    last = port if port == 0 else min(port + PORTS_TRIED - 1, 65535)
    for candidate in range(port, last + 1):
        # asyncio switches Nagle's algorithm off only where the protocol is named: with it, a Track that follows an
        # event by a moment waits for the client's delayed acknowledgement, 40 ms.
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        try:
            if sys.platform == "win32":
                # Elsewhere SO_REUSEADDR means "although old connections linger"; here it would mean "steal the port".
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
            else:
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind((host, candidate))
            listener.listen(128)
            listener.setblocking(False)
        except OSError as error:
            listener.close()
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise ConfigError(f"Cannot listen on {host}, port {candidate}: {error.strerror}.") from error
            continue
        return listener
    raise ConfigError(f"No port from {port} to {last} on {host} is free: give another with --port.")


def user_folder(platform: str = sys.platform, environment: Mapping[str, str] = os.environ) -> Path:
    """Return this user's folder for cathxr's own settings, where the platform keeps such things (not created here)."""
    if platform == "win32":
        base = environment.get("APPDATA")
        return Path(base) / "cathxr" if base else Path.home() / "AppData" / "Roaming" / "cathxr"
    if platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "cathxr"
    base = environment.get("XDG_CONFIG_HOME")
    # The XDG rules: a relative path is to be ignored.
    return Path(base) / "cathxr" if base and Path(base).is_absolute() else Path.home() / ".config" / "cathxr"
