"""Messages from nouns, and what clients send: beyond what the round trip in property/ holds."""

import json

import numpy as np
import pytest

from cathxr.core import Event, Health, Pose, ProtocolError, Status, Track
from cathxr.wire.convert import (
    decode,
    encode,
    event_message,
    health_message,
    jsonable,
    track_from_message,
    track_message,
)
from cathxr.wire.messages import Ack, Command, Ping, TrackMessage


def test_a_lost_track_has_nulls_and_a_reason() -> None:
    message = json.loads(encode(track_message(Track(3, 2_000_000_000, Status.LOST, reason="no catheter"))))
    assert message == {
        "type": "track",
        "seq": 3,
        "t": 2.0,
        "status": "lost",
        "reason": "no catheter",
        "roll_predicted": False,
        **dict.fromkeys(("points", "tip", "roll", "yaw", "pitch", "sigma_mm", "latency_ms")),
    }


def test_angles_are_those_of_the_tips_tangent() -> None:
    # z of the tip along +y of box: yaw 90 degrees, pitch 0. Turned about x by -90 degrees.
    pose = Pose(np.array([np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0]), np.zeros(3))
    track = Track(0, 0, Status.TRACKED, "", np.zeros((2, 3)), pose, 7.0, 0.1, 4_000_000)
    message = track_message(track)
    assert message.yaw == pytest.approx(np.pi / 2, abs=1e-6)  # rounded to 1e-6
    assert message.pitch == pytest.approx(0, abs=1e-6)
    assert (message.roll, message.latency_ms) == (7.0, 4.0)


def test_nan_never_goes_out() -> None:
    pose = Pose.identity()
    with pytest.raises(ValueError, match="finite"):
        track_message(Track(0, 0, Status.TRACKED, "", np.zeros((2, 3)), pose, float("nan"), 0.1))
    with pytest.raises(ValueError, match="finite"):
        health_message([Health(0, "top", True, None, float("inf"), 0)], t_ns=0, skew_ns=None, clients=0, skipped=0)


def test_a_message_that_contradicts_itself_makes_no_track() -> None:
    message = track_message(Track(3, 0, Status.LOST, reason="no catheter"))
    with pytest.raises(ProtocolError, match="seq 3 contradicts itself"):
        track_from_message(message.model_copy(update={"sigma_mm": 1.0}))
    with pytest.raises(ValueError, match="extra"):
        TrackMessage.model_validate({**message.model_dump(), "more": 1})


def test_payloads_become_json() -> None:
    payload = {"tip": np.array([1.0, np.nan]), "n": np.int64(3), "on": np.True_, "status": Status.LOST, "in": ({},)}
    message = event_message(Event(1_000, "truth", payload))
    assert json.loads(encode(message))["payload"] == {
        "tip": [1.0, None],
        "n": 3,
        "on": True,
        "status": "lost",
        "in": [{}],
    }
    with pytest.raises(ValueError, match="got object"):
        jsonable({"what": object()})
    endless: list[object] = []
    endless.append(endless)
    with pytest.raises(ValueError, match="nests too deep"):
        jsonable(endless)


def test_client_messages_are_read() -> None:
    assert decode('{"type": "ack", "seq": 4}') == Ack(seq=4)
    assert decode('{"type": "ping", "t": 4}') == Ping(t=4.0)
    assert decode(b'{"type": "command", "name": "pair", "args": {"code": "1"}}') == Command(
        name="pair", args={"code": "1"}
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not JSON"),
        ("3", "JSON object"),
        ('{"seq": 1}', "type"),
        ('{"type": "ack", "seq": 1.5}', "ack.seq"),
        ('{"type": "ack", "seq": true}', "ack.seq"),
        ('{"type": "command", "name": "a", "id": 3}', "command.id"),
        ('{"type": "command", "name": "a", "args": {"x": -Infinity}}', "not JSON"),
        ('{"type": "command", "name": "a", "args": ' + '{"a":' * 40 + "1" + "}" * 40 + "}", "deeper"),
    ],
)
def test_a_refusal_says_what_is_wrong(text: str, said: str) -> None:
    with pytest.raises(ProtocolError, match=said):
        decode(text)
