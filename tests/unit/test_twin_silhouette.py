"""The twin's pictures against slow, plain references: outlines, motion blur, rolling shutter, fiducials."""

import dataclasses

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cathxr.core import FloatArray, Intrinsics, Rig
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.twin import CameraRenderer, TwinSettings, TwinWorld, true_rig
from cathxr.twin.lens import ray_table

NS = 1_000_000_000
# A perfect camera and a black tube before an even light: the picture is the uncovered share and nothing else.
BARE = TwinSettings(
    exposure_ms=0.0, lens_blur_px=0.0, front_light=0.0, specular=0.0, transmission=0.0, vignetting=0.0, unevenness=0.0,
    read_noise_dn=0.0, electrons_per_dn=1e12, black_level_dn=0.0, back_light=0.95, inlet=False,
)  # fmt: skip
RAYS, STRIDE = 377, 233


def rig_of(*, scale: float = 1.0, diameter_mm: float = 3.0, seed: int = 1) -> Rig:
    """The example rig, its cameras displaced and given a lens with every distortion, and their pictures scaled."""
    rig = true_rig(example_rig(), seed)
    cameras = {}
    for name, camera in rig.cameras.items():
        inner = camera.intrinsics
        width, height = camera.size_px
        scaled = Intrinsics(
            inner.focal_px * scale, (inner.centre_px + 0.5) * scale - 0.5, np.array([-0.2, 0.07, 0.002, -0.003, 0.01])
        )
        size = (round(width * scale), round(height * scale))
        cameras[name] = dataclasses.replace(camera, intrinsics=scaled, size_px=size)
    return dataclasses.replace(
        rig, cameras=cameras, catheter=dataclasses.replace(rig.catheter, diameter_mm=diameter_mm)
    )


def covered(renderer: CameraRenderer, t_ns: int) -> FloatArray:
    """The share of each pixel that the tube covers, by the picture's darkness."""
    lit = renderer.empty_picture().astype(np.float64)
    return (1.0 - renderer.picture(t_ns) / lit).mean(axis=-1)


def dense_centres(world: TwinWorld, t_ns: int) -> FloatArray:
    """Centres of the swept ball every 0.01 mm or so, from 40 mm behind the inlet to one radius before the tip."""
    radius, track = world.body.radius_mm, world.truth(t_ns, points=6001)
    assert track.shape_box is not None
    assert track.direction_box is not None
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(track.shape_box, axis=0), axis=1))])
    last = track.shape_box[0] - radius * track.direction_box
    behind = -np.linspace(0.0, 40.0, 4001)[1:, None] * world.body.entry_frame[:, 2]
    return np.concatenate([last[None], track.shape_box[length > radius], behind])


def supersampled(world: TwinWorld, camera: str, t_ns: int, where: NDArray[np.bool_]) -> FloatArray:
    """The covered share of the pixels `where` by many rays each, every one against the nearest centres of the ball.

    A ray passes a centre at less than the radius where the angle between them is less than asin(radius / distance). The
    tube is searched piece by piece: of two limbs that overlap, the farther in angle may be nearer to the camera.
    """
    model = CameraModel.of(world.rig_true.cameras[camera])
    # A Fibonacci lattice: for straight edges of any direction its share is right to about log(N) / N.
    lattice = np.column_stack([np.arange(RAYS) / RAYS, np.arange(RAYS) * STRIDE / RAYS % 1.0]) + 0.5 / RAYS - 0.5
    pixels = np.argwhere(where)[:, ::-1]
    rays = model.ray((pixels[:, None, :] + lattice).reshape(-1, 2))
    inside = np.zeros(len(rays), dtype=bool)
    for piece in np.array_split(dense_centres(world, t_ns) - model.centre_box, 6):
        away = np.linalg.norm(piece, axis=1)
        reach = world.body.radius_mm / away
        most = float(2.0 * np.sin(0.5 * np.arcsin(reach.max())))
        distance, index = cKDTree(piece / away[:, None]).query(rays, distance_upper_bound=most)
        near = np.flatnonzero(np.isfinite(distance))
        chord = 2.0 * np.sin(0.5 * np.arcsin(reach[index[near]]))
        inside[near] |= distance[near] < chord
    share = np.zeros(where.shape)
    share[pixels[:, 1], pixels[:, 0]] = inside.reshape(len(pixels), -1).mean(axis=1)
    return share


CASES = [
    ("smooth", "top", 1.0, 3.0, 2.0),
    ("smooth", "front", 1.0, 3.0, 7.0),
    ("curl", "front", 1.0, 3.0, 4.0),
    ("at_a_camera", "top", 1.0, 3.0, 2.0),
    ("at_a_camera", "front", 1.5, 3.0, 12.0),
    ("smooth", "top", 0.5, 4.0 / 3.0, 3.0),
    ("flexion", "front", 1.0, 14.0 / 3.0, 5.0),
]


