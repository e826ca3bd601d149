"""One client's WebSocket from its first message to its last."""

import asyncio
import contextlib
import logging
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, Literal

from starlette.websockets import WebSocket, WebSocketDisconnect

from cathxr.core import CathxrError, Clock, ProtocolError
from cathxr.wire import messages
from cathxr.wire.convert import ClientSent, decode, encode, jsonable, seconds
from cathxr.wire.guard import LOOPBACK_NAMES, host_name, is_loopback
from cathxr.wire.hub import Hub
from cathxr.wire.messages import CloseCode, EventMessage, Hello, Pong, Refusal
from cathxr.wire.outbox import Outbox
from cathxr.wire.pairing import Pairing
from cathxr.wire.view_messages import Follow, ViewReport

_log = logging.getLogger(__name__)

MAX_BAD_MESSAGES = 10
"""Messages that could not be understood, after which a link is closed."""
MAX_MESSAGES_PER_S = 1000
"""More than this within one second ends a link: ten times what a page with every slider moving sends."""
MAX_COMMANDS_WAITING = 64
CLOSE_S = 0.2
"""How long a closing message may take to get out before the link is cut."""

Commands = Callable[[messages.Command], Mapping[str, Any]]
"""Carries out a command and returns the result, which JSON must be able to hold. Raises CathxrError or ValueError."""


@dataclass(frozen=True)
class Desk:
    """What every link of one server shares.

    executor: runs commands, one after another. closing: set when the server stops.
    """

    hub: Hub
    hello: Hello
    clock: Clock
    commands: Commands
    executor: Executor
    pairing: Pairing | None
    force_pairing: bool
    max_clients: int
    closing: asyncio.Event


async def refuse(websocket: WebSocket, code: CloseCode, refusal: Refusal) -> None:
    """Accept a link only to say why it is refused: a browser shows no text of a refused handshake."""
    await websocket.accept()
    await websocket.send_text(encode(refusal))
    await websocket.close(code, reason=refusal.sentence[:100])


async def serve_link(websocket: WebSocket, desk: Desk) -> None:
    """Serve one client until either side ends it."""
    # Saying a version is optional: the hello tells it, and the wire's promise is that a client needs nothing but /ws.
    asked = websocket.query_params.get("protocol", str(messages.PROTOCOL))
    if asked != str(messages.PROTOCOL):
        sentence = (
            f"The client speaks protocol {asked[:20]!r}, this server speaks {messages.PROTOCOL}: reload the page, or "
            f"connect to /ws?protocol={messages.PROTOCOL} with a client made for it."
        )
        await refuse(websocket, CloseCode.PROTOCOL, Refusal(code="protocol", sentence=sentence))
        return
    if desk.hub.clients >= desk.max_clients:
        sentence = f"The server has {desk.max_clients} clients, as many as it takes: close one, or try again later."
        await refuse(websocket, CloseCode.BUSY, Refusal(code="busy", sentence=sentence))
        return
    await Link(websocket, desk).run()


