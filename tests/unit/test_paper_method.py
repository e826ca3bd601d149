import dataclasses

import numpy as np
import pytest

from cathxr.core import FloatArray, Image, Observation, Rig, Status, Track
from cathxr.geometry.fiducial_plane import FiducialPlane
from cathxr.storage.rig_file import example_rig
from cathxr.tracking.paper import PaperTracker
from cathxr.twin.placement import true_rig
from cathxr.twin.render import CameraRenderer
from cathxr.twin.scenes import scene
from cathxr.twin.world import TwinWorld
from cathxr.vision.paper import PaperDetector

VIEWS = ("top", "front")
STEP_NS = 1_400_000_000


class Bench:
    """The twin's pictures through the paper method."""

    def __init__(self, rig: Rig, name: str, *, seed: int = 0) -> None:
        self.world = TwinWorld(rig, seed=seed, settings=scene(name))
        self.cameras = {view: CameraRenderer(self.world, view) for view in VIEWS}
        self.detectors = {view: PaperDetector(rig, view) for view in VIEWS}
        self.tracker = PaperTracker(rig)

    def images(self, seq: int) -> tuple[Image, ...]:
        return tuple(Image(view, seq, seq * STEP_NS, self.cameras[view].picture(seq * STEP_NS)) for view in VIEWS)

    def observation(self, images: tuple[Image, ...]) -> Observation:
        detections = tuple(self.detectors[each.camera].detect(each) for each in images)
        return Observation(images[0].seq, images[0].t_ns, detections)

    def track(self, seq: int) -> Track:
        return self.tracker.update(self.observation(self.images(seq)))


@pytest.fixture(scope="module")
def rig() -> Rig:
    return true_rig(example_rig(), 3)


def what_the_paper_should_say(rig: Rig, centre_of_the_end: FloatArray) -> FloatArray:
    """Return what the paper's two homographies make of a point: exact on the planes, biased off them."""
    top = FiducialPlane.of(rig, "top").apparent(centre_of_the_end)
    front = FiducialPlane.of(rig, "front").apparent(centre_of_the_end)
    return np.array([0.5 * (top[0] + front[0]), top[1], front[1]])


def test_the_tip_is_where_the_papers_own_geometry_puts_it(rig: Rig) -> None:
    bench = Bench(rig, "smooth", seed=1)
    for seq in range(5):
        track, truth = bench.track(seq), bench.world.truth(seq * STEP_NS)
        assert track.status is Status.TRACKED, track.reason
        assert track.tip_box is not None
        assert truth.tip_box is not None
        assert truth.direction_box is not None
        # Thinning ends about one radius before the tip, in the middle of the rounded end.
        end = truth.tip_box - 0.5 * rig.catheter.diameter_mm * truth.direction_box
        # Budget, mm: skeleton grid 0.5 px and thinning's ragged end 2 px at 4.1 px/mm, in both views; 0.3 for blur.
        assert np.linalg.norm(track.tip_box - what_the_paper_should_say(rig, end)) < 2.5 / 4.1 * np.sqrt(2.0) + 0.3
        # And its error is of the size that it admits: within three sigmas, an honest outer bound of a bias.
        assert track.sigma_mm is not None
        assert np.linalg.norm(track.tip_box - truth.tip_box) < 3.0 * track.sigma_mm


def test_the_shape_runs_from_the_tip_to_the_inlet_in_equal_steps(rig: Rig) -> None:
    track = Bench(rig, "smooth", seed=1).track(0)
    assert track.shape_box is not None
    assert track.shape_box.shape == (50, 3)
    assert track.shape_box[-1, 0] == pytest.approx(0.0, abs=1e-6)
    steps = np.linalg.norm(np.diff(track.shape_box, axis=0), axis=1)
    # Resampled along a polyline of K points: chords across its kinks are a little shorter than the arcs.
    assert steps.std() < 0.05 * steps.mean()


