from pathlib import Path

import cv2
import numpy as np
import pytest

from cathxr.vision.segment_background import BackgroundSegmenter
from cathxr.vision.segmentation import Window

SIZE = (720, 1280)
WIDTH_PX = 14.0
NOISE = 2.0


def cluttered(channels: int = 3) -> np.ndarray:
    """A static background of coloured panels with seams, unevenly lit."""
    random = np.random.default_rng(5)
    picture = np.zeros((*SIZE, channels), dtype=np.float32)
    for x in range(0, SIZE[1], 320):
        for y in range(0, SIZE[0], 240):
            picture[y : y + 237, x : x + 317] = random.uniform(60, 190, channels)
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    light = 1.0 - 0.3 * (((columns - 640) / 640) ** 2 + ((rows - 360) / 360) ** 2) / 2
    return cv2.GaussianBlur(picture, (0, 0), 1.0).reshape(*SIZE, channels) * light[..., None]


def coverage() -> tuple[np.ndarray, np.ndarray]:
    """A bent tube's share of each pixel, by supersampling, and its centreline (N, 2) px."""
    x = np.linspace(200, 900, 200)
    line = np.column_stack([x, 330 + 130 * np.sin((x - 200) / 260)])
    big = np.zeros((SIZE[0] * 4, SIZE[1] * 4), dtype=np.uint8)
    points = np.round(((line + 0.5) * 4 - 0.5) * 16).astype(np.int32)
    for point in points:
        cv2.circle(big, tuple(int(v) for v in point), round(WIDTH_PX * 2 * 16), 255, -1, cv2.LINE_8, 4)
    share = cv2.resize(big, SIZE[::-1], interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    return cv2.GaussianBlur(share, (0, 0), 0.8), line


def photographed(scene: np.ndarray, seed: int, gain: float | np.ndarray = 1.0) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0.0, NOISE, scene.shape)
    return np.clip(scene * gain + noise, 0, 255).astype(np.uint8)


