"""Uvicorn, set up for a live link: small buffers, no compression, no signal handlers, an end that does not wait."""

import asyncio
import contextlib
import socket
from asyncio.transports import BaseTransport, Transport
from asyncio.trsock import TransportSocket
from pathlib import Path
from typing import cast

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

MAX_MESSAGE_BYTES = 16 * 1024
"""The largest message that a client may send."""
WRITE_BUFFER_BYTES = 8 * 1024
"""How much may wait for a client in this process: a few Tracks."""
KERNEL_BUFFER_BYTES = 32 * 1024
"""How much may wait for a client in the system (which may take twice this)."""
PING_EVERY_S = 5.0
PING_TIMEOUT_S = 15.0
"""How long a client may leave a ping unanswered: headsets pause pages for seconds when they enter VR."""
LINGER_S = 1.0
"""How long an ended link may take to get its last bytes out."""
MAX_CONNECTIONS = 512


class _Connection:
    """One connection's transport and socket, for cutting it whatever state it is in."""

    def __init__(self, transport: BaseTransport) -> None:
        self._transport = cast(Transport, transport)
        # Kept: a TLS transport that was told to close knows its socket no more, and its abort() then does nothing.
        self.socket: TransportSocket = transport.get_extra_info("socket")

    def cut(self) -> None:
        """End the connection now. What is not sent yet is lost."""
        self._transport.abort()
        with contextlib.suppress(OSError):  # it has ended already
            self.socket.shutdown(socket.SHUT_RDWR)


class PageProtocol(H11Protocol):
    """Uvicorn's HTTP, which can be cut."""

    link: _Connection

    def connection_made(self, transport: Transport) -> None:  # type: ignore[override]
        """Take the connection over; called by asyncio."""
        super().connection_made(transport)
        self.link = _Connection(transport)


class LinkProtocol(WebSocketsSansIOProtocol):
    """Uvicorn's WebSocket, but what a client does not read stays little, and cannot keep an ended link alive."""

    link: _Connection

    def connection_made(self, transport: BaseTransport) -> None:
        """Take the connection over; called by uvicorn."""
        super().connection_made(transport)
        self.link = _Connection(transport)
        cast(Transport, transport).set_write_buffer_limits(high=WRITE_BUFFER_BYTES)
        self.link.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BUFFER_BYTES)

    def keepalive_timeout(self) -> None:
        """End the link of a client that answers no ping; called by uvicorn."""
        super().keepalive_timeout()
        # Closing waits until everything is sent, which never comes when the client has stopped reading.
        self.loop.call_later(LINGER_S, self.link.cut)

    async def run_asgi(self) -> None:
        """Serve the link; called by uvicorn."""
        try:
            await super().run_asgi()
        finally:
            self.loop.call_later(LINGER_S, self.link.cut)


def make_server(app: ASGIApp, *, certificate: Path | None = None, key: Path | None = None) -> uvicorn.Server:
    """Return a server for sockets that listen already; https when a certificate and its key are given."""
    config = uvicorn.Config(
        app,
        http=PageProtocol,
        ws=LinkProtocol,
        ws_max_size=MAX_MESSAGE_BYTES,
        ws_ping_interval=PING_EVERY_S,
        ws_ping_timeout=PING_TIMEOUT_S,
        ws_per_message_deflate=False,
        lifespan="off",
        interface="asgi3",
        log_config=None,
        log_level="warning",
        access_log=False,
        proxy_headers=False,
        server_header=False,
        limit_concurrency=MAX_CONNECTIONS,
        ssl_certfile=certificate,
        ssl_keyfile=key,
    )
    return uvicorn.Server(config)


async def serve(servers: list[tuple[uvicorn.Server, socket.socket]], *, stop: asyncio.Event, grace_s: float) -> None:
    """Return when `stop` is set and every connection has ended, at the latest by cutting it after `grace_s`.

    Raises:
        RuntimeError: a server ended by itself.
    """
    tasks = [asyncio.create_task(server.serve(sockets=[listener])) for server, listener in servers]
    stopped = asyncio.create_task(stop.wait())
    done, _ = await asyncio.wait([*tasks, stopped], return_when=asyncio.FIRST_COMPLETED)
    for server, _ in servers:
        server.should_exit = True
    _, pending = await asyncio.wait(tasks, timeout=grace_s)
    if pending:
        for server, _ in servers:
            for connection in list(server.server_state.connections):
                cast(PageProtocol | LinkProtocol, connection).link.cut()
            server.force_exit = True
        _, pending = await asyncio.wait(tasks, timeout=grace_s)
    for task in [*pending, stopped]:
        task.cancel()
    await asyncio.gather(*tasks, stopped, return_exceptions=True)
    if stopped not in done:
        fault = next((task.exception() for task in tasks if task.done() and not task.cancelled()), None)
        raise RuntimeError("A server ended without having been told to") from fault