@pytest.mark.parametrize("name", ["low_contrast", "translucent", "noisy", "vignetting", "flicker", "mjpg"])
def test_the_lights_troubles_do_not_stop_it(rig: Rig, name: str) -> None:
    bench = Bench(rig, name)
    track, truth = bench.track(1), bench.world.truth(STEP_NS)
    assert track.status is Status.TRACKED, track.reason
    assert track.tip_box is not None
    assert truth.tip_box is not None
    assert track.sigma_mm is not None
    assert np.linalg.norm(track.tip_box - truth.tip_box) < 3.0 * track.sigma_mm


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("empty", "no catheter"),
        ("black_picture", "black picture"),
        ("white_picture", "white picture"),
        ("pillars", "inlet not visible"),
        ("white", ""),
        ("coloured", ""),
        ("empty_wall", ""),
    ],
)
def test_without_a_back_lit_catheter_it_is_lost_with_a_reason(rig: Rig, name: str, reason: str) -> None:
    track = Bench(rig, name).track(0)
    assert track.status is Status.LOST
    assert track.reason
    assert reason in track.reason


def test_frozen_pictures_coast_and_then_are_lost(rig: Rig) -> None:
    bench = Bench(rig, "smooth")
    images = bench.images(0)
    assert bench.tracker.update(bench.observation(images)).status is Status.TRACKED
    later = tuple(dataclasses.replace(each, seq=1, t_ns=100_000_000) for each in images)
    track = bench.tracker.update(bench.observation(later))
    assert (track.status, track.reason) == (Status.COASTING, "frozen pictures")
    much_later = tuple(dataclasses.replace(each, seq=2, t_ns=1_000_000_000) for each in images)
    assert bench.tracker.update(bench.observation(much_later)).status is Status.LOST


def test_views_of_different_catheters_are_not_joined(rig: Rig) -> None:
    bench = Bench(rig, "smooth")
    top, front = bench.observation(bench.images(1)).detections
    short = len(front.curve_px) * 2 // 3
    cut = dataclasses.replace(
        front,
        **{name: getattr(front, name)[short:] for name in ("curve_px", "normal_px", "sigma_px", "half_width_px")},
        tip_px=front.curve_px[short],
    )
    track = bench.tracker.update(Observation(1, STEP_NS, (top, cut)))
    assert track.status is Status.LOST
    assert "disagree" in track.reason


def test_a_second_thing_at_the_inlet_is_no_catheter(rig: Rig) -> None:
    bench = Bench(rig, "smooth")
    top, _ = bench.images(0)
    plane = FiducialPlane.of(rig, "top")
    low, high = plane.to_pixels(np.array([[0.0, 10.0], [60.0, 13.0]])).round().astype(int)
    pixels = top.pixels.copy()
    rows, columns = sorted((low[1], high[1])), sorted((low[0], high[0]))
    pixels[rows[0] : rows[1], columns[0] : columns[1]] = 10
    detection = bench.detectors["top"].detect(dataclasses.replace(top, pixels=pixels))
    assert detection.reason == "two blobs at the inlet"


def test_a_picture_of_another_size_is_refused_by_reason(rig: Rig) -> None:
    small = Image("top", 0, 0, np.full((480, 640), 90, dtype=np.uint8))
    assert "size" in (PaperDetector(rig, "top").detect(small).reason or "")


def test_the_same_observations_give_the_same_tracks(rig: Rig) -> None:
    bench = Bench(rig, "smooth")
    observations = [bench.observation(bench.images(seq)) for seq in range(3)]
    first = [bench.tracker.update(each) for each in observations]
    bench.tracker.reset()
    again = [bench.tracker.update(each) for each in observations]
    for one, other in zip(first, again, strict=True):
        assert one.shape_box is not None
        assert other.shape_box is not None
        np.testing.assert_array_equal(one.shape_box, other.shape_box)
