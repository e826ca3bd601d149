"""The twin's crosses: their fiducial balls' outlines to hundredths of a pixel, who sees them, and what hides them."""

import dataclasses

import numpy as np
import pytest

from cathxr.core import ConfigError, FloatArray, Intrinsics, Marker, Rig
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.twin import CameraRenderer, TwinSettings, TwinWorld, scene, true_rig
from cathxr.twin.lens import ray_table
from cathxr.twin.static_kernels import first_hit
from cathxr.twin.static_picture import _in_camera, static_picture
from cathxr.twin.static_scene import MARKER_RADIUS_MM, StaticScene, static_scene

RIG = example_rig()
LAMP = np.array([-0.26, -0.34, -1.0]) / np.linalg.norm([-0.26, -0.34, -1.0])
SAMPLES = 24


def markers_of(rig: Rig) -> list[Marker]:
    return [marker for each in rig.markers.values() for marker in each]


def small(rig: Rig, scale: float) -> Rig:
    cameras = {}
    for name, camera in rig.cameras.items():
        lens = camera.intrinsics
        size = (round(camera.size_px[0] * scale), round(camera.size_px[1] * scale))
        inner = Intrinsics(lens.focal_px * scale, lens.centre_px * scale, lens.distortion)
        cameras[name] = dataclasses.replace(camera, size_px=size, intrinsics=inner)
    return dataclasses.replace(rig, cameras=cameras)


def patch_by_many_rays(model: CameraModel, centre_box: FloatArray, around: FloatArray, *, half: int) -> FloatArray:
    """Return (2 half + 1, 2 half + 1) the mean brightness of a white ball on black, by 24 x 24 exact rays a pixel."""
    left, top = np.rint(around).astype(int) - half
    fine = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    size = 2 * half + 1
    u, v = (start + (np.arange(size)[:, None] + fine).ravel() for start in (left, top))
    rays = model.undistort(np.stack(np.meshgrid(u, v), axis=-1))
    rays = np.concatenate([rays, np.ones((*rays.shape[:2], 1))], axis=-1)
    centre = model.to_camera(centre_box)
    along, square = rays @ centre, (rays * rays).sum(axis=-1)
    room = along**2 - square * (centre @ centre - MARKER_RADIUS_MM**2)
    hit = room > 0.0
    at = (along - np.sqrt(np.where(hit, room, 0.0))) / square
    normal = (at[..., None] * rays - centre) / MARKER_RADIUS_MM
    bright = np.where(hit, 0.35 + 0.65 * np.maximum(normal @ LAMP, 0.0), 0.0)
    return np.asarray(bright.reshape(size, SAMPLES, size, SAMPLES).mean(axis=(1, 3)))


@pytest.mark.parametrize("camera", ["top", "front"])
def test_a_balls_outline_is_where_exact_rays_put_it(camera: str) -> None:
    model = CameraModel.of(true_rig(RIG, 2).cameras[camera])
    settings = TwinSettings(back_light=0.0, front_light=1.0, specular=0.0, lens_blur_px=0.0)
    balls = StaticScene()
    for marker in markers_of(RIG):
        balls = balls.with_ball(marker.position_mm, MARKER_RADIUS_MM, (1.0, 1.0, 1.0))
    level = static_picture(model, ray_table(model), balls, settings, seed=0).level[..., 1] / 255.0
    for marker in markers_of(RIG):
        middle = model.project(marker.position_mm)
        expected = patch_by_many_rays(model, marker.position_mm, middle, half=20)
        left, top = np.rint(middle).astype(int) - 20
        found = level[top : top + 41, left : left + 41]
        # At a rim of brightness 0.35 to 0.7, an error of cover of 0.02 is 0.02 px of the outline. 89 rays a pixel leave
        # an error of up to 0.02, the reference's 24 x 24 up to 1/48, where an edge runs along their rows; over the
        # outline of some 75 px that leaves a thousandth.
        off = np.abs(found - expected)
        assert off.max() < 0.041 * 0.7
        assert np.sqrt((off[off > 1e-5] ** 2).mean()) < 0.004
        grid = np.arange(41.0)
        for weights in (np.ones((41, 1)) * grid, grid[:, None] * np.ones(41)):
            centre = (found * weights).sum() / found.sum() - (expected * weights).sum() / expected.sum()
            assert abs(centre) < 0.005


@pytest.mark.parametrize("seed", range(25))
def test_both_cameras_see_all_eight_balls_whole(seed: int) -> None:
    rig = true_rig(RIG, seed)
    things = static_scene(rig, scene("pillars"))
    first_ball = len(things.box_centre) + len(things.disc_centre)
    assert len(things.ball_centre) == 8
    for camera in rig.cameras.values():
        model = CameraModel.of(camera)
        seen = _in_camera(model, things)
        for k, centre in enumerate(model.to_camera(things.ball_centre)):
            distance = float(np.linalg.norm(centre))
            # The circle in which rays touch the ball, drawn in by a hundredth of its radius, and its middle.
            sine = MARKER_RADIUS_MM / distance
            axis = centre / distance
            across = np.cross(axis, [0.0, 1.0, 0.0])
            across /= np.linalg.norm(across)
            down = np.cross(axis, across)
            turn = np.linspace(0.0, 2.0 * np.pi, 60)[:, None]
            rim = centre * (1.0 - sine**2) + 0.99 * MARKER_RADIUS_MM * np.sqrt(1.0 - sine**2) * (
                np.cos(turn) * across + np.sin(turn) * down
            )
            for x, y, z in (*rim, centre):
                assert first_hit(x / z, y / z, seen)[0] == first_ball + k
            assert model.inside(model.project(things.ball_centre[k][None])).all()


