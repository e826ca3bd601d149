"""What the fiducials' finder is given that it cannot use, and what comes of several pictures of one camera."""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pytest

from cathxr.calibration.marker_clicks import merged
from cathxr.calibration.marker_colours import HUES_DEG, log_scores, white_of
from cathxr.calibration.marker_drawing import sighting_png
from cathxr.calibration.marker_finding import find_markers
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import CalibrationError, Intrinsics, PixelArray, Rig
from cathxr.storage.rig_file import example_rig

SIZE = (640, 480)
COLOURS = {
    "red": (25, 25, 217),
    "green": (46, 178, 31),
    "blue": (217, 71, 20),
    "yellow": (20, 217, 230),
    "magenta": (178, 25, 217),
    "orange": (13, 115, 230),
    "cyan": (217, 191, 25),
}


def _rig(*, second_colour: str = "green") -> Rig:
    """Return the example rig with pictures of 640x480."""
    rig = example_rig()
    lens = Intrinsics(np.array([678.85, 678.85]), np.array([320.0, 240.0]))
    cameras = {name: replace(each, size_px=SIZE, intrinsics=lens) for name, each in rig.cameras.items()}
    first, second, *others = rig.markers["top"]
    markers = {**rig.markers, "top": (first, replace(second, colour=second_colour), *others)}
    return replace(rig, cameras=cameras, markers=markers)


BAD_PICTURES: dict[str, Callable[[], PixelArray]] = {
    "black": lambda: np.zeros((480, 640, 3), np.uint8),
    "white": lambda: np.full((480, 640, 3), 255, np.uint8),
    "grey": lambda: np.random.default_rng(0).integers(0, 255, (480, 640), dtype=np.uint8),
    "noise": lambda: np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8),
    "one colour": lambda: np.broadcast_to(np.array([20, 20, 220], np.uint8), (480, 640, 3)).copy(),
    "stripes": lambda: cv2.cvtColor(
        np.dstack([np.tile(np.arange(640) % 180, (480, 1)), *[np.full((480, 640), 255)] * 2]).astype(np.uint8),
        cv2.COLOR_HSV2BGR,
    ),
}


@pytest.mark.parametrize("kind", BAD_PICTURES)
@pytest.mark.parametrize("near", [True, False])
def test_a_picture_without_markers_says_so(kind: str, near: bool) -> None:
    sighting = find_markers(_rig(), "top", BAD_PICTURES[kind](), near=near)
    assert sighting.markers == ()
    assert sighting.problem is not None
    assert sighting.problem.endswith((".", "?"))
    assert sighting_png(BAD_PICTURES[kind](), sighting).startswith(b"\x89PNG")


def test_bad_arguments_are_refused_with_a_sentence() -> None:
    rig = _rig()
    good = np.zeros((480, 640, 3), np.uint8)
    with pytest.raises(CalibrationError, match="320x240"):
        find_markers(rig, "top", np.zeros((240, 320, 3), np.uint8))
    with pytest.raises(CalibrationError, match="no camera 'side'"):
        find_markers(rig, "side", good)
    with pytest.raises(ValueError, match="uint8"):
        find_markers(rig, "top", good.astype(np.float64))
    with pytest.raises(ValueError, match="channels"):
        find_markers(rig, "top", np.zeros((480, 640, 4), np.uint8))
    with pytest.raises(CalibrationError, match="white"):
        find_markers(_rig(second_colour="white"), "top", good)
    with pytest.raises(CalibrationError, match=r"\[markers\]"):
        find_markers(replace(rig, markers={}), "top", good)


def _sighting(*places: tuple[str, float, float], camera: str = "top") -> Sighting:
    return Sighting(camera, SIZE, tuple(FoundMarker(n, "red", np.array([x, y]), 0.1) for n, x, y in places))


def test_merging_averages_joins_and_notices_what_was_moved() -> None:
    first = _sighting(("a", 10.0, 10.0), ("b", 500.0, 20.0), ("c", 480.0, 400.0))
    second = _sighting(("a", 10.2, 10.0), ("d", 20.0, 380.0))
    both = merged([first, second])
    assert {m.name for m in both.markers} == {"a", "b", "c", "d"}
    assert both.problem is None
    assert np.allclose(both.markers[0].centre_px, [10.1, 10.0])
    assert 0.05 <= both.markers[0].sigma_px < 0.1
    moved = merged([first, _sighting(("a", 18.0, 10.0))])
    assert moved.ambiguous == ("a",)
    assert moved.problem is not None
    assert "moved" in moved.problem
    with pytest.raises(ValueError, match="one camera"):
        merged([first, _sighting(camera="front")])


def test_colours_and_white() -> None:
    for name, colour in COLOURS.items():
        blue, green, red = (value / 255.0 for value in colour)
        a, b = (2.0 * red - green - blue) / 6.0**0.5, (green - blue) / 2.0**0.5
        scores = log_scores(np.degrees(np.arctan2([b], [a])) % 360.0, list(HUES_DEG))[:, 0]
        assert list(HUES_DEG)[int(scores.argmax())] == name
    tinted = np.clip(np.full((120, 160, 3), 150.0) * [0.8, 1.0, 1.3], 0, 255).astype(np.uint8)
    assert np.allclose(white_of(tinted), np.array([0.8, 1.0, 1.3]) / (3.1 / 3.0), rtol=0.03)  # one step of the bins
    assert np.allclose(white_of(np.zeros((120, 160, 3), np.uint8)), 1.0)
