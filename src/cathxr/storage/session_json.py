"""The nouns as JSON and back, to the last bit: Python writes the shortest text that gives the same float again."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cathxr.core import Detection, Event, FloatArray, Health, Observation, Pose, Reading, Status, Track


@dataclass(frozen=True)
class Picture:
    """Where a picture is: the 0-based `frame` of its camera's video."""

    camera: str
    seq: int
    t_ns: int
    frame: int


Item = Reading | Observation | Track | Event | Health | Picture
"""What a session holds."""


def encoded(value: Mapping[str, Any]) -> bytes:
    """Return JSON, compact, in UTF-8.

    Raises:
        ValueError: NaN or infinity; TypeError: something that JSON cannot say.
    """
    return json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=False).encode("utf-8")


def reading_json(reading: Reading) -> dict[str, Any]:
    """Return a Reading for JSON."""
    return {
        "seq": int(reading.seq),
        "t_ns": int(reading.t_ns),
        "count": int(reading.count),
        "illegal": int(reading.illegal),
        "flags": int(reading.flags),
    }


def observation_json(observation: Observation) -> dict[str, Any]:
    """Return an Observation for JSON, with every measurement that the fit consumes."""
    return {
        "seq": int(observation.seq),
        "t_ns": int(observation.t_ns),
        "skew_ns": int(observation.skew_ns),
        "roll_rad": _number(observation.roll_rad),
        "roll_predicted": bool(observation.roll_predicted),
        "detections": [_detection_json(each) for each in observation.detections],
    }


def track_json(track: Track) -> dict[str, Any]:
    """Return a Track for JSON; null where a lost one has nothing."""
    pose = track.box_from_tip
    return {
        "seq": int(track.seq),
        "t_ns": int(track.t_ns),
        "status": track.status.value,
        "reason": track.reason,
        "shape_box": None if track.shape_box is None else track.shape_box.tolist(),
        "box_from_tip": None
        if pose is None
        else {"rotation_wxyz": pose.rotation_wxyz.tolist(), "translation_mm": pose.translation_mm.tolist()},
        "roll_rad": _number(track.roll_rad),
        "roll_predicted": bool(track.roll_predicted),
        "sigma_mm": _number(track.sigma_mm),
        "latency_ns": None if track.latency_ns is None else int(track.latency_ns),
    }


def event_json(event: Event) -> dict[str, Any]:
    """Return an Event for JSON."""
    return {"t_ns": int(event.t_ns), "kind": event.kind, "payload": dict(event.payload)}


def health_json(health: Health) -> dict[str, Any]:
    """Return a Health for JSON."""
    return {
        "t_ns": int(health.t_ns),
        "source": health.source,
        "running": bool(health.running),
        "age_s": _number(health.age_s),
        "rate_hz": float(health.rate_hz),
        "losses": int(health.losses),
        "last_error": health.last_error,
    }


def picture_json(picture: Picture) -> dict[str, Any]:
    """Return a Picture for JSON."""
    return {
        "camera": picture.camera,
        "seq": int(picture.seq),
        "t_ns": int(picture.t_ns),
        "frame": int(picture.frame),
    }


def decoded(topic: str, data: bytes) -> Item:
    """Return the value of a message on `topic`.

    Raises:
        ValueError, KeyError, TypeError: it is not what the topic's schema says.
    """
    values = json.loads(data)
    return _READERS[topic](values)


def _observation(values: dict[str, Any]) -> Observation:
    detections = tuple(_detection(each) for each in values["detections"])
    # Sessions of before the roll's flag have none.
    predicted = values.get("roll_predicted", False)
    return Observation(values["seq"], values["t_ns"], detections, values["skew_ns"], values["roll_rad"], predicted)


def _track(values: dict[str, Any]) -> Track:
    shape, pose = values["shape_box"], values["box_from_tip"]
    return Track(
        seq=values["seq"],
        t_ns=values["t_ns"],
        status=Status(values["status"]),
        reason=values["reason"],
        shape_box=None if shape is None else np.array(shape),
        box_from_tip=None if pose is None else Pose(np.array(pose["rotation_wxyz"]), np.array(pose["translation_mm"])),
        roll_rad=values["roll_rad"],
        sigma_mm=values["sigma_mm"],
        latency_ns=values["latency_ns"],
        roll_predicted=values.get("roll_predicted", False),
    )


def _detection_json(detection: Detection) -> dict[str, Any]:
    return {
        "camera": detection.camera,
        "seq": int(detection.seq),
        "t_ns": int(detection.t_ns),
        "curve_px": detection.curve_px.tolist(),
        "normal_px": detection.normal_px.tolist(),
        "sigma_px": detection.sigma_px.tolist(),
        "half_width_px": detection.half_width_px.tolist(),
        "tip_px": None if detection.tip_px is None else detection.tip_px.tolist(),
        "tip_sigma_px": _number(detection.tip_sigma_px),
        "end_px": detection.end_px.tolist(),
        "end_sigma_px": detection.end_sigma_px.tolist(),
        "rim_px": detection.rim_px.tolist(),
        "rim_sigma_px": detection.rim_sigma_px.tolist(),
        "reason": detection.reason,
        "repeats": int(detection.repeats),
    }


def _detection(values: dict[str, Any]) -> Detection:
    tip = values["tip_px"]
    return Detection(
        camera=values["camera"],
        seq=values["seq"],
        t_ns=values["t_ns"],
        curve_px=_points(values["curve_px"]),
        normal_px=_points(values["normal_px"]),
        sigma_px=np.array(values["sigma_px"], dtype=np.float64),
        half_width_px=np.array(values["half_width_px"], dtype=np.float64),
        tip_px=None if tip is None else np.array(tip),
        tip_sigma_px=values["tip_sigma_px"],
        end_px=_points(values.get("end_px", [])),  # recordings from before have none
        end_sigma_px=np.array(values.get("end_sigma_px", []), dtype=np.float64),
        rim_px=_points(values.get("rim_px", [])),
        rim_sigma_px=np.array(values.get("rim_sigma_px", []), dtype=np.float64),
        reason=values["reason"],
        repeats=values["repeats"],
    )


def _points(values: list[list[float]]) -> FloatArray:
    return np.array(values, dtype=np.float64).reshape(-1, 2)


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


_READERS: Mapping[str, Callable[[dict[str, Any]], Item]] = {
    "/reading": lambda values: Reading(**values),
    "/observation": _observation,
    "/track": _track,
    "/truth": _track,
    "/event": lambda values: Event(**values),
    "/health": lambda values: Health(**values),
    "/picture": lambda values: Picture(**values),
}