class Link:
    """One connected client: what it may do, what waits for it, and the tasks that serve it."""

    def __init__(self, websocket: WebSocket, desk: Desk) -> None:
        self._websocket = websocket
        self._desk = desk
        self._outbox = Outbox()
        self._id = ""
        self._commands: asyncio.Queue[messages.Command] = asyncio.Queue(MAX_COMMANDS_WAITING)
        self._address = websocket.client.host if websocket.client else ""
        local = is_loopback(self._address) and host_name(websocket.headers["host"]) in LOOPBACK_NAMES
        self._is_operator = local and not desk.force_pairing

    async def run(self) -> None:
        """Serve the client until either side ends the link."""
        # Joined before anything is awaited, so that the limit on clients holds.
        people = self._desk.hub.people
        self._id = people.join(self._outbox, self._role)
        hello = self._desk.hello.model_copy(
            update={
                "role": self._role,
                "needs_pairing": not self._is_operator and self._desk.pairing is not None,
                "client": self._id,
            }
        )
        self._outbox.put(encode(hello))
        self._desk.hub.join(self._outbox)
        people.announce()
        close_code: CloseCode | None = None
        tasks: list[asyncio.Task[CloseCode | None]] = []
        try:
            await self._websocket.accept()
            jobs = (self._send(), self._receive(), self._carry_out(), self._until_stopped())
            tasks = [asyncio.create_task(each) for each in jobs]
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            close_code = next((task.result() for task in done), None)
        except (WebSocketDisconnect, RuntimeError, OSError) as error:
            _log.debug("A link to %s ended: %s", self._address, error)
        except asyncio.CancelledError:
            close_code = CloseCode.GOING_AWAY
            raise
        finally:
            self._desk.hub.leave(self._outbox)
            people.leave(self._id)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            if close_code is not None:
                await self._close(close_code)

    @property
    def _role(self) -> Literal["viewer", "operator"]:
        return "operator" if self._is_operator else "viewer"

    async def _close(self, code: CloseCode) -> None:
        async def last_words() -> None:
            while (text := self._outbox.take()) is not None:
                await self._websocket.send_text(text)
            await self._websocket.close(code)

        with contextlib.suppress(TimeoutError, WebSocketDisconnect, RuntimeError, OSError):
            await asyncio.wait_for(last_words(), CLOSE_S)

    async def _until_stopped(self) -> CloseCode:
        await self._desk.closing.wait()
        return CloseCode.GOING_AWAY

    async def _send(self) -> None:
        while True:
            await self._websocket.send_text(await self._outbox.next())

    async def _receive(self) -> CloseCode | None:
        """Return why the link must be closed, or None when the client closed it."""
        bad, count, second = 0, 0, 0
        while True:
            event = await self._websocket.receive()
            if event["type"] == "websocket.disconnect":
                return None
            now_s = self._desk.clock.now_ns() // 1_000_000_000
            count = count + 1 if now_s == second else 1
            second = now_s
            if count > MAX_MESSAGES_PER_S:
                self._refuse("message", f"More than {MAX_MESSAGES_PER_S} messages in a second: the link is closed.")
                return CloseCode.MISUSE
            try:
                text = event.get("text")
                if text is None:
                    raise ProtocolError("A message must be text, not binary.")
                self._handle(decode(text))
            except ProtocolError as error:
                bad += 1
                self._refuse("message", str(error))
                if bad >= MAX_BAD_MESSAGES:
                    return CloseCode.MISUSE

    def _handle(self, message: ClientSent) -> None:
        if isinstance(message, messages.Ack):
            self._outbox.acknowledge(message.seq)
        elif isinstance(message, messages.Ping):
            self._outbox.put(encode(Pong(client_t=message.t, t=seconds(self._desk.clock.now_ns()))))
        elif isinstance(message, ViewReport):
            self._report(message)
        elif isinstance(message, Follow):
            self._desk.hub.people.follow(self._id, message.client)
        elif message.name == "pair":
            self._pair(message)
        elif not self._is_operator:
            sentence = "Viewers may not command: pair first, with the six-digit code that the server's console shows."
            self._refuse("role", sentence, message.id)
        elif self._commands.full():
            self._refuse("command", f"{MAX_COMMANDS_WAITING} commands wait already: try again.", message.id)
        else:
            self._commands.put_nowait(message)

    def _report(self, view: ViewReport) -> None:
        """Take what the client looks at; raises ProtocolError when it cannot be handed on."""
        try:
            self._desk.hub.people.report(self._id, view)
        except ValueError as error:
            raise ProtocolError(f"The view is not one of the protocol: {error}.") from error

    def _pair(self, command: messages.Command) -> None:
        if not self._is_operator:
            if self._desk.pairing is None:
                self._refuse("pairing", "This server was started without a pairing code.", command.id)
                return
            try:
                self._desk.pairing.check(self._address, command.args.get("code"))
            except ProtocolError as error:
                self._refuse("pairing", str(error), command.id)
                return
            self._is_operator = True
            self._desk.hub.people.set_role(self._id, self._role)
        self._done(command, {"role": "operator"})

    async def _carry_out(self) -> None:
        """Carry out this client's commands in their order, beside the messages that come in meanwhile."""
        loop = asyncio.get_running_loop()
        while True:
            command = await self._commands.get()
            try:
                result = await loop.run_in_executor(self._desk.executor, self._desk.commands, command)
                self._done(command, jsonable(result))
            except (CathxrError, ValueError) as error:
                self._refuse("command", str(error) or f"The command {command.name} was refused.", command.id)
            except Exception:
                # One faulty command must not end the link, nor be silent.
                _log.exception("The command %s failed", command.name)
                sentence = f"The command {command.name} failed inside the server: its log says why."
                self._refuse("command", sentence, command.id)

    def _done(self, command: messages.Command, result: Mapping[str, Any]) -> None:
        payload = {"id": command.id, "name": command.name, "result": result}
        self._outbox.put(encode(EventMessage(t=seconds(self._desk.clock.now_ns()), kind="done", payload=payload)))

    def _refuse(self, code: Any, sentence: str, command_id: str | None = None) -> None:
        self._outbox.put(encode(Refusal(code=code, sentence=sentence, id=command_id)))
