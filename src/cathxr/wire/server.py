"""The live server: page, scene, pictures and link over http on loopback, and https on the network when asked for."""

import asyncio
import contextlib
import datetime
import logging
import socket
import threading
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import uvicorn
from fastapi import APIRouter, FastAPI, WebSocket

from cathxr import __version__
from cathxr.core import Clock, DeviceError
from cathxr.wire.access_pages import Access, make_access_router
from cathxr.wire.guard import LOOPBACK_NAMES, Guard
from cathxr.wire.hub import Hub
from cathxr.wire.link import Commands, Desk, serve_link
from cathxr.wire.messages import PROTOCOL, Hello, SceneDescription
from cathxr.wire.network import host_names, lan_addresses, listening_socket, user_folder
from cathxr.wire.packed import Packed
from cathxr.wire.pages import make_router
from cathxr.wire.pairing import Pairing, new_code
from cathxr.wire.scene import UNITS
from cathxr.wire.transport import make_server, serve

if TYPE_CHECKING:
    from cathxr.wire.certificate import Certificate

_log = logging.getLogger(__name__)

DEFAULT_PORT = 8765
DEFAULT_LAN_PORT = 8766
MAX_CLIENTS = 64
START_S = 10.0
GRACE_S = 0.4


@dataclass(frozen=True)
class Lan:
    """How the network may reach the server. `names`: what else it is called there. `folder`: for the certificate."""

    port: int = DEFAULT_LAN_PORT
    names: Sequence[str] = ()
    folder: Path | None = None


