"""Attenuation: dB per cm and MHz, enhancement behind fluid, and the amplification that makes up for it."""

import numpy as np
import pytest

from cathxr.ultrasound import simulate
from cathxr.ultrasound.receive import amplification_db

from ...ultrasound_support.phantoms import (
    QUIET,
    decibel,
    moved,
    phantom,
    rms,
    share_within,
    voxel_centres,
    with_settings,
)


@pytest.mark.parametrize(("attenuation", "frequency"), [(0.5, 5.0), (0.5, 10.0), (1.0, 7.5), (0.2, 7.5)])
def test_attenuation_is_the_slope_of_speckle_with_depth(attenuation: float, frequency: float) -> None:
    """-2 · alpha · f dB/cm, alpha as coded in 8 bits. 0.25 dB/cm: the envelope's mean square over some 50 independent
    speckles a depth has a standard deviation of 0.6 dB; fitted over 60 independent depths across 6.5 cm: 0.04."""
    field = phantom(0.0, 1.0, attenuation)
    coded = field.scales.attenuation_max_db_cm_mhz * (field.rgba[0, 0, 0, 2] / 255.0) ** 2
    assert coded == pytest.approx(attenuation, rel=0.05)
    image = simulate(field, moved(), with_settings(frequency_mhz=frequency))
    level = 10.0 * np.log10(np.mean(np.square(image.envelope), axis=0))
    depth_cm = image.ranges_mm / 10.0
    used = (depth_cm > 1.0) & (depth_cm < 7.5)
    slope = np.polyfit(depth_cm[used], level[used], 1)[0]
    assert slope == pytest.approx(-2.0 * coded * frequency, abs=0.25)


def test_behind_fluid_it_is_brighter() -> None:
    """A cyst 20 mm thick spares 2 · (0.6 - 0.05) · f · 2 cm dB of what lies beside its shadow."""
    x, _, z = voxel_centres()
    cyst = share_within(10.0 - np.abs(x - 30.0)) * share_within(14.0 - np.abs(z))
    image = simulate(phantom(0.0, 1.0 - cyst, 0.6 - 0.55 * cyst), moved(), with_settings(frequency_mhz=5.0))
    plain = simulate(phantom(0.0, 1.0, 0.6), moved(), with_settings(frequency_mhz=5.0))
    behind = (slice(88, 104), slice(280, 420))
    gain = decibel(rms(image.envelope[behind])) - decibel(rms(plain.envelope[behind]))
    # 0.6: two estimates of a level from some 100 speckles each, on the same scatterers; 8-bit codes 3 % of 11 dB.
    assert gain == pytest.approx(2.0 * 0.55 * 5.0 * 2.0, abs=0.6)
    inside = (slice(90, 102), slice(130, 200))
    assert decibel(rms(image.envelope[inside])) < decibel(rms(plain.envelope[inside])) - 40.0


def test_the_slope_of_amplification_makes_up_for_the_tissue() -> None:
    """With alpha 0.5 and twice that as slope, the grey level does not change with depth (2 dB of speckle's noise)."""
    settings = with_settings(tgc_slope_db_cm_mhz=1.0, frequency_mhz=5.0)
    image = simulate(phantom(0.0, 1.0, 0.5), moved(), settings)
    step = 255.0 / settings.dynamic_range_db
    near, far = image.grey[:, 60:160].mean(), image.grey[:, 300:430].mean()
    assert near > 60.0
    assert near == pytest.approx(far, abs=2.0 * step)


def test_sliders_and_gain_add_decibels() -> None:
    sliders = (0.0, 0.0, 0.0, 0.0, 6.0, 6.0, 6.0, 6.0)
    added = amplification_db(with_settings(tgc_db=sliders, gain_db=3.0))
    assert added[0] == pytest.approx(3.0)
    assert added[-1] == pytest.approx(9.0)
    assert np.all(np.diff(added) >= 0.0)
    assert np.abs(np.diff(added)).max() < 0.2  # 6 dB over the seventh part of 448 samples


def test_grey_is_linear_in_decibels() -> None:
    """10 dB more gain is 10 / dynamic range of the scale, where nothing is cut off (half a step of rounding)."""
    field = phantom(0.0, 1.0, 0.2)
    low = simulate(field, moved(), with_settings(gain_db=10.0)).grey.astype(float)
    high = simulate(field, moved(), with_settings(gain_db=20.0)).grey.astype(float)
    kept = (low > 0.0) & (high < 255.0)
    assert kept.mean() > 0.8
    assert np.allclose((high - low)[kept], 10.0 / QUIET.dynamic_range_db * 255.0, atol=1.0)


def test_noise_comes_up_with_depth_and_differs_from_picture_to_picture() -> None:
    settings = with_settings(noise_db=-100.0, tgc_slope_db_cm_mhz=1.0)
    field = phantom()
    first, second = (simulate(field, moved(), settings, seq=seq) for seq in (1, 2))
    assert decibel(rms(first.envelope)) == pytest.approx(-100.0, abs=0.3)
    assert first.grey[:, -60:].mean() > first.grey[:, :60].mean() + 20.0
    assert abs(np.corrcoef(first.envelope.ravel(), second.envelope.ravel())[0, 1]) < 0.02
    assert np.array_equal(first.grey, simulate(field, moved(), settings, seq=1).grey)


def test_the_ring_is_near() -> None:
    image = simulate(phantom(), moved(), with_settings(ring_db=-14.0))
    assert image.grey[:, image.ranges_mm < 1.0].mean() > 200.0
    assert image.grey[:, image.ranges_mm > 9.0].max() == 0
