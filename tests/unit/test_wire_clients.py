"""Who is connected, who follows whom, and how often views are handed on: with a clock of the test's own."""

import asyncio
import json
from collections.abc import Callable
from typing import Any

import pytest

from cathxr.core import ConfigError
from cathxr.wire.clients import VIEW_EVERY_S, Clients
from cathxr.wire.hub import Hub
from cathxr.wire.messages import ACK_WINDOW
from cathxr.wire.outbox import Outbox
from cathxr.wire.view_messages import HeadPose, ViewReport


class HandClock:
    """An event loop's time, moved by hand."""

    def __init__(self) -> None:
        self.now = 100.0
        self.due: list[tuple[float, Callable[..., Any], tuple[Any, ...]]] = []

    def time(self) -> float:
        return self.now

    def call_later(self, delay: float, callback: Callable[..., Any], *args: Any) -> asyncio.TimerHandle:
        entry = (self.now + delay, callback, args)
        self.due.append(entry)

        class Handle:
            def cancel(_self) -> None:  # noqa: N805
                self.due.remove(entry)

        return Handle()  # type: ignore[return-value]

    def pass_s(self, seconds: float) -> None:
        self.now += seconds
        for entry in [each for each in self.due if each[0] <= self.now]:
            self.due.remove(entry)
            entry[1](*entry[2])


class Person:
    """A client, and what it was sent."""

    def __init__(self, clients: Clients, role: Any = "viewer") -> None:
        self.outbox = Outbox()
        self.clients = clients
        self.id = clients.join(self.outbox, role)
        clients.announce()

    def got(self, kind: str) -> list[dict[str, Any]]:
        """Return the messages of a kind that wait, and forget all that wait."""
        found = []
        while (text := self.outbox.take()) is not None:
            message = json.loads(text)
            if message["type"] == kind:
                found.append(message)
        return found

    def looks(self, x_mm: float, kind: Any = "desktop") -> None:
        head = HeadPose(position_mm=(x_mm, 0.0, 0.0), orientation_wxyz=(1.0, 0.0, 0.0, 0.0))
        self.clients.report(self.id, ViewReport(kind=kind, settings={"ice": True}, head=head))


@pytest.fixture
def clock() -> HandClock:
    return HandClock()


@pytest.fixture
def clients(clock: HandClock) -> Clients:
    made = Clients()
    made.bind(clock)
    return made


def test_everybody_is_told_of_everybody_by_names_that_are_free(clients: Clients) -> None:
    first, second = Person(clients, "operator"), Person(clients)
    assert [(each["name"], each["role"]) for each in first.got("clients")[-1]["clients"]] == [
        ("Program 1", "operator"),
        ("Program 2", "viewer"),
    ]
    first.looks(0)
    second.looks(0, "headset")
    names = {each["id"]: each["name"] for each in second.got("clients")[-1]["clients"]}
    assert names == {first.id: "Desktop 1", second.id: "Headset 1"}
    third = Person(clients)
    third.looks(0, "headset")
    clients.leave(second.id)
    fourth = Person(clients)
    fourth.looks(0, "headset")
    known = {each["id"]: each["name"] for each in first.got("clients")[-1]["clients"]}
    assert known == {first.id: "Desktop 1", third.id: "Headset 2", fourth.id: "Headset 1"}
    clients.set_role(third.id, "operator")
    assert {each["id"]: each["role"] for each in first.got("clients")[-1]["clients"]}[third.id] == "operator"


def test_views_go_to_followers_only_beginning_with_the_newest(clients: Clients) -> None:
    wearer, instructor, other = Person(clients), Person(clients), Person(clients)
    wearer.looks(1, "headset")
    instructor.got("clients")
    clients.follow(instructor.id, wearer.id)
    assert instructor.outbox.take() is not None  # `following` comes first
    (view,) = instructor.got("view")
    assert view["client"] == wearer.id
    assert view["head"]["position_mm"] == [1.0, 0.0, 0.0]
    assert view["settings"] == {"ice": True}
    wearer.looks(2, "headset")
    assert [each["head"]["position_mm"][0] for each in instructor.got("view")] == [2.0]
    assert other.got("view") == []
    clients.follow(instructor.id, None)
    assert instructor.got("following") == [{"type": "following", "client": None, "sentence": ""}]
    wearer.looks(3, "headset")
    assert instructor.got("view") == []


