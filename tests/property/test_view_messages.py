"""Whatever a client sends as its view: it is taken and handed on as strict JSON, or refused with a sentence."""

import asyncio
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cathxr.core import ConfigError, ProtocolError
from cathxr.wire.clients import Clients
from cathxr.wire.convert import MAX_SETTINGS_BYTES, decode, settings_of
from cathxr.wire.hub import Hub
from cathxr.wire.outbox import Outbox
from cathxr.wire.view_messages import ViewReport

_ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=30),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=12), inner, max_size=4),
    max_leaves=25,
)
_VIEWS = st.fixed_dictionaries(
    {"type": st.just("view"), "kind": st.sampled_from(["desktop", "headset"]), "settings": _ANYTHING},
    optional={"head": _ANYTHING, "world": _ANYTHING},
)
_GOOD_HEAD = {"position_mm": [1.0, 2.0, 3.0], "orientation_wxyz": [1.0, 0.0, 0.0, 0.0]}


def _strict(text: str) -> Any:
    def fail(name: str) -> None:
        raise AssertionError(f"{name} on the wire")

    return json.loads(text, parse_constant=fail)


def _handed_on(view: ViewReport) -> dict[str, Any]:
    """Return what a follower gets."""
    clients, follower, followed = Clients(), Outbox(), Outbox()
    loop = asyncio.new_event_loop()
    try:
        clients.bind(loop)
        ids = clients.join(followed, "viewer"), clients.join(follower, "viewer")
        clients.report(ids[0], view)
        clients.follow(ids[1], ids[0])
    finally:
        loop.close()
    texts = []
    while (text := follower.take()) is not None:
        texts.append(_strict(text))
    (found,) = [each for each in texts if each["type"] == "view"]
    return dict(found)


@given(_VIEWS)
def test_a_view_is_taken_or_refused_with_a_sentence(view: dict[str, Any]) -> None:
    try:
        message = decode(json.dumps(view))
        assert isinstance(message, ViewReport)
        handed = _handed_on(message)
    except (ProtocolError, ValueError) as error:
        sentence = str(error)
    else:
        assert handed["settings"] == settings_of(message.settings)
        return
    assert len(sentence.split()) > 3


@given(st.dictionaries(st.text(max_size=20), _ANYTHING, max_size=6))
def test_settings_come_through_as_they_are_or_are_refused(settings: dict[str, Any]) -> None:
    view = ViewReport.model_validate({"kind": "desktop", "settings": settings, "head": _GOOD_HEAD})
    try:
        expected = settings_of(settings)
    except ValueError:
        with pytest.raises(ConfigError):
            Hub().publish_lock(settings, "Why.")
        return
    assert len(json.dumps(expected, separators=(",", ":"), ensure_ascii=False).encode()) <= MAX_SETTINGS_BYTES + 64
    assert _handed_on(view)["settings"] == expected
    Hub().publish_lock(settings, "Why.")


@pytest.mark.parametrize(
    "head",
    [
        {**_GOOD_HEAD, "position_mm": ["1", 2, 3]},
        {**_GOOD_HEAD, "position_mm": [1, 2]},
        {**_GOOD_HEAD, "position_mm": [True, 2, 3]},
        {**_GOOD_HEAD, "position_mm": [1e300, 2, 3]},
        {**_GOOD_HEAD, "orientation_wxyz": [0, 0, 0, 0]},
        {**_GOOD_HEAD, "orientation_wxyz": [2, 0, 0, 0]},
        {**_GOOD_HEAD, "more": 1},
        [],
    ],
)
def test_a_head_is_a_place_and_a_direction(head: object) -> None:
    with pytest.raises(ProtocolError, match="head"):
        decode(json.dumps({"type": "view", "kind": "desktop", "settings": {}, "head": head}))