def with_tube(background: np.ndarray, colours: list[tuple[float, ...]]) -> tuple[np.ndarray, np.ndarray]:
    share, _ = coverage()
    bands = np.array(colours, dtype=np.float32)[(np.arange(SIZE[1]) // 120) % len(colours)]
    return background * (1 - share[..., None]) + bands[None] * share[..., None], share


@pytest.mark.parametrize(
    "colours",
    [[(235, 238, 240)], [(70, 35, 25)], [(25, 25, 25)], [(230, 235, 235), (70, 35, 25), (30, 30, 200)]],
    ids=["white", "dark blue", "black", "many"],
)
@pytest.mark.parametrize("gain", [1.0, 0.6, (1.25, 1.0, 0.8)], ids=["same light", "darker", "other white balance"])
def test_any_colour_in_any_light(colours: list[tuple[float, ...]], gain: float | tuple[float, ...]) -> None:
    background = cluttered()
    scene, share = with_tube(background, colours)
    segmenter = BackgroundSegmenter(photographed(background, 1))
    picture = photographed(scene, 2, np.array(gain))
    coarse = segmenter.coarse(picture)
    truth = cv2.resize(share, (SIZE[1] // coarse.step, SIZE[0] // coarse.step), interpolation=cv2.INTER_AREA)
    inside = coarse.mask[truth > 0.9] > 0
    # A band may come close to one panel's colour in some light; all but that must be there.
    assert inside.mean() > 0.93
    near = cv2.dilate((truth > 0.02).astype(np.uint8), np.ones((7, 7), dtype=np.uint8)) > 0
    # False alarms: an eighth of a percent of the background at 8 sigma is already generous.
    assert (coarse.mask[~near] > 0).mean() < 0.00125


def test_the_mattes_half_level_is_the_edge() -> None:
    background = cluttered()
    scene, share = with_tube(background, [(235, 238, 240)])
    segmenter = BackgroundSegmenter(photographed(background, 1))
    picture = photographed(scene, 2, 0.8)
    segmenter.coarse(picture)
    window = Window(180, 150, 930, 520)
    matte = segmenter.matte(picture, window)
    true = share[window.slices]
    assert matte.shape == true.shape
    assert float(np.median(matte[true > 0.98])) > 0.85
    assert float(np.median(matte[true < 0.001])) < 0.05
    columns = np.arange(60, 600, 7)
    edges, true_edges = first_crossings(matte, columns), first_crossings(true, columns)
    # Noise 2 against a contrast of 45 to 170 on an edge of 0.8 px blur: 0.1 px; the local scale adds up to 0.3 px.
    assert abs(float(np.median(edges - true_edges))) < 0.3
    assert float(np.median(np.abs(edges - true_edges))) < 0.35


def first_crossings(matte: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """The row, to a part of a pixel, where each column first rises through a half on its way to the tube."""
    result = []
    for column in columns:
        profile = matte[:, column]
        inside = int(np.flatnonzero(cv2.blur(profile, (1, 5)).ravel() > 0.7)[0])
        row = int(np.flatnonzero(profile[: inside + 1] < 0.5)[-1])
        result.append(row + (0.5 - profile[row]) / (profile[row + 1] - profile[row]))
    return np.array(result)


@pytest.mark.parametrize("gain", [1.0, 0.7])
def test_an_empty_box_stays_empty(gain: float) -> None:
    background = cluttered()
    segmenter = BackgroundSegmenter(photographed(background, 1))
    mask = segmenter.coarse(photographed(background, 2, gain)).mask
    assert np.count_nonzero(mask) < 0.0005 * mask.size


def test_a_knocked_camera_and_a_soft_shadow_are_not_a_catheter() -> None:
    background = cluttered()
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    shadow = 1.0 - 0.35 * np.exp(-(((columns - 600) / 160) ** 2 + ((rows - 300) / 160) ** 2))
    shift = np.array([[1.0, 0.0, 0.7], [0.0, 1.0, -0.6]])
    moved = cv2.warpAffine(background, shift, SIZE[::-1], borderMode=cv2.BORDER_REPLICATE)
    segmenter = BackgroundSegmenter(photographed(background, 1))
    mask = segmenter.coarse(photographed(moved * shadow[..., None], 2)).mask
    assert np.count_nonzero(mask) < 0.002 * mask.size


def test_grey_pictures_work_too() -> None:
    background = cluttered(1)
    scene, share = with_tube(background, [(20,)])
    segmenter = BackgroundSegmenter(photographed(background, 1)[..., 0])
    coarse = segmenter.coarse(photographed(scene, 2)[..., 0])
    truth = cv2.resize(share, (SIZE[1] // coarse.step, SIZE[0] // coarse.step), interpolation=cv2.INTER_AREA)
    assert (coarse.mask[truth > 0.9] > 0).mean() > 0.95
    window = Window(3, 5, 1001, 700)
    assert segmenter.matte(photographed(scene, 2)[..., 0], window).shape == (695, 998)


def test_real_photographs_with_a_background_picture(shared_data: Path) -> None:
    """Points on the catheter between collar and tip, and beside it; read off the photographs by hand, good to 2 px."""
    folder = shared_data / "biplane_catheter" / "three_cameras_2025-08_1280x720"
    for camera, start, end in (("cam1", (607, 250), (607, 465)), ("cam2", (622, 340), (621, 525))):
        picture = cv2.imread(str(folder / "poses_2025-08-13_3cam_straight_1280x720" / f"{camera}_0.png"))
        background = cv2.imread(str(folder / "background_2025-08-13_3cam_1280x720" / f"{camera}_0.png"))
        segmenter = BackgroundSegmenter(background)
        coarse = segmenter.coarse(picture)
        points = np.linspace(start, end, 60)
        rows = (points[:, 1] // coarse.step).astype(int)
        assert (coarse.mask[rows, (points[:, 0] // coarse.step).astype(int)] > 0).all()
        for aside in (-30, 30):
            assert not coarse.mask[rows, ((points[:, 0] + aside) // coarse.step).astype(int)].any()
