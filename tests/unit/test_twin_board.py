"""The twin's pictures of a board: edges to hundredths of a pixel, honest noise and blur, a hand that rests."""

import dataclasses

import cv2
import numpy as np
import pytest

from cathxr.core import ConfigError, DeviceError, FloatArray, PixelArray, Pose, RigCamera
from cathxr.devices.clock import ManualClock
from cathxr.geometry import CameraModel
from cathxr.geometry.pose import pose_from_vector
from cathxr.storage.rig_file import example_rig
from cathxr.twin import TwinSettings
from cathxr.twin.board_camera import TwinBoardCamera
from cathxr.twin.board_motion import REST_S, TRAVEL_S, BoardMotion
from cathxr.twin.board_pictures import BoardRenderer, board_picture

RIG = example_rig()
TOP = RIG.cameras["top"]
NS = 1_000_000_000
# No blur, no noise, even light, 255 levels of it, and nothing behind.
CLEAN = TwinSettings(
    background="coloured",
    front_light=0.6,
    back_light=0.0,
    vignetting=0.0,
    unevenness=0.0,
    lens_blur_px=0.0,
    read_noise_dn=0.0,
    electrons_per_dn=1e9,
    black_level_dn=0.0,
)
POSES = [
    pose_from_vector(np.array([0.0, 0.0, 0.02, -30.0, -35.0, 270.0])),
    pose_from_vector(np.array([0.5, 0.4, 0.3, -95.0, -60.0, 300.0])),
    pose_from_vector(np.array([-0.6, 0.3, 1.0, 70.0, -10.0, 320.0])),
]


def square_print(px_per_mm: float) -> PixelArray:
    """A black square of 30 mm in white paper of 110 mm, its corner at 40 mm."""
    texture = np.full((round(110 * px_per_mm),) * 2, 255, np.uint8)
    texture[round(40 * px_per_mm) : round(70 * px_per_mm), round(40 * px_per_mm) : round(70 * px_per_mm)] = 0
    return texture


def seen_square(camera: RigCamera, pose: Pose, points: int = 400) -> FloatArray:
    """Return the outline (4 points, 2), px, of the square 0 to 30 mm of the board."""
    s = np.linspace(0.0, 30.0, points, endpoint=False)
    zero, far = np.zeros(points), np.full(points, 30.0)
    x, y = np.concatenate([s, far, 30.0 - s, zero]), np.concatenate([zero, s, far, 30.0 - s])
    model = CameraModel(camera.intrinsics, pose, camera.size_px)
    return model.project(np.column_stack([x, y, np.zeros(4 * points)]))


def moments(outline: FloatArray) -> tuple[float, FloatArray]:
    """Return area and centroid of a polygon (N, 2)."""
    x, y = outline.T
    p, q = np.roll(x, -1), np.roll(y, -1)
    cross = x * q - p * y
    area = 0.5 * cross.sum()
    return float(abs(area)), np.array([((x + p) * cross).sum(), ((y + q) * cross).sum()]) / (6.0 * area)


