"""Every Track that can be makes a message that is valid, and comes back within the wire's rounding."""

import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cathxr.core import Pose, Status, Track
from cathxr.wire.convert import encode, jsonable, track_from_message, track_message
from cathxr.wire.messages import TrackMessage

_MM = st.floats(-1e4, 1e4)
_ANGLES = st.floats(-1e3, 1e3)
_QUATERNIONS = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda each: np.linalg.norm(each) > 0.1)


@st.composite
def tracks(draw: st.DrawFn) -> Track:
    status = draw(st.sampled_from(Status))
    reason = draw(st.text(min_size=0 if status is Status.TRACKED else 1, max_size=40))
    seq = draw(st.integers(0, 2**53 - 1))
    t_ns = draw(st.integers(0, 10**17))  # three years of uptime
    latency_ns = draw(st.none() | st.integers(0, 10**12))
    if status is Status.LOST:
        return Track(seq, t_ns, status, reason, latency_ns=latency_ns)
    shape = np.array(draw(st.lists(st.tuples(_MM, _MM, _MM), min_size=2, max_size=8)))
    quaternion = np.array(draw(_QUATERNIONS))
    pose = Pose(quaternion / np.linalg.norm(quaternion), shape[0])
    roll, sigma = draw(st.none() | _ANGLES), draw(st.floats(0, 1e4))
    predicted = roll is not None and draw(st.booleans())
    return Track(seq, t_ns, status, reason, shape, pose, roll, sigma, latency_ns, predicted)


@given(tracks())
def test_tracks_come_back(track: Track) -> None:
    text = encode(track_message(track))
    json.loads(text, parse_constant=lambda name: (_ for _ in ()).throw(AssertionError(f"{name} on the wire")))
    back = track_from_message(TrackMessage.model_validate_json(text))
    assert (back.seq, back.status, back.reason) == (track.seq, track.status, track.reason)
    assert back.roll_predicted == track.roll_predicted
    # Half of the last decimal that is sent, and the spacing of float64 at three years (1.5e-8 s).
    assert abs(back.t_ns - track.t_ns) <= 500 + 15
    if track.latency_ns is None:
        assert back.latency_ns is None
    else:
        assert back.latency_ns is not None
        assert abs(back.latency_ns - track.latency_ns) <= 501
    if track.shape_box is None or track.box_from_tip is None or track.sigma_mm is None:
        assert back.shape_box is None
        return
    assert back.shape_box is not None
    assert back.box_from_tip is not None
    assert back.sigma_mm is not None
    half_mm = 0.5e-4 * (1 + 1e-6)
    assert np.abs(back.shape_box - track.shape_box).max() <= half_mm
    assert abs(back.sigma_mm - track.sigma_mm) <= half_mm
    # Four components rounded to 1e-7, and normalised again: at most twice half of that, and its own rounding.
    assert np.abs(back.box_from_tip.rotation_wxyz - track.box_from_tip.rotation_wxyz).max() <= 2e-7
    if track.roll_rad is None:
        assert back.roll_rad is None
    else:
        assert back.roll_rad is not None
        assert abs(back.roll_rad - track.roll_rad) <= 0.5e-6 * (1 + 1e-6)


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)


@given(_JSON)
def test_any_payload_becomes_strict_json(value: object) -> None:
    json.dumps(jsonable(value), allow_nan=False)