@pytest.mark.parametrize(("name", "count"), [("pillar_top", 4), ("pillar_front", 4), ("pillars", 8)])
def test_scenes_hold_the_crosses_they_name(name: str, count: int) -> None:
    things = static_scene(RIG, scene(name))
    wanted = {"pillar_top": RIG.markers["top"], "pillar_front": RIG.markers["front"]}.get(name, markers_of(RIG))
    assert len(things.ball_centre) == count
    assert {tuple(each) for each in things.ball_centre} == {tuple(each.position_mm) for each in wanted}


def test_a_finger_hides_a_marker_wholly_or_in_part() -> None:
    rig = true_rig(RIG, 4)

    def visible(camera: str, share: float) -> float:
        """Return which share of the hidden ball's own pixels still shows its colour."""
        model = CameraModel.of(rig.cameras[camera])
        settings = dataclasses.replace(scene("pillars"), occluded_markers=("mT2",), occlusion_share=share)
        things = static_scene(rig, settings)
        seen = _in_camera(model, things)
        ball = len(things.box_centre) + len(things.disc_centre) + 1
        u, v = np.meshgrid(*[np.linspace(-25.0, 25.0, 101)] * 2)
        pixels = model.project(RIG.markers["top"][1].position_mm) + np.stack([u.ravel(), v.ravel()], axis=-1)
        rays = model.undistort(pixels)
        hits = np.array([first_hit(x, y, seen)[0] == ball for x, y in rays])
        alone = _in_camera(model, dataclasses.replace(StaticScene()).with_ball(*_ball(1)))
        whole = np.array([first_hit(x, y, alone)[0] == 0 for x, y in rays])
        return float(hits.sum() / whole.sum())

    assert visible("top", 1.0) == visible("front", 1.0) == 0.0
    # Half of the diameter behind a finger tip 2.7 times as big: a little less than half of the area.
    assert 0.45 < visible("top", 0.5) < 0.7
    assert visible("top", 0.25) > visible("top", 0.5) > visible("top", 0.75) > 0.05


def _ball(k: int) -> tuple[FloatArray, float, tuple[float, float, float]]:
    return RIG.markers["top"][k].position_mm, MARKER_RADIUS_MM, (1.0, 1.0, 1.0)


def test_look_alikes_lie_beside_the_markers() -> None:
    settings = dataclasses.replace(scene("pillars"), coloured_clutter=15)
    things, bare = static_scene(RIG, settings, seed=3), static_scene(RIG, scene("pillars"), seed=3)
    more = len(things.ball_centre) + len(things.box_centre) - len(bare.ball_centre) - len(bare.box_centre)
    assert more == 15
    paints = {tuple(each) for each in bare.ball_colour}
    assert {tuple(each) for each in things.ball_colour} <= paints
    for camera in RIG.cameras.values():
        model = CameraModel.of(camera)
        markers = model.project(np.stack([each.position_mm for each in markers_of(RIG)]))
        others = model.project(np.concatenate([things.ball_centre[8:], things.box_centre[len(bare.box_centre) :]]))
        assert np.linalg.norm(others[:, None] - markers[None], axis=-1).min() > 15.0
    other = static_scene(RIG, settings, seed=4)
    assert other.ball_centre.shape != things.ball_centre.shape or not np.array_equal(
        other.ball_centre, things.ball_centre
    )


def test_light_settings_change_the_light_as_they_say() -> None:
    rig = small(RIG, 0.25)

    def picture(**changes: object) -> FloatArray:
        settings = dataclasses.replace(scene("pillars"), unevenness=0.0, vignetting=0.0, **changes)  # type: ignore[arg-type]
        return CameraRenderer(TwinWorld(rig, seed=2, settings=settings), "top").empty_picture().astype(np.float64)

    plain, warm = picture(), picture(cast=(0.6, 1.0, 1.4))
    back = plain[5:30, 5:30].mean(axis=(0, 1)) - 4.0
    assert (warm[5:30, 5:30].mean(axis=(0, 1)) - 4.0) / back == pytest.approx([0.6, 1.0, 1.4], abs=0.02)
    uneven = picture(front_unevenness=0.5)
    assert np.array_equal(uneven[5:30, 5:30], plain[5:30, 5:30]), "the back-light is not the front light"
    blue = np.s_[20:45, 180:250, 0]
    assert np.abs(uneven[blue] - plain[blue]).max() >= 3.0


def test_mistakes_are_named() -> None:
    with pytest.raises(ValueError, match="pillars: expected one of none, top, front, both, got True"):
        TwinSettings(pillars=True)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="cast: expected three gains"):
        TwinSettings(cast=(1.0, 0.0, 1.0))
    with pytest.raises(ConfigError, match="no marker 'mT9' to hide"):
        static_scene(RIG, TwinSettings(pillars="top", occluded_markers=("mT9",)))
    one = dataclasses.replace(RIG, markers={"top": RIG.markers["top"]})
    with pytest.raises(ConfigError, match=r"no \[markers\] for 'front'"):
        static_scene(one, TwinSettings(pillars="front"))
    with pytest.raises(ConfigError, match="no place for 5000"):
        static_scene(RIG, TwinSettings(pillars="both", coloured_clutter=5000))
    odd = dataclasses.replace(RIG.markers["top"][0], colour="puce")
    with pytest.raises(ConfigError, match="puce"):
        static_scene(dataclasses.replace(RIG, markers={"top": (odd,)}), TwinSettings(pillars="top"))