class LiveServer:
    """Serves a hub to clients, in a thread of its own. A context manager: entering starts it, leaving stops it.

    Clients on this machine may command at once, unless `force_pairing`; all others must give `pairing_code` first.
    """

    def __init__(
        self,
        hub: Hub,
        scene: SceneDescription,
        *,
        commands: Commands,
        clock: Clock,
        files: Mapping[str, Path | Packed] | None = None,
        port: int = DEFAULT_PORT,
        lan: Lan | None = None,
        force_pairing: bool = False,
        page: Path | None = None,
        max_clients: int = MAX_CLIENTS,
        cameras: Collection[str] = (),
        routers: Sequence[APIRouter] = (),
    ) -> None:
        """Make a server that does not listen yet.

        `files`: paths under /scene/ and the files they stand for. `port`: on loopback; the next free one is taken when
        it is in use, 0 takes any. `commands` runs in a worker thread, one command at a time. `page`: the built page's
        folder (default: the package's own). `cameras`: what else there are pictures of, besides the scene's cameras.
        `routers`: what else is served.
        """
        self._hub = hub
        self._port = port
        self._lan = lan
        self._software = f"cathxr {__version__}"
        page = page or Path(str(resources.files("cathxr"))) / "web_client"
        self._router = make_router(hub, scene, files=files or {}, page=page, software=self._software, cameras=cameras)
        self._more = tuple(routers)
        needs_code = lan is not None or force_pairing
        self._pairing = Pairing(new_code(), clock) if needs_code else None
        self._certificate: Certificate | None = None
        self._addresses: tuple[str, ...] = ()
        self._ports: list[int] = []
        self._thread: threading.Thread | None = None
        self._started = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop = asyncio.Event()
        self._desk = Desk(
            hub=hub,
            hello=_hello(scene, self._software),
            clock=clock,
            commands=commands,
            # The executor makes its thread with its first command.
            executor=ThreadPoolExecutor(max_workers=1, thread_name_prefix="cathxr-commands"),
            pairing=self._pairing,
            force_pairing=force_pairing,
            max_clients=max_clients,
            closing=asyncio.Event(),
        )
        self.failure: BaseException | None = None
        """What ended the server's thread, None while all is well."""

    @property
    def url(self) -> str:
        """The page's address on this machine."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def port(self) -> int:
        """The port on loopback; it differs from the one asked for when that was in use."""
        if not self._ports:
            raise RuntimeError("LiveServer: the port is known once the server has started")
        return self._ports[0]

    @property
    def lan_urls(self) -> tuple[str, ...]:
        """The page's addresses on the network, the most useful first; empty when the network is not served."""
        if self._lan is None or len(self._ports) < 2:
            return ()
        return tuple(f"https://{each}:{self._ports[1]}" for each in (*self._addresses, *self._names()))

    @property
    def pairing_code(self) -> str | None:
        """The code that turns a viewer into an operator, None when there is none."""
        return None if self._pairing is None else self._pairing.code

    @property
    def fingerprint(self) -> str | None:
        """The certificate's SHA-256 fingerprint, None without https."""
        return None if self._certificate is None else self._certificate.fingerprint

    def access(self) -> Access:
        """Return how the page can be reached; once the server has started."""
        return Access(self.url, self.port, self.lan_urls, self.fingerprint, self.pairing_code is not None)

    @property
    def running(self) -> bool:
        """Whether the server's thread lives."""
        return self._thread is not None and self._thread.is_alive()

    def start(self) -> None:
        """Begin to serve; returns when clients can connect.

        Raises:
            ConfigError: no port is free, or the certificate cannot be written.
            DeviceError: the server did not come up.
        """
        if self._thread is not None:
            raise RuntimeError("LiveServer: a server starts once; make a new one")
        listeners = self._listeners()
        self._ports = [listener.getsockname()[1] for _, listener in listeners]
        self._thread = threading.Thread(target=self._run, args=(listeners,), name="cathxr-server", daemon=True)
        self._thread.start()
        if not self._started.wait(START_S) or self.failure is not None:
            raise DeviceError(f"The server did not come up: {self.failure or 'no answer in time'}.") from self.failure

    def stop(self, timeout_s: float = 1.5) -> None:
        """End every link and the thread; returns within `timeout_s`, whatever the clients do."""
        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop has ended already
                self._loop.call_soon_threadsafe(self._stop.set)
        if self._thread is not None:
            self._thread.join(timeout_s)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def _names(self) -> tuple[str, ...]:
        return (*host_names(), *(self._lan.names if self._lan else ()))

    def _listeners(self) -> list[tuple[uvicorn.Server, socket.socket]]:
        """Return each uvicorn server with the socket it will serve; binding here lets start() say what is wrong."""
        app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)

        @app.websocket("/ws")
        async def link(websocket: WebSocket) -> None:
            await serve_link(websocket, self._desk)

        for router in (
            *self._more,
            make_access_router(self.access),
            self._router,
        ):  # the last of them answers whatever is left
            app.include_router(router)
        servers = [make_server(Guard(app, names=LOOPBACK_NAMES, scheme="http"))]
        if self._lan is not None:
            from cathxr.wire.certificate import ensured_certificate  # here: only https needs it, and it loads slowly

            self._addresses = lan_addresses()
            self._certificate = ensured_certificate(
                self._lan.folder or user_folder(),
                names=self._names(),
                addresses=self._addresses,
                now=datetime.datetime.now(datetime.UTC),
            )
            guard = Guard(app, names={*LOOPBACK_NAMES, *self._names(), *self._addresses}, scheme="https")
            paths = self._certificate
            servers.append(make_server(guard, certificate=paths.certificate_path, key=paths.key_path))
        listeners = [listening_socket("127.0.0.1", self._port)]
        if self._lan is not None:
            try:
                listeners.append(listening_socket("0.0.0.0", self._lan.port))
            except Exception:
                listeners[0].close()
                raise
        return list(zip(servers, listeners, strict=True))

    def _run(self, listeners: list[tuple[uvicorn.Server, socket.socket]]) -> None:
        try:
            asyncio.run(self._serve(listeners))
        except (Exception, SystemExit) as error:  # stored: the supervisor shows it
            self.failure = error
            _log.exception("The server's thread ended")
        finally:
            for _, listener in listeners:
                listener.close()
            self._started.set()

    async def _serve(self, listeners: list[tuple[uvicorn.Server, socket.socket]]) -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(_log_loop_error)
        self._loop = loop
        self._hub.bind(loop)
        stop = asyncio.Event()
        serving = asyncio.create_task(serve(listeners, stop=stop, grace_s=GRACE_S))
        try:
            while not (serving.done() or all(server.started for server, _ in listeners)):
                await asyncio.sleep(0.005)
            self._started.set()
            stopping = asyncio.create_task(self._stop.wait())
            await asyncio.wait([serving, stopping], return_when=asyncio.FIRST_COMPLETED)
            stopping.cancel()
        finally:
            # Links say goodbye and requests that wait for a picture are answered before the connections are cut.
            self._desk.closing.set()
            self._hub.unbind()
            self._desk.executor.shutdown(wait=False, cancel_futures=True)
            await asyncio.sleep(0.05)
            stop.set()
            await serving


def _hello(scene: SceneDescription, software: str) -> Hello:
    """Return the greeting; each link puts its own role in."""
    return Hello(
        protocol=PROTOCOL,
        software=software,
        frames=dict(scene.frames),
        units=dict(UNITS),
        role="viewer",
        source=scene.source,
        needs_pairing=False,
    )


def _log_loop_error(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log what goes wrong outside any task; a peer that vanishes is no news."""
    error = context.get("exception")
    level = logging.DEBUG if isinstance(error, OSError) else logging.ERROR
    _log.log(level, "In the server's loop: %s", context.get("message"), exc_info=error)
