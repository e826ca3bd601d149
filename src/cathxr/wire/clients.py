"""Who is connected, what each looks at, and who follows whom. For the event loop's thread only, but `headsets`."""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from cathxr.wire.convert import encode, settings_of
from cathxr.wire.outbox import Outbox
from cathxr.wire.view_messages import (
    ClientDescription,
    ClientKind,
    ClientsMessage,
    FollowingMessage,
    ViewMessage,
    ViewReport,
)

_log = logging.getLogger(__name__)

VIEW_EVERY_S = 0.1
"""The shortest time between two views of one client that are handed on."""
_NAMES: dict[ClientKind, str] = {"desktop": "Desktop", "headset": "Headset", "program": "Program"}

Role = Literal["viewer", "operator"]


class Timing(Protocol):
    """The part of an event loop that is used: tests give their own."""

    def time(self) -> float: ...
    def call_later(self, delay: float, callback: Callable[..., Any], *args: Any) -> asyncio.TimerHandle: ...


@dataclass(eq=False)
class _Client:
    id: str
    outbox: Outbox
    role: Role
    kind: ClientKind = "program"
    number: int = 0
    view: ViewReport | None = None
    follows: "_Client | None" = None
    sent_s: float = -1e9
    timer: asyncio.TimerHandle | None = None
    followers: "set[_Client]" = field(default_factory=set)

    @property
    def name(self) -> str:
        return f"{_NAMES[self.kind]} {self.number}"


class Clients:
    """The connected clients. Every view goes to those who follow its client: the newest, at most ten a second."""

    def __init__(self) -> None:
        self._clients: dict[str, _Client] = {}
        self._joined = 0
        self._timing: Timing | None = None

    def bind(self, timing: Timing) -> None:
        """Take the time from an event loop from now on."""
        self._timing = timing

    def clear(self) -> None:
        """Forget everybody: the loop has ended."""
        for each in self._clients.values():
            if each.timer is not None:
                each.timer.cancel()
        self._clients.clear()

    def join(self, outbox: Outbox, role: Role) -> str:
        """Return the id of a new client, which the next `announce` tells everybody of."""
        self._joined += 1
        client = _Client(str(self._joined), outbox, role)
        client.number = self._free_number("program")
        self._clients[client.id] = client
        return client.id

    def leave(self, client_id: str) -> None:
        """Forget a client; those who followed it are told."""
        client = self._clients.pop(client_id, None)
        if client is None:
            return
        self._unfollow(client)
        if client.timer is not None:
            client.timer.cancel()
        for follower in list(client.followers):
            self._unfollow(follower)
            _tell(follower, None, f"{client.name} has left: nobody is followed any more.")
        self.announce()

    def headsets(self) -> int:
        """Return how many headsets are connected. From any thread: it looks at a copy of the list."""
        return sum(each.kind == "headset" for each in tuple(self._clients.values()))

    def set_role(self, client_id: str, role: Role) -> None:
        """Note what a client may do now."""
        client = self._clients.get(client_id)
        if client is not None and client.role != role:
            client.role = role
            self.announce()

    def report(self, client_id: str, view: ViewReport) -> None:
        """Take what a client looks at.

        Raises:
            ValueError: its settings are too many, or nest too deep.
        """
        client = self._clients.get(client_id)
        if client is None:
            return
        client.view = view.model_copy(update={"settings": settings_of(view.settings)})
        if client.kind != view.kind:
            client.number = self._free_number(view.kind)
            client.kind = view.kind
            self.announce()
        if client.followers and client.timer is None and self._timing is not None:
            wait_s = client.sent_s + VIEW_EVERY_S - self._timing.time()
            if wait_s <= 0.0:
                self._hand_on(client)
            else:
                client.timer = self._timing.call_later(wait_s, self._hand_on, client)

    def follow(self, client_id: str, wanted: str | None) -> None:
        """Have a client follow another (None: nobody), and tell it so, or why not."""
        client = self._clients.get(client_id)
        if client is None:
            return
        followed = None if wanted is None else self._clients.get(wanted)
        fault = "" if wanted is None else _fault(client, followed)
        self._unfollow(client)
        if followed is None or fault:
            _tell(client, None, fault)
            return
        client.follows = followed
        followed.followers.add(client)
        _tell(client, followed.id, "")
        if followed.view is not None:
            _send([client], followed.id, followed.view)

    def announce(self) -> None:
        """Tell everybody who is connected."""
        known = [
            ClientDescription(id=each.id, kind=each.kind, name=each.name, role=each.role)
            for each in self._clients.values()
        ]
        text = encode(ClientsMessage(clients=known))
        for each in self._clients.values():
            each.outbox.replace("clients", text)

    def _hand_on(self, client: _Client) -> None:
        client.timer = None
        if client.view is not None and client.followers and self._timing is not None:
            client.sent_s = self._timing.time()
            _send(client.followers, client.id, client.view)

    def _unfollow(self, client: _Client) -> None:
        if client.follows is not None:
            client.follows.followers.discard(client)
            client.follows = None
        client.outbox.drop_view()

    def _free_number(self, kind: ClientKind) -> int:
        taken = {each.number for each in self._clients.values() if each.kind == kind}
        return next(number for number in range(1, len(taken) + 2) if number not in taken)


def _fault(client: _Client, followed: _Client | None) -> str:
    """Return why `client` may not follow `followed`; empty when it may."""
    if followed is None:
        return "Whom you want to follow has left."
    if followed is client:
        return "Nobody can follow themselves: choose another."
    if followed.kind == "program":
        return f"{followed.name} shows no view that could be followed: choose a desktop or a headset."
    at: _Client | None = followed
    while at is not None:
        if at is client:
            return f"{followed.name} follows you already: one of the two must stop first."
        at = at.follows
    return ""


def _tell(client: _Client, followed: str | None, sentence: str) -> None:
    client.outbox.put(encode(FollowingMessage(client=followed, sentence=sentence)))


def _send(followers: "set[_Client] | list[_Client]", client_id: str, view: ViewReport) -> None:
    text = encode(ViewMessage(client=client_id, settings=view.settings, head=view.head, world=view.world))
    for each in followers:
        each.outbox.offer_view(text)