def darkness(picture: PixelArray, outline: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how much ink each pixel near the outline shows (0 to 1), (h, w), and the patch's first pixel (2,)."""
    left, top = np.floor(outline.min(axis=0)).astype(int) - 8
    right, bottom = np.ceil(outline.max(axis=0)).astype(int) + 9
    grey = picture[top:bottom, left:right, 1].astype(np.float64)
    ink, paper = np.median(grey[grey < 60.0]), np.median(grey[grey > 60.0])
    return (paper - grey) / (paper - ink), np.array([left, top], dtype=np.float64)


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("px_per_mm", [4.0, 10.0, 40.0])
def test_edges_are_where_the_lens_puts_them(pose: Pose, px_per_mm: float) -> None:
    texture = square_print(px_per_mm)
    picture = board_picture(
        TOP,
        texture,
        px_per_mm=px_per_mm,
        camera_from_board=pose,
        settings=CLEAN,
        seed=1,
        offset_mm=(40.0, 40.0),
    )
    outline = seen_square(TOP, pose)
    dark, corner = darkness(picture, outline)
    v, u = np.mgrid[0 : dark.shape[0], 0 : dark.shape[1]]
    area, centre = moments(outline)
    # 8 bits and the faint slope of the light: each of some 500 edge pixels is known to 0.01, so the centroid of 15000
    # pixels to a few thousandths and the mean outline to 0.003 px; 0.02 px is what the twin promises.
    found = np.array([(dark * u).sum(), (dark * v).sum()]) / dark.sum() + corner
    assert np.abs(found - centre).max() < 0.02
    perimeter = np.linalg.norm(np.diff(np.vstack([outline, outline[:1]]), axis=0), axis=1).sum()
    assert abs(dark.sum() - area) / perimeter < 0.02


def test_every_edge_is_straight_to_a_hundredth_of_a_pixel() -> None:
    # The left and the right edge, row by row: ink summed across an edge says where in the row it lies.
    pose = pose_from_vector(np.array([0.0, 0.0, 0.13, 0.0, -20.0, 280.0]))
    renderer = BoardRenderer(TOP, square_print(10.0), px_per_mm=10.0, offset_mm=(40.0, 40.0), settings=CLEAN, seed=1)
    picture = renderer.picture(pose)
    outline = seen_square(TOP, pose)
    dark, corner = darkness(picture, outline)
    sides = outline.reshape(4, -1, 2)
    rows = np.arange(int(sides[1][:, 1].min()) + 12, int(sides[3][:, 1].max()) - 12)
    left, right = (np.interp(rows, line[np.argsort(line[:, 1]), 1], line[np.argsort(line[:, 1]), 0])
                   for line in (sides[3], sides[1]))  # fmt: skip
    widths = dark[rows - int(corner[1])].sum(axis=1)
    off = widths - (right - left)
    # Two edges a row, each with 16 samples of a texel's mean a pixel and 8 bits: 0.01 px each.
    assert abs(off.mean()) < 0.02
    assert off.std() < 0.02


def test_motion_blurs_about_the_same_middle() -> None:
    pose = POSES[0]
    renderer = BoardRenderer(TOP, square_print(10.0), px_per_mm=10.0, offset_mm=(40.0, 40.0), settings=CLEAN, seed=1)
    still = darkness(renderer.picture(pose), seen_square(TOP, pose))
    moved = darkness(renderer.picture(pose, twist=np.array([0.0, 0.0, 0.0, 1.2, 0.0, 0.0])), seen_square(TOP, pose))
    v, u = np.mgrid[0 : still[0].shape[0], 0 : still[0].shape[1]]

    def centre(dark: FloatArray) -> FloatArray:
        return np.array([(dark * u).sum(), (dark * v).sum()]) / dark.sum()

    # 1.2 mm at 270 mm are 6.0 px: the left and right edges spread over them, the middle stays.
    assert np.abs(centre(moved[0]) - centre(still[0])).max() < 0.02
    half_way = ((moved[0] > 0.1) & (moved[0] < 0.9)).sum(axis=1)
    row = int(np.argmax(moved[0].sum(axis=1)))
    assert half_way[row] == pytest.approx(2 * 0.8 * 6.0, abs=2.1)


def test_noise_is_the_sensors_and_differs_from_picture_to_picture() -> None:
    settings = dataclasses.replace(CLEAN, read_noise_dn=2.0, electrons_per_dn=40.0, black_level_dn=4.0)
    renderer = BoardRenderer(TOP, square_print(4.0), px_per_mm=4.0, settings=settings, seed=1)
    stack = np.stack([renderer.picture(POSES[0], number=k).astype(np.float64) for k in range(30)])
    mean, spread = stack.mean(axis=0), stack.var(axis=0, ddof=1)
    flat = np.s_[20:120, 20:1000]
    # 30 pictures of 300 thousand values: the mean variance is known to a part in a thousand; rounding adds 1/12.
    assert spread[flat].mean() == pytest.approx((4.0 + mean[flat] / 40.0).mean() + 1.0 / 12.0, rel=0.03)
    assert np.array_equal(renderer.picture(POSES[0], number=7), stack[7].astype(np.uint8))


def test_a_board_from_behind_is_plain_paper_and_one_behind_the_camera_is_not_there() -> None:
    renderer = BoardRenderer(TOP, square_print(4.0), px_per_mm=4.0, offset_mm=(55.0, 55.0), settings=CLEAN, seed=1)
    back = renderer.picture(pose_from_vector(np.array([0.0, np.pi - 0.2, 0.0, 0.0, 0.0, 300.0])))
    assert back[340:380, 600:680].min() > 80
    empty = renderer.picture(pose_from_vector(np.array([0.0, 0.0, 0.0, 0.0, 0.0, -300.0])))
    assert empty.max() < back[340:380, 600:680].min()


def test_a_board_that_fills_more_than_the_picture() -> None:
    texture = np.full((300, 300), 255, np.uint8)
    pose = pose_from_vector(np.array([1.2, 0.0, 0.0, -150.0, -150.0, 200.0]))
    picture = board_picture(TOP, texture, px_per_mm=1.0, camera_from_board=pose, settings=CLEAN, seed=0)
    assert picture.shape == (720, 1280, 3)


class TestMotion:
    def motion(self, seed: int = 3) -> BoardMotion:
        return BoardMotion(TOP, np.array([76.0, 76.0]), np.array([8.0, 8.0]), seed=seed)

    def corners(self, pose: Pose) -> FloatArray:
        points = np.array([[0.0, 0.0, 0.0], [60.0, 0.0, 0.0], [60.0, 60.0, 0.0], [0.0, 60.0, 0.0]])
        return CameraModel(TOP.intrinsics, pose, TOP.size_px).project(points)

    def test_rests_are_still_but_for_a_tremor(self) -> None:
        motion = self.motion()
        for k in range(3):
            start = k * (TRAVEL_S + REST_S) + TRAVEL_S
            seen = np.stack([self.corners(motion.pose(start + s)) for s in np.linspace(0.0, REST_S - 1e-6, 200)])
            # Three sine waves, together 0.1 px: over a rest of 1.2 s the slowest has only some periods.
            assert 0.04 < seen.std(axis=0).mean() < 0.16
            assert np.abs(seen - seen.mean(axis=0)).max() < 0.4

    def test_travel_is_smooth_and_the_same_for_a_seed(self) -> None:
        motion, again = self.motion(), self.motion()
        times = np.arange(0.0, 6.0, 0.002)
        seen = np.stack([self.corners(motion.pose(t)) for t in times])
        step = np.linalg.norm(np.diff(seen, axis=0), axis=-1).max()
        # Under 1500 px in 0.9 s, 1.9 times as fast in the middle: 6.3 px in 2 ms.
        assert 0.5 < step < 7.0
        assert np.abs(np.diff(seen, 2, axis=0)).max() < 0.25
        assert np.array_equal(motion.pose(2.5).translation_mm, again.pose(2.5).translation_mm)
        assert not np.array_equal(motion.pose(2.5).translation_mm, self.motion(4).pose(2.5).translation_mm)

    def test_rests_cover_the_picture_tilted_to_many_sides(self) -> None:
        motion = self.motion()
        seen = np.stack([self.corners(motion.rest(k)) for k in range(14)])
        assert (seen >= 0).all() and (seen <= np.array(TOP.size_px) - 1.0).all()  # noqa: PT018
        # Within a tenth of the picture of every side and corner.
        for corner in ((0, 0), (1279, 0), (1279, 719), (0, 719)):
            assert np.abs(seen - corner).max(axis=-1).min() < 200.0
        normals = np.stack([motion.rest(k).rotation[:, 2] for k in range(14)])
        assert np.ptp(normals[:, 0]) > 0.5
        assert np.ptp(normals[:, 1]) > 0.5

    def test_twist_is_how_the_pose_changes(self) -> None:
        motion = self.motion()
        pose, twist = motion.pose(0.45), motion.twist(0.45, 0.01)
        later = pose_from_vector(np.concatenate([twist[:3], np.zeros(3)]))
        turned = later.rotation @ motion.pose(0.445).rotation
        # Over 10 ms the turn is under 0.02 rad: its cube over six is 1e-6.
        assert np.abs(turned - motion.pose(0.455).rotation).max() < 1e-5
        assert np.linalg.norm(twist[3:]) > 0.1
        assert pose.translation_mm[2] > 50.0


def test_the_camera_shows_the_motion_and_refuses_nonsense() -> None:
    texture = square_print(4.0)
    options = {"texture": texture, "px_per_mm": 4.0, "offset_mm": (40.0, 40.0), "seed": 2, "rate_hz": 10.0}
    clock = ManualClock(NS)
    camera = TwinBoardCamera(RIG, "front", clock=clock, options=options)
    with pytest.raises(DeviceError, match="before it is opened"):
        camera.read(0.0)
    with camera:
        clock.advance_ns(int(1.5 * NS))
        image = camera.read(1.0)
    assert image is not None
    assert image.camera == "front"
    pose = camera.motion.pose((image.t_ns - NS) * 1e-9)
    middle = np.rint(CameraModel(TOP.intrinsics, pose, TOP.size_px).project(np.array([15.0, 15.0, 0.0]))).astype(int)
    assert cv2.mean(image.pixels[middle[1] - 3 : middle[1] + 4, middle[0] - 3 : middle[0] + 4])[1] < 40.0
    with pytest.raises(ConfigError, match="no option lens"):
        TwinBoardCamera(RIG, "top", clock=clock, options={**options, "lens": 1})
    with pytest.raises(ConfigError, match="texture"):
        TwinBoardCamera(RIG, "top", clock=clock, options={})
    with pytest.raises(ConfigError, match="no camera 'side'"):
        TwinBoardCamera(RIG, "side", clock=clock, options=options)
    with pytest.raises(ValueError, match="texture"):
        BoardRenderer(TOP, texture.astype(np.float32), px_per_mm=4.0, settings=CLEAN, seed=0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="px_per_mm"):
        BoardRenderer(TOP, texture, px_per_mm=0.0, settings=CLEAN, seed=0)
