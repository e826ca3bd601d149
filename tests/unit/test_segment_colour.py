from pathlib import Path

import cv2
import numpy as np
import pytest

from cathxr.vision.segment_colour import ColourSegmenter
from cathxr.vision.segmentation import Window

SIZE = (720, 1280)
COLOURS = [[(235, 238, 240)], [(75, 40, 30)], [(70, 35, 25), (235, 238, 240), (40, 40, 210)]]


def lined_box(seed: int = 0) -> np.ndarray:
    """A green-lined box: three panels with dark seams, uneven light, a white lamp and a black bar at the left edge."""
    picture = np.empty((*SIZE, 3), dtype=np.float32)
    picture[:] = (95, 160, 60)
    picture[:, 1000:] = (85, 135, 55)
    picture[:60] = (80, 125, 50)
    picture[60:64] = (14, 26, 10)
    picture[:, 1000:1004] = (14, 26, 10)
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    light = 0.75 + 0.4 * np.exp(-(((columns - 500) / 500) ** 2 + ((rows - 300) / 300) ** 2))
    picture *= light[..., None]
    picture[120:, :130] = 250
    picture[60:120, :200] = 22
    noise = np.random.default_rng(seed).normal(0.0, 2.5, picture.shape)
    return cv2.GaussianBlur(picture, (0, 0), 0.9) + noise.astype(np.float32)


def with_catheter(picture: np.ndarray, colours: list[tuple[float, ...]]) -> tuple[np.ndarray, np.ndarray]:
    y = np.linspace(64, 430, 150)
    line = np.column_stack([600 + 60 * ((y - 64) / 366) ** 2, y])
    share = np.zeros(SIZE, dtype=np.uint8)
    points = np.round(line * 16).astype(np.int32)
    cv2.polylines(share, [points], False, 255, 14, cv2.LINE_AA, 4)
    part = cv2.GaussianBlur(share.astype(np.float32) / 255, (0, 0), 0.9)
    bands = np.array(colours, dtype=np.float32)[(np.arange(SIZE[0]) // 100) % len(colours)]
    return picture * (1 - part[..., None]) + bands[:, None] * part[..., None], part


@pytest.mark.parametrize("colours", COLOURS, ids=["white", "dark blue", "three colours"])
def test_a_catheter_of_another_colour_and_nothing_else(colours: list[tuple[float, ...]]) -> None:
    scene, part = with_catheter(lined_box(), colours)
    picture = np.clip(scene, 0, 255).astype(np.uint8)
    segmenter = ColourSegmenter()
    coarse = segmenter.coarse(picture)
    truth = cv2.resize(part, (SIZE[1] // coarse.step, SIZE[0] // coarse.step), interpolation=cv2.INTER_AREA)
    assert (coarse.mask[truth > 0.9] > 0).mean() > 0.97
    near = cv2.dilate((truth > 0.02).astype(np.uint8), np.ones((9, 9), dtype=np.uint8)) > 0
    away = coarse.mask.copy()
    away[near] = 0
    # Crumbs may stay where panels, bar and seams meet, which the detector tells from a catheter by their size: it bears
    # a fifth of the catheter's area. Lamp, bar and seams as such have several times the catheter's area.
    assert np.count_nonzero(away) < 0.2 * np.count_nonzero(truth > 0.5)
    matte = segmenter.matte(picture, Window(560, 80, 700, 480))
    true = part[80:480, 560:700]
    assert float(np.median(matte[true > 0.98])) > 0.8
    assert float(np.median(matte[true < 0.001])) < 0.05


def test_an_empty_box_stays_empty() -> None:
    picture = np.clip(lined_box(), 0, 255).astype(np.uint8)
    mask = ColourSegmenter().coarse(picture).mask
    assert np.count_nonzero(mask) < 0.001 * mask.size


def test_a_tinted_reflection_beside_a_catheter_is_left_out() -> None:
    box = lined_box()
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    patch = np.exp(-(((columns - 760) / 30) ** 2 + ((rows - 330) / 30) ** 2))
    box += patch[..., None] * np.array([-22.0, -2.0, 22.0], dtype=np.float32)
    scene, _ = with_catheter(box, COLOURS[0])
    coarse = ColourSegmenter().coarse(np.clip(scene, 0, 255).astype(np.uint8))
    assert not coarse.mask[280 // coarse.step : 380 // coarse.step, 710 // coarse.step : 810 // coarse.step].any()


# Points on the catheter from collar to tip, read off the photographs by hand, good to 2 px.
REAL = [
    ("poses_2025-05-12_640x480/cam0_0.png", (310, 145), (311, 185)),
    ("poses_2025-05-12_640x480/cam1_0.png", (287, 204), (287, 236)),
    ("poses_2025-06-03_640x480/cam0_0.png", (315, 125), (313, 195)),
    ("poses_2025-06-03_640x480/cam1_0.png", (284, 192), (282, 245)),
    ("three_cameras_2025-08_1280x720/poses_2025-08-13_3cam_straight_1280x720/cam1_0.png", (607, 250), (607, 465)),
    ("three_cameras_2025-08_1280x720/poses_2025-08-13_3cam_straight_1280x720/cam2_0.png", (622, 340), (621, 525)),
]


@pytest.mark.parametrize(("name", "start", "end"), REAL)
def test_real_photographs(shared_data: Path, name: str, start: tuple[int, int], end: tuple[int, int]) -> None:
    picture = cv2.imread(str(shared_data / "biplane_catheter" / name))
    coarse = ColourSegmenter().coarse(picture)
    points = np.linspace(start, end, 40)
    rows = (points[:, 1] // coarse.step).astype(int)
    assert (coarse.mask[rows, (points[:, 0] // coarse.step).astype(int)] > 0).all()
    reach = picture.shape[1] // 5
    for aside in (-reach // 4, -reach // 2, reach // 4, reach // 2, reach):
        assert not coarse.mask[rows, ((points[:, 0] + aside) // coarse.step).astype(int)].any()
