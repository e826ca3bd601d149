"""Nouns to messages and back.

Lengths are rounded to 0.1 um, angles to 1 urad, instants to 1 us: finer than any sensor here.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError
from pydantic_core import from_json, to_json

from cathxr.core import Event, Health, Pose, ProtocolError, RollStatus, Status, Track
from cathxr.wire import messages
from cathxr.wire.message import Message
from cathxr.wire.view_messages import Follow, ViewReport

MM_DECIMALS = 4
RAD_DECIMALS = 6
UNIT_DECIMALS = 7
SECONDS_DECIMALS = 6
MAX_DEPTH = 32
"""How deep lists and objects may nest in a payload or a client's message."""
MAX_SETTINGS_DEPTH = 6
"""How deep the scene's settings may nest: parts by name, and what is set of each, are three levels."""
MAX_SETTINGS_BYTES = 16 * 1024
"""How long the scene's settings may be as JSON."""

ClientSent = messages.Command | messages.Ping | messages.Ack | ViewReport | Follow
_CLIENT: TypeAdapter[ClientSent] = TypeAdapter(messages.ClientMessage)


def seconds(t_ns: int) -> float:
    """Return an instant of the host's monotonic clock as the wire writes it: seconds, to 1 us."""
    return round(t_ns * 1e-9, SECONDS_DECIMALS)


def track_message(track: Track) -> messages.TrackMessage:
    """Return the message for one Track.

    Raises:
        ValueError: a number is not finite.
    """
    points, tip = None, None
    if track.shape_box is not None and track.box_from_tip is not None:
        points = [(x, y, z) for x, y, z in np.round(track.shape_box, MM_DECIMALS).tolist()]
        w, i, j, k = np.round(track.box_from_tip.rotation_wxyz, UNIT_DECIMALS).tolist()
        x, y, z = np.round(track.box_from_tip.translation_mm, MM_DECIMALS).tolist()
        tip = messages.TipState(position=(x, y, z), orientation_wxyz=(w, i, j, k))
    return messages.TrackMessage(
        seq=track.seq,
        t=seconds(track.t_ns),
        status=track.status.value,
        reason=track.reason,
        points=points,
        tip=tip,
        roll=_rounded(track.roll_rad, RAD_DECIMALS),
        roll_predicted=track.roll_predicted,
        yaw=_rounded(track.yaw_rad, RAD_DECIMALS),
        pitch=_rounded(track.pitch_rad, RAD_DECIMALS),
        sigma_mm=_rounded(track.sigma_mm, MM_DECIMALS),
        latency_ms=None if track.latency_ns is None else round(track.latency_ns * 1e-6, 3),
    )


def track_from_message(message: messages.TrackMessage) -> Track:
    """Return the Track that a message tells of, to within the wire's rounding.

    Raises:
        ProtocolError: the message contradicts itself (a lost Track with a pose, a tracked one without).
    """
    try:
        return Track(
            seq=message.seq,
            t_ns=round(message.t * 1e9),
            status=Status(message.status),
            reason=message.reason,
            shape_box=None if message.points is None else np.array(message.points),
            box_from_tip=None
            if message.tip is None
            else Pose(np.array(message.tip.orientation_wxyz), np.array(message.tip.position)),
            roll_rad=message.roll,
            sigma_mm=message.sigma_mm,
            latency_ns=None if message.latency_ms is None else round(message.latency_ms * 1e6),
            roll_predicted=message.roll_predicted,
        )
    except ValueError as error:
        raise ProtocolError(f"The track message with seq {message.seq} contradicts itself: {error}.") from error


def roll_message(status: RollStatus, *, predicted: bool) -> messages.RollState:
    """Return the message for the roll's validity."""
    return messages.RollState(
        present=status.present,
        valid=status.valid,
        needs=status.needs,
        sentence=status.sentence,
        predicted=predicted,
    )


