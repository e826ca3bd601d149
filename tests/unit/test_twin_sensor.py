"""The twin's sensor noise, light and look against what the settings promise."""

import dataclasses

import numpy as np
import pytest

from cathxr.core import ConfigError
from cathxr.storage.rig_file import example_rig
from cathxr.twin import SCENES, CameraRenderer, TwinSettings, TwinWorld, scene

NS = 1_000_000_000
RIG = example_rig()


def renderer(settings: TwinSettings, *, seed: int = 4, camera: str = "top") -> CameraRenderer:
    return CameraRenderer(TwinWorld(RIG, seed=seed, settings=settings), camera)


@pytest.mark.parametrize(("gain", "read_noise_dn"), [(1.0, 1.0), (4.0, 3.0)])
def test_noise_has_the_promised_mean_and_variance(gain: float, read_noise_dn: float) -> None:
    settings = TwinSettings(catheter=False, gain=gain, read_noise_dn=read_noise_dn, back_light=0.6)
    camera, count = renderer(settings), 120
    stack = np.stack([camera.picture(k * NS // 30)[::5, ::5].astype(np.float64) for k in range(count)])
    expected = camera.empty_picture()[::5, ::5].astype(np.float64)
    # Each pixel's mean is known to sigma / sqrt(count); the empty picture is rounded to a whole DN (at most 0.5 off).
    deviation = np.sqrt(read_noise_dn**2 + expected * gain / settings.electrons_per_dn)
    bright = expected > 60.0
    assert (np.abs(stack.mean(axis=0) - expected)[bright] < 0.5 + 6.0 * deviation[bright] / np.sqrt(count)).all()
    # The variance, over all bright pixels: rounding to whole DN adds 1/12; 100 thousand pixels leave under 1 %.
    ratio = stack.var(axis=0, ddof=1)[bright].mean() / (deviation[bright] ** 2 + 1.0 / 12.0).mean()
    assert ratio == pytest.approx(1.0, abs=0.03)


def test_noise_never_repeats_and_is_the_same_for_the_same_instant() -> None:
    camera = renderer(TwinSettings(manoeuvre="still"))
    first, second = camera.picture(NS), camera.picture(NS + NS // 30)
    assert (first != second).mean() > 0.5
    # Above the catheter, in 380 thousand samples: one standard deviation of the correlation is 0.002. The rounding of
    # the empty picture, in both alike, has a variance of 1/12 beside a noise of 5: 0.017.
    flat = [picture[:100].astype(np.float64) - camera.empty_picture()[:100] for picture in (first, second)]
    assert abs(np.corrcoef(flat[0].ravel(), flat[1].ravel())[0, 1]) < 0.017 + 0.01
    assert np.array_equal(camera.picture(NS), first)
    assert np.array_equal(renderer(TwinSettings(manoeuvre="still")).picture(NS), first)
    assert not np.array_equal(renderer(TwinSettings(manoeuvre="still"), seed=5).picture(NS), first)


def test_neighbouring_pixels_and_rows_have_independent_noise() -> None:
    camera = renderer(TwinSettings(catheter=False))
    noise = camera.picture(NS).astype(np.float64)[:300, 700:1200] - camera.picture(2 * NS)[:300, 700:1200]
    for one, other in ((noise[:, 1:], noise[:, :-1]), (noise[1:], noise[:-1]), (noise[..., 0], noise[..., 1])):
        # 150 thousand pairs: one standard deviation of the correlation is 0.003.
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.015


def test_moving_pixels_have_the_same_noise_law_as_still_ones() -> None:
    # Nearly clear: the tube changes little, so that its pixels must look as noisy as those around.
    settings = TwinSettings(manoeuvre="still", transmission=1.0, front_light=0.0, specular=0.0, exposure_ms=0.0)
    with_tube, without = renderer(settings), renderer(dataclasses.replace(settings, catheter=False))
    stack = np.stack([with_tube.picture(k * NS).astype(np.float64) for k in range(40)])
    still = np.stack([without.picture(k * NS).astype(np.float64) for k in range(40)])
    # The dark renderer shows where the tube is.
    dark = renderer(dataclasses.replace(settings, transmission=0.0)).picture(0)
    tube = (dark.mean(axis=-1) < 0.5 * without.empty_picture().mean(axis=-1)) & (dark.mean(axis=-1) < 60.0)
    assert tube.sum() > 1000
    # 40 pictures of some thousand pixels: the mean variance is known to about 0.5 %.
    assert stack.var(axis=0)[tube].mean() / still.var(axis=0)[tube].mean() == pytest.approx(1.0, abs=0.05)
    assert stack.mean(axis=0)[tube].mean() - still.mean(axis=0)[tube].mean() == pytest.approx(0.0, abs=0.1)


def test_low_contrast_scene_has_about_twenty_percent() -> None:
    camera = renderer(scene("low_contrast"))
    empty = camera.empty_picture().astype(np.float64).mean(axis=-1)
    share = camera.picture(NS).astype(np.float64).mean(axis=-1) / empty
    lit = empty > 100.0
    darkest = np.sort(share[lit])[:1500].mean()
    assert 0.7 < darkest < 0.9


def test_flicker_changes_the_light_and_saturation_holds_at_white() -> None:
    camera = renderer(scene("flicker"))
    levels = [camera.picture(k * NS // 30)[:200, 700:].mean() for k in range(12)]
    assert max(levels) - min(levels) > 10.0
    white = renderer(scene("saturated")).picture(NS)
    assert (white == 255).mean() > 0.2


def test_debris_moves_and_bubbles_are_there_without_a_catheter() -> None:
    camera = renderer(dataclasses.replace(scene("debris"), catheter=False))
    empty = camera.empty_picture().astype(np.float64).mean(axis=-1)
    dark = [camera.picture(k * NS).mean(axis=-1) < empty - 60.0 for k in (1, 3)]
    assert all(each.sum() > 300 for each in dark)
    assert (dark[0] & dark[1]).sum() < 0.7 * dark[0].sum()


def test_scratch_layers_are_clean_after_every_picture() -> None:
    # A picture must not depend on which others were made before: neither its tube's nor its debris's traces stay.
    used, fresh = renderer(scene("debris")), renderer(scene("debris"))
    for k in range(5):
        used.picture(k * NS)
    assert np.array_equal(used.picture(9 * NS), fresh.picture(9 * NS))


def test_faults_and_compression() -> None:
    assert not renderer(scene("black_picture")).picture(NS).any()
    assert (renderer(scene("white_picture")).picture(NS) == 255).all()
    frozen = renderer(scene("frozen_picture"))
    assert np.array_equal(frozen.picture(NS), frozen.picture(2 * NS))
    raw, packed = renderer(scene("smooth")).picture(NS), renderer(scene("mjpg")).picture(NS)
    assert packed.shape == raw.shape
    assert 0.2 < np.abs(packed.astype(float) - raw).mean() < 4.0


@pytest.mark.parametrize("name", list(SCENES))
@pytest.mark.parametrize("camera", ["top", "front"])
def test_every_scene_renders(name: str, camera: str) -> None:
    picture = renderer(SCENES[name], camera=camera).picture(3 * NS)
    assert picture.shape == (720, 1280, 3)
    assert picture.dtype == np.uint8


def test_mistakes_are_named() -> None:
    with pytest.raises(ConfigError, match="no scene 'fog'"):
        scene("fog")
    with pytest.raises(ValueError, match="vignetting: expected a share from 0 to 1, got 3"):
        TwinSettings(vignetting=3)
    with pytest.raises(ConfigError, match="no camera 'side'"):
        CameraRenderer(TwinWorld(RIG), "side")
    with pytest.raises(ConfigError, match=r"no \[markers\]"):
        CameraRenderer(TwinWorld(dataclasses.replace(RIG, markers={}), settings=TwinSettings(pillars="both")), "top")
