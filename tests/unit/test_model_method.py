"""The `model` method on the twin's rendered pictures: right where there is a catheter, lost with a reason elsewhere."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from cathxr.app.bench_tracking import scene_pairs, scores
from cathxr.core import Catheter, Detection, Image, Observation, PixelArray, Rig, Status, Track
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.tracking import make_tracker
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig
from cathxr.vision import make_detector

SEED = 3
TARGET_MEAN_MM = 0.5  # the target for smooth scenes; measured 0.018 (docs/benchmarks.md)
BUDGET_MEAN_MM = 0.06  # three times what is measured: a regression shows long before the target is missed


@pytest.fixture(scope="module")
def rig() -> Rig:
    return true_rig(example_rig(), SEED)


@pytest.fixture(scope="module")
def pair() -> tuple[Image, Image, Track]:
    top, front, truth, _ = next(iter(scene_pairs("smooth", pairs=1, seed=SEED)))
    return top, front, truth


def tracked(rig: Rig, top: Image, front: Image) -> Track:
    """Return what fresh detectors and a fresh tracker make of one pair."""
    found = (make_detector("model", rig, "top").detect(top), make_detector("model", rig, "front").detect(front))
    return make_tracker("model", rig).update(Observation(0, top.t_ns, found))


def with_pixels(image: Image, pixels: PixelArray) -> Image:
    return Image(image.camera, image.seq, image.t_ns, pixels)


@pytest.mark.parametrize("name", ["smooth", "low_contrast", "noisy", "flicker", "mjpg"])
def test_tip_and_shape_are_right_on_every_kind_of_smooth_scene(name: str) -> None:
    score = scores(name, ("model",), pairs=8, seed=SEED)["model"]
    assert score.statuses == {"tracked": 8}
    assert np.mean(score.tip_mm) < BUDGET_MEAN_MM < TARGET_MEAN_MM
    assert np.mean(score.shape_mm) < BUDGET_MEAN_MM
    assert np.mean(score.tangent_deg) < 1.5
    # sigma states at least half the error and not a multiple of it: 8 pairs of one bias spread wider than the target
    assert 0.1 < np.sqrt(np.mean(np.square(score.normalised))) < 2.0


@pytest.mark.parametrize("name", ["white", "coloured", "translucent"])
def test_any_catheter_on_any_static_background_with_an_empty_picture(name: str, rig: Rig) -> None:
    world = TwinWorld(rig, seed=SEED, settings=scene(name))
    renderers = {each: CameraRenderer(world, each) for each in ("top", "front")}
    detectors = {
        each: make_detector("model", rig, each, background=renderer.empty_picture())
        for each, renderer in renderers.items()
    }
    tracker = make_tracker("model", rig)
    errors = []
    for seq in range(4):
        t_ns = 1_000_000_000 + seq * 400_000_000
        pictures = [Image(each, seq, t_ns, renderer.picture(t_ns)) for each, renderer in renderers.items()]
        # the lamp and the camera's white balance have changed by a tenth since the empty picture was taken
        changed = [
            with_pixels(each, np.clip(each.pixels * [0.9, 1.0, 1.08], 0, 255).astype(np.uint8)) for each in pictures
        ]
        track = tracker.update(Observation(seq, t_ns, tuple(detectors[each.camera].detect(each) for each in changed)))
        assert track.status is Status.TRACKED, track.reason
        truth = world.truth(t_ns).tip_box
        assert track.tip_box is not None
        assert truth is not None
        errors.append(np.linalg.norm(track.tip_box - truth))
    assert np.mean(errors) < 2 * BUDGET_MEAN_MM


def test_tip_entry_and_sampling_are_as_the_architecture_defines(rig: Rig, pair: tuple[Image, Image, Track]) -> None:
    top, front, truth = pair
    track = tracked(rig, top, front)
    assert track.shape_box is not None
    assert truth.shape_box is not None
    assert track.shape_box.shape == (50, 3)
    assert track.shape_box[-1, 0] == 0.0
    # the twin's entry is the origin; the block hides the first millimetres, so that it is extrapolated
    assert np.linalg.norm(track.shape_box[-1]) < 0.5
    steps = np.linalg.norm(np.diff(track.shape_box, axis=0), axis=1)
    assert np.ptp(steps) < 0.02 * steps.mean()
    assert track.box_from_tip is not None
    assert np.array_equal(track.box_from_tip.translation_mm, track.shape_box[0])


def test_paper_method_is_the_published_baseline_and_far_behind() -> None:
    both = scores("smooth", ("model", "paper"), pairs=6, seed=SEED)
    # shared/notes/tracking.md: a faithful implementation gave 3.1 mm; one homography a plane cannot reach 0.3
    assert 0.3 < np.mean(both["paper"].tip_mm) < 8.0
    assert np.mean(both["model"].tip_mm) < 0.2 * np.mean(both["paper"].tip_mm)


@pytest.mark.parametrize("size", [(640, 480), (1920, 1080)])
@pytest.mark.parametrize("diameter_mm", [4 / 3, 14 / 3])
def test_other_pictures_and_other_catheters(size: tuple[int, int], diameter_mm: float) -> None:
    nominal = example_rig()
    cameras = {}
    for name, camera in nominal.cameras.items():
        scale = size[0] / camera.size_px[0] * (1.0 if size[0] > 1000 else 1.15)
        intrinsics = replace(
            camera.intrinsics, focal_px=camera.intrinsics.focal_px * scale, centre_px=np.array(size) / 2.0
        )
        cameras[name] = replace(camera, intrinsics=intrinsics, size_px=size)
    rig = true_rig(replace(nominal, cameras=cameras, catheter=Catheter("other", diameter_mm)), SEED)
    world = TwinWorld(rig, seed=SEED, settings=scene("smooth"))
    t_ns = 2_000_000_000
    pictures = [Image(each, 0, t_ns, CameraRenderer(world, each).picture(t_ns)) for each in ("top", "front")]
    track = tracked(rig, *pictures)
    assert track.status is Status.TRACKED, track.reason
    assert track.tip_box is not None
    truth = world.truth(t_ns).tip_box
    assert truth is not None
    # a pixel is 0.24 to 0.5 mm here and a tip is measured to some hundredths of one, bar thin ones at 640 px
    assert np.linalg.norm(track.tip_box - truth) < 0.3


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda pixels: np.zeros_like(pixels), "black picture"),
        (lambda pixels: np.full_like(pixels, 255), "white picture"),
        (lambda pixels: np.full_like(pixels, 128), "blank picture"),
    ],
)
def test_blank_pictures_are_lost_with_their_reason(
    rig: Rig, pair: tuple[Image, Image, Track], make: object, reason: str
) -> None:
    top, front, _ = pair
    track = tracked(rig, top, with_pixels(front, make(front.pixels)))  # type: ignore[operator]
    assert track.status is Status.LOST
    assert track.reason == f"{reason} (front)"
    assert track.shape_box is None


def test_no_catheter_is_lost(rig: Rig) -> None:
    world = TwinWorld(rig, seed=SEED, settings=scene("empty"))
    for t_ns in range(1_000_000_000, 2_000_000_000, 250_000_000):
        pictures = [Image(each, 0, t_ns, CameraRenderer(world, each).picture(t_ns)) for each in ("top", "front")]
        track = tracked(rig, *pictures)
        assert track.status is Status.LOST
        assert "no catheter" in track.reason


def test_noise_alone_is_lost(rig: Rig) -> None:
    rng = np.random.default_rng(0)
    shape = (720, 1280, 3)
    for spread in (1.0, 8.0, 60.0):
        pictures = [np.clip(rng.normal(180.0, spread, shape), 0, 255).astype(np.uint8) for _ in range(2)]
        track = tracked(rig, Image("top", 0, 0, pictures[0]), Image("front", 0, 0, pictures[1]))
        assert track.status is Status.LOST


def test_catheter_out_of_one_view_is_lost(rig: Rig, pair: tuple[Image, Image, Track]) -> None:
    top, front, truth = pair
    camera = rig.cameras["front"]
    assert truth.tip_box is not None
    # the same camera with a narrower sensor, which ends 5 mm short of the tip
    width = int(CameraModel.of(camera).project(truth.tip_box - [5.0, 0.0, 0.0])[0])
    narrow = replace(rig, cameras={**rig.cameras, "front": replace(camera, size_px=(width, camera.size_px[1]))})
    track = tracked(narrow, top, with_pixels(front, np.ascontiguousarray(front.pixels[:, :width])))
    assert track.status is Status.LOST
    assert track.reason == "the catheter leaves the picture (front)"


def test_two_catheters_are_lost(rig: Rig, pair: tuple[Image, Image, Track]) -> None:
    top, front, _ = pair
    doubled = np.minimum(top.pixels, np.roll(top.pixels, 90, axis=0))
    track = tracked(rig, with_pixels(top, doubled), front)
    assert track.status is Status.LOST
    assert "more than one" in track.reason


def test_pictures_of_different_instants_are_lost_or_honest(rig: Rig) -> None:
    pairs = list(scene_pairs("full_range", pairs=12, seed=SEED))
    for first, second in zip(pairs, pairs[4:], strict=False):
        track = tracked(rig, first[0], second[1])
        if track.status is Status.TRACKED:
            assert track.tip_box is not None
            assert first[2].tip_box is not None
            assert second[2].tip_box is not None
            moved = np.linalg.norm(first[2].tip_box - second[2].tip_box)
            assert np.linalg.norm(track.tip_box - first[2].tip_box) < moved + 1.0


def test_a_frozen_camera_coasts_and_is_then_lost(rig: Rig) -> None:
    world = TwinWorld(rig, seed=SEED, settings=scene("smooth"))
    renderers = {each: CameraRenderer(world, each) for each in ("top", "front")}
    detectors = {each: make_detector("model", rig, each) for each in renderers}
    tracker = make_tracker("model", rig)
    frozen = renderers["front"].picture(1_000_000_000)
    statuses, reasons = [], []
    for seq in range(14):
        t_ns = 1_000_000_000 + seq * 33_333_333
        top = Image("top", seq, t_ns, renderers["top"].picture(t_ns))
        front = Image("front", seq, t_ns, frozen)
        track = tracker.update(Observation(seq, t_ns, (detectors["top"].detect(top), detectors["front"].detect(front))))
        statuses.append(track.status.value)
        reasons.append(track.reason)
    # a quarter of a second at 30 pairs/s is seven and a half pairs
    assert statuses == ["tracked"] + ["coasting"] * 7 + ["lost"] * 6
    assert set(reasons[1:]) == {"frozen picture from front"}


def test_detection_refuses_a_picture_of_another_size(rig: Rig) -> None:
    found = make_detector("model", rig, "top").detect(Image("top", 0, 0, np.zeros((480, 640, 3), dtype=np.uint8)))
    assert not found.found
    assert "640x480" in (found.reason or "")


def test_detections_are_whole(rig: Rig, pair: tuple[Image, Image, Track]) -> None:
    top, _, _ = pair
    found: Detection = make_detector("model", rig, "top").detect(top)
    assert found.found
    assert found.tip_px is not None
    assert np.allclose(np.linalg.norm(found.normal_px, axis=1), 1.0)
    assert (found.sigma_px > 0).all()
    # the tip comes first, one half width beyond the first point, which is the centre of the rounded end
    assert np.linalg.norm(found.tip_px - found.curve_px[0]) == pytest.approx(found.half_width_px[0], rel=0.05)
    assert found.curve_px[0, 0] > found.curve_px[-1, 0]


@pytest.mark.parametrize("balance", [(1.0, 0.93, 0.65), (0.65, 0.95, 1.0)])
def test_a_wrong_white_balance_is_still_a_back_light(
    balance: tuple[float, float, float], rig: Rig, pair: tuple[Image, Image, Track]
) -> None:
    top, front, truth = pair
    tinted = [with_pixels(each, (each.pixels * np.array(balance)).astype(np.uint8)) for each in (top, front)]
    track = tracked(rig, *tinted)
    assert track.tip_box is not None, track.reason
    assert truth.tip_box is not None
    assert np.linalg.norm(track.tip_box - truth.tip_box) < BUDGET_MEAN_MM * 2


def test_grey_pictures_work_like_coloured_ones(rig: Rig, pair: tuple[Image, Image, Track]) -> None:
    top, front, truth = pair
    grey = [with_pixels(each, np.asarray(cv2.cvtColor(each.pixels, cv2.COLOR_BGR2GRAY))) for each in (top, front)]
    track = tracked(rig, *grey)
    assert track.tip_box is not None
    assert truth.tip_box is not None
    assert np.linalg.norm(track.tip_box - truth.tip_box) < BUDGET_MEAN_MM * 2