def event_message(event: Event) -> messages.EventMessage:
    """Return the message for one Event.

    Raises:
        ValueError: the payload holds something that JSON has no form for.
    """
    return messages.EventMessage(t=seconds(event.t_ns), kind=event.kind, payload=jsonable(event.payload))


def health_message(
    sources: Sequence[Health], *, t_ns: int, skew_ns: int | None, clients: int, skipped: int
) -> messages.HealthMessage:
    """Return the message for the state of every source, as one client gets it.

    Raises:
        ValueError: a number is not finite.
    """
    return messages.HealthMessage(
        t=seconds(t_ns),
        sources=[
            messages.SourceHealth(
                source=each.source,
                running=each.running,
                age_s=_rounded(each.age_s, 3),
                rate_hz=round(each.rate_hz, 2),
                losses=each.losses,
                last_error=each.last_error,
            )
            for each in sources
        ],
        skew_ms=None if skew_ns is None else round(skew_ns * 1e-6, 3),
        clients=clients,
        skipped=skipped,
    )


def encode(message: Message) -> str:
    """Return a message as the JSON text that goes over the link."""
    return message.model_dump_json()


def decode(text: str | bytes) -> ClientSent:
    """Return the message that a client sent.

    Raises:
        ProtocolError: it is not JSON, or not a message of the protocol; the sentence says what is wrong.
    """
    try:
        value = from_json(text, allow_inf_nan=False, cache_strings="keys")
    except ValueError as error:
        raise ProtocolError(f"The message is not JSON: {_short(error)}.") from error
    if not isinstance(value, dict):
        raise ProtocolError("A message must be a JSON object with a type: command, ping, ack, view or follow.")
    try:
        message = _CLIENT.validate_python(value, strict=True)
    except ValidationError as error:
        raise ProtocolError(_first_fault(error)) from error
    # What the other messages hold is flat, and acks come at the rate of the Tracks.
    if isinstance(message, messages.Command) and _deeper_than(message.args, MAX_DEPTH):
        raise ProtocolError(f"The command's args nest deeper than {MAX_DEPTH} levels.")
    return message


def jsonable(value: Any) -> Any:
    """Return `value` in JSON's own types: NumPy numbers and arrays unpacked, numbers that are not finite as null.

    Raises:
        ValueError: it holds something that JSON has no form for, or nests too deep.
    """
    return _jsonable(value, MAX_DEPTH)


def settings_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the scene's settings in JSON's own types, numbers that are not finite as null.

    Raises:
        ValueError: they hold something that JSON has no form for, nest too deep, or are too many.
    """
    settings: dict[str, Any] = _jsonable(values, MAX_SETTINGS_DEPTH)
    size = len(to_json(settings))
    if size > MAX_SETTINGS_BYTES:
        raise ValueError(f"settings: expected at most {MAX_SETTINGS_BYTES} bytes of JSON, got {size}")
    return settings


def _jsonable(value: Any, depth: int) -> Any:
    if depth == 0:
        raise ValueError("payload: it nests too deep")
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, str):
        return str(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _jsonable(each, depth - 1) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_jsonable(each, depth - 1) for each in value]
    raise ValueError(f"payload: expected values that JSON can hold, got {type(value).__name__}")


def _deeper_than(value: Any, depth: int) -> bool:
    if isinstance(value, dict):
        return depth == 0 or any(_deeper_than(each, depth - 1) for each in value.values())
    if isinstance(value, list):
        return depth == 0 or any(_deeper_than(each, depth - 1) for each in value)
    return False


def _rounded(value: float | None, decimals: int) -> float | None:
    return None if value is None else round(float(value), decimals)


def _first_fault(error: ValidationError) -> str:
    fault = error.errors(include_url=False, include_context=False, include_input=False)[0]
    where = ".".join(str(each) for each in fault["loc"])
    return f"The message is not one of the protocol: {where + ': ' if where else ''}{_short(fault['msg'])}."


def _short(fault: object) -> str:
    """Return the first words of a fault, so that hostile input is not echoed at length."""
    return str(fault).splitlines()[0][:160].rstrip(".")