def test_at_most_ten_views_a_second_and_the_last_one_always_comes(clients: Clients, clock: HandClock) -> None:
    wearer, instructor = Person(clients), Person(clients)
    wearer.looks(0)
    clients.follow(instructor.id, wearer.id)
    instructor.got("view")
    clock.pass_s(1.0)
    seen: list[float] = []
    for step in range(1, 101):  # a hundred views in one second
        wearer.looks(step)
        clock.pass_s(0.01)
        seen += [each["head"]["position_mm"][0] for each in instructor.got("view")]
    clock.pass_s(VIEW_EVERY_S)
    seen += [each["head"]["position_mm"][0] for each in instructor.got("view")]
    assert len(seen) <= 1.0 / VIEW_EVERY_S + 2  # the first at once, and the last after the second
    assert seen == sorted(seen)
    assert seen[-1] == 100.0


def test_a_follower_is_told_when_the_followed_one_leaves(clients: Clients) -> None:
    wearer, instructor = Person(clients), Person(clients)
    wearer.looks(0, "headset")
    clients.follow(instructor.id, wearer.id)
    instructor.got("view")
    clients.leave(wearer.id)
    (told,) = instructor.got("following")
    assert told["client"] is None
    assert told["sentence"] == "Headset 1 has left: nobody is followed any more."
    clients.leave(instructor.id)
    clients.leave(instructor.id)  # twice: nothing happens


@pytest.mark.parametrize("whom", ["self", "nobody", "program", "circle"])
def test_who_cannot_be_followed_is_said(clients: Clients, whom: str) -> None:
    one, two, three = Person(clients), Person(clients), Person(clients)
    one.looks(0)
    two.looks(0)
    clients.follow(two.id, one.id)
    wanted = {"self": one.id, "nobody": "99", "program": three.id, "circle": two.id}[whom]
    one.got("clients")
    clients.follow(one.id, wanted)
    (told,) = one.got("following")
    assert told["client"] is None
    words = {"self": "themselves", "nobody": "has left", "program": "shows no view", "circle": "follows you already"}
    assert words[whom] in told["sentence"]


def test_a_stalled_client_finds_the_newest_view_only(clients: Clients) -> None:
    wearer, instructor = Person(clients), Person(clients)
    wearer.looks(0)
    clients.follow(instructor.id, wearer.id)
    instructor.got("view")
    outbox = instructor.outbox
    outbox.acknowledge(0)
    for seq in range(ACK_WINDOW):
        outbox.offer_track(seq, json.dumps({"type": "track", "seq": seq}))
        assert outbox.take() is not None
    for step in range(1, 50):
        clients._hand_on(clients._clients[wearer.id])  # the clock is another test's
        wearer.looks(step)
    clients._hand_on(clients._clients[wearer.id])
    assert outbox.take() is None
    outbox.acknowledge(ACK_WINDOW - 1)
    assert [each["head"]["position_mm"][0] for each in instructor.got("view")] == [49.0]


@pytest.mark.parametrize(
    "settings",
    [{"text": "x" * 20_000}, {"a": {"b": {"c": {"d": {"e": {"f": {"g": 1}}}}}}}],
    ids=["too many", "too deep"],
)
def test_settings_are_bounded(clients: Clients, settings: dict[str, Any]) -> None:
    wearer = Person(clients)
    with pytest.raises(ValueError, match=r"settings|payload"):
        clients.report(wearer.id, ViewReport(kind="desktop", settings=settings))
    with pytest.raises(ConfigError, match="cannot be locked"):
        Hub().publish_lock(settings, "A training session runs.")
