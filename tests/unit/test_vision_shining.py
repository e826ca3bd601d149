"""A catheter that shines has a bright core; an empty picture before a back-light leaves the back-light to be used."""

from dataclasses import replace

import numpy as np
import pytest

from cathxr.app.bench_scenes import Sequence
from cathxr.app.bench_sequence import Method
from cathxr.core import Image, PixelArray, Status
from cathxr.twin import CameraRenderer, TwinWorld, scene
from cathxr.vision import make_detector
from cathxr.vision.segment_background import BackgroundSegmenter
from cathxr.vision.segment_choice import SegmenterChoice

SHAPE = (240, 320)


def tube(core: float | None, *, dark: float = 40.0) -> PixelArray:
    """Return a level tube 16 px wide, with a core 7 px wide of another brightness, before a light of 200."""
    picture = np.full(SHAPE, 200.0)
    picture[112:128, 100:] = dark
    if core is not None:
        picture[116:123, 100:] = core
    noise = np.random.default_rng(2).normal(scale=1.0, size=SHAPE)
    grey = np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def test_a_shining_catheter_is_tracked_at_its_full_width() -> None:
    sequence = Sequence("glare", seed=3)
    method = Method("model", sequence)
    tracked = 0
    for pair in sequence.pairs(8, 30.0):
        observation, track, _ = method.track(pair)
        if track.status is not Status.TRACKED:
            continue
        tracked += 1
        assert track.tip_box is not None
        assert pair.truth.tip_box is not None
        assert float(np.linalg.norm(track.tip_box - pair.truth.tip_box)) < 0.25
        for each in observation.detections:
            # 3 mm at about 4.1 px a millimetre
            assert 4.5 < float(np.median(each.half_width_px)) < 8.0
    assert tracked >= 6


def test_an_empty_picture_before_a_back_light_leaves_the_back_light_to_be_used() -> None:
    sequence = Sequence("smooth", seed=3)
    pair = next(sequence.pairs(1, 30.0))
    image = pair.pictures["top"]
    assert image is not None
    empty = sequence.renderers["top"].empty_picture()
    alone = make_detector("model", sequence.rig, "top").detect(image)
    known = make_detector("model", sequence.rig, "top", background=empty).detect(image)
    assert known.reason is None
    np.testing.assert_allclose(known.curve_px, alone.curve_px, atol=0.05)


def test_what_is_dark_in_the_empty_picture_too_is_no_catheter() -> None:
    sequence = Sequence("smooth", seed=3)
    settings = replace(scene("smooth"), catheter=False)
    world = TwinWorld(sequence.rig, seed=3, settings=settings)
    renderer = CameraRenderer(world, "top")
    empty, shown = renderer.empty_picture(), renderer.picture(1_000_000_000)
    line = sequence.renderers["top"].picture(1_000_000_000)
    seam = line.min(axis=2) < 60  # where a catheter would be, something dark that was there before
    empty[seam], shown[seam] = 30, 30
    detector = make_detector("model", sequence.rig, "top", background=empty)
    assert detector.detect(Image("top", 0, 1_000_000_000, shown)).reason is not None


@pytest.mark.parametrize(("core", "back_lit"), [(None, True), (120.0, True), (240.0, False)])
def test_a_brighter_band_is_seen_by_the_empty_picture_only(core: float | None, back_lit: bool) -> None:
    empty = np.full((*SHAPE, 3), 200, dtype=np.uint8)
    assert (BackgroundSegmenter(empty).changed_darker(tube(core)) is not None) == back_lit
    choice = SegmenterChoice(16.0, empty)
    choice.for_picture(tube(core))
    assert (choice.refreshed is None) == back_lit
