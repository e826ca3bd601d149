"""The JSON schema of each topic of a session: they ride in the file, so that Foxglove and others can read it."""

from collections.abc import Mapping
from typing import Any

TOPICS = ("/reading", "/observation", "/track", "/truth", "/event", "/health", "/picture")
"""Every topic; /truth holds Tracks of the digital twin, exact."""


def _object(title: str, description: str, properties: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "description": description,
        "type": "object",
        "properties": dict(properties),
        "required": list(properties),
    }


def _of(kind: str, description: str, *, may_be_null: bool = False) -> dict[str, Any]:
    return {"type": [kind, "null"] if may_be_null else kind, "description": description}


def _rows(length: int, description: str, *, may_be_null: bool = False) -> dict[str, Any]:
    row = {"type": "array", "items": {"type": "number"}, "minItems": length, "maxItems": length}
    return {"type": ["array", "null"] if may_be_null else "array", "items": row, "description": description}


def _numbers(description: str, *, may_be_null: bool = False) -> dict[str, Any]:
    kind = ["array", "null"] if may_be_null else "array"
    return {"type": kind, "items": {"type": "number"}, "description": description}


_SEQ = _of("integer", "counts from 0")
_T = _of("integer", "nanoseconds of the host's monotonic clock, mid-exposure for pictures")

_PREDICTED = _of("boolean", "whether the roll is carried on beyond the encoder's last reading, by one period at most")

_DETECTION = _object(
    "Detection",
    "what one picture shows, in raw pixels; found when reason is null",
    {
        "camera": _of("string", "top or front"),
        "seq": _of("integer", "the picture's"),
        "t_ns": _T,
        "curve_px": _rows(2, "midline of the silhouette, tip first"),
        "normal_px": _rows(2, "unit normals along which the points were measured"),
        "sigma_px": _numbers("standard deviation of each point along its normal"),
        "half_width_px": _numbers("half of the silhouette's width at each point"),
        "tip_px": _numbers("the most distal point", may_be_null=True),
        "tip_sigma_px": _of("number", "standard deviation of tip_px along the midline", may_be_null=True),
        "end_px": _rows(2, "points of the silhouette's outline around its end"),
        "end_sigma_px": _numbers("standard deviation of each point of the outline, across it"),
        "rim_px": _rows(2, "closed rings of the whole outline, where the whole picture was read"),
        "rim_sigma_px": _numbers("standard deviation of each point of the rim; 1000 where it only closes a ring"),
        "reason": _of("string", "why nothing was found", may_be_null=True),
        "repeats": _of("integer", "pictures before this one that were the same to the last bit"),
    },
)

_POSE = {
    **_object(
        "Pose",
        "maps tip coordinates to box coordinates",
        {
            "rotation_wxyz": _numbers("unit quaternion w x y z"),
            "translation_mm": _numbers("the tip in box, mm"),
        },
    ),
    "type": ["object", "null"],
}


def _track(title: str, description: str) -> dict[str, Any]:
    return _object(
        title,
        description,
        {
            "seq": _of("integer", "0-based index of the picture pair"),
            "t_ns": _T,
            "status": {"enum": ["tracked", "coasting", "lost"]},
            "reason": _of("string", "why it is not tracked, empty when it is"),
            "shape_box": _rows(3, "centreline, mm in box, tip first, uniform in arc length", may_be_null=True),
            "box_from_tip": _POSE,
            "roll_rad": _of("number", "unwrapped roll, null where it is not valid", may_be_null=True),
            "roll_predicted": _PREDICTED,
            "sigma_mm": _of("number", "root of the trace of the tip's covariance", may_be_null=True),
            "latency_ns": _of("integer", "mid-exposure to Track", may_be_null=True),
        },
    )


SCHEMAS: Mapping[str, dict[str, Any]] = {
    "/reading": _object(
        "Reading",
        "one encoder report",
        {
            "seq": _SEQ,
            "t_ns": _T,
            "count": _of("integer", "after x4 decoding"),
            "illegal": _of("integer", "impossible transitions so far"),
            "flags": _of("integer", "the board's own, and from 256 on the driver's; 256, 512, 1024: no valid roll"),
        },
    ),
    "/observation": _object(
        "Observation",
        "one matched set of detections, at the top picture's instant: everything the tracker consumes",
        {
            "seq": _of("integer", "0-based index of the picture pair"),
            "t_ns": _T,
            "skew_ns": _of("integer", "the front picture's instant minus the top picture's"),
            "roll_rad": _of("number", "unwrapped roll at t_ns, null where it is not valid", may_be_null=True),
            "roll_predicted": _PREDICTED,
            "detections": {"type": "array", "items": _DETECTION},
        },
    ),
    "/track": _track("Track", "the catheter at one instant"),
    "/truth": _track("Truth", "the digital twin's catheter at one instant, exact"),
    "/event": _object(
        "Event",
        "something that happened",
        {"t_ns": _T, "kind": _of("string", "what"), "payload": _of("object", "its particulars")},
    ),
    "/health": _object(
        "Health",
        "one source's state",
        {
            "t_ns": _T,
            "source": _of("string", "which"),
            "running": _of("boolean", "whether it runs"),
            "age_s": _of("number", "since its last item", may_be_null=True),
            "rate_hz": _of("number", "items a second, smoothed"),
            "losses": _of("integer", "items dropped or skipped so far"),
            "last_error": _of("string", "why it last failed", may_be_null=True),
        },
    ),
    "/picture": _object(
        "Picture",
        "where a picture is in its camera's video",
        {
            "camera": _of("string", "top or front: the video's name"),
            "seq": _of("integer", "the picture's"),
            "t_ns": _T,
            "frame": _of("integer", "0-based index in the video"),
        },
    ),
}