@pytest.mark.parametrize(("manoeuvre", "camera", "scale", "diameter_mm", "t_s"), CASES)
def test_outline_is_the_supersampled_one(
    manoeuvre: str, camera: str, scale: float, diameter_mm: float, t_s: float
) -> None:
    rig = rig_of(scale=scale, diameter_mm=diameter_mm)
    world = TwinWorld(rig, seed=5, settings=dataclasses.replace(BARE, manoeuvre=manoeuvre))
    share = covered(CameraRenderer(world, camera), round(t_s * NS))
    solid = (share > 0.004).astype(np.uint8)
    rim = (
        cv2.dilate(solid, np.ones((3, 3), np.uint8)) - cv2.erode((share > 0.996).astype(np.uint8), np.ones((3, 3)))
    ) > 0
    reference = supersampled(world, camera, round(t_s * NS), rim)
    error = (share - reference)[rim]
    # The requirement is 0.02 px: an edge displaced by that changes a pixel's share by 0.02 times the length of edge in
    # it, 1 to 1.4. The reference's own 377 rays are right to log(377) / 377 = 0.016.
    assert rim.sum() > 200 * scale
    assert np.abs(error).max() < 0.02 * 1.4 + 0.016
    # The displacement over stretches of the edge within 8 x 8 px, where the reference's grain averages out.
    cells = (np.argwhere(rim) // 8) @ [10_000, 1]
    for cell in np.unique(cells):
        here = cells == cell
        partly = np.minimum(reference[rim][here], 1.0 - reference[rim][here]) > 0.01
        # An edge of length L crosses 4 / pi L pixels in the mean over directions.
        length = max(1.0, float(partly.sum()) * np.pi / 4.0)
        assert abs(error[here].sum()) / length < 0.02


def test_pixels_that_the_tube_does_not_touch_are_the_empty_picture() -> None:
    world = TwinWorld(rig_of(), seed=5, settings=BARE)
    renderer = CameraRenderer(world, "top")
    share = covered(renderer, NS)
    model = CameraModel.of(world.rig_true.cameras["top"])
    axis = model.project(dense_centres(world, NS)[::20])
    rows, columns = np.mgrid[0:720, 0:1280]
    distance = cKDTree(axis).query(np.column_stack([columns.ravel(), rows.ravel()]))[0].reshape(720, 1280)
    # The tube is at most 3 mm * 1358 px / 270 mm broad; half of it plus a pixel, in the distorted picture.
    # Outside, the fixed-point table and the exact level may round apart: by one step of 255.
    assert np.abs(share[distance > 9.0]).max() < 1.01 / 230.0
    assert share[distance < 4.0].min() == 1.0


def test_lens_blur_is_a_gaussian_of_the_sharp_picture() -> None:
    rig = rig_of()
    sharp = covered(CameraRenderer(TwinWorld(rig, seed=5, settings=BARE), "top"), NS)
    settings = dataclasses.replace(BARE, lens_blur_px=1.1)
    soft = covered(CameraRenderer(TwinWorld(rig, seed=5, settings=settings), "top"), NS)
    # Both pictures are rounded to 1 in 242; OpenCV cuts the kernel at 4 standard deviations.
    assert np.abs(cv2.GaussianBlur(sharp, (0, 0), 1.1) - soft).max() < 1.5 / 242.0


def test_motion_blur_is_the_mean_over_the_exposure() -> None:
    rig, t_ns, exposure_ms = rig_of(), round(5.3 * NS), 12.0
    settings = dataclasses.replace(BARE, manoeuvre="fast")
    sharp = CameraRenderer(TwinWorld(rig, seed=2, settings=settings), "front")
    blurred_settings = dataclasses.replace(settings, exposure_ms=exposure_ms)
    blurred = covered(CameraRenderer(TwinWorld(rig, seed=2, settings=blurred_settings), "front"), t_ns)
    moments = t_ns + ((np.arange(48) + 0.5) / 48 - 0.5) * exposure_ms * 1e6
    mean = np.mean([covered(sharp, round(moment)) for moment in moments], axis=0)
    assert np.abs(covered(sharp, t_ns) - mean).max() > 0.3, "this pose must move, or nothing is tested"
    # Even motion over at most 1 px between two distance fields, beside a cap of 6 px radius: 1 / (12 * 6) px at worst.
    assert np.abs(blurred - mean).max() < 0.02


def test_rolling_shutter_shows_every_row_at_its_own_instant() -> None:
    rig, t_ns, readout_ms = rig_of(), round(5.3 * NS), 20.0
    settings = dataclasses.replace(BARE, manoeuvre="fast")
    whole = CameraRenderer(TwinWorld(rig, seed=2, settings=settings), "front")
    rolling_settings = dataclasses.replace(settings, readout_ms=readout_ms)
    rolling = covered(CameraRenderer(TwinWorld(rig, seed=2, settings=rolling_settings), "front"), t_ns)
    rows = np.flatnonzero((rolling > 0.5).any(axis=1))
    moved = 0.0
    for row in rows[:: max(1, len(rows) // 10)]:
        instant = t_ns + (row / 719.0 - 0.5) * readout_ms * 1e6
        # Straight motion between curves 3 ms apart at up to 5000 mm/s²: 0.006 mm, 0.03 px.
        assert np.abs(rolling[row] - covered(whole, round(instant))[row]).max() < 0.04
        moved = max(moved, float(np.abs(rolling[row] - covered(whole, t_ns)[row]).max()))
    assert moved > 0.15, "this pose must move, or nothing is tested"


def test_ray_table_is_the_camera_model_at_every_pixel() -> None:
    model = CameraModel.of(rig_of().cameras["top"])
    table = ray_table(model)
    rng = np.random.default_rng(0)
    pixels = np.column_stack([rng.integers(0, 1280, 4000), rng.integers(0, 720, 4000)])
    back = model.pixels_from_normalised(table[pixels[:, 1], pixels[:, 0]].astype(np.float64))
    # float32 resolves 6e-8 of coordinates up to 0.5: 1e-4 px at a focal length of 1358.
    assert np.abs(back - pixels).max() < 5e-4
