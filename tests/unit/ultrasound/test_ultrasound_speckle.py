"""Speckle: Rayleigh statistics, as wide as the beam, fixed in the tissue."""

from itertools import pairwise

import numpy as np
import pytest

from cathxr.core import FloatArray
from cathxr.ultrasound import PolarImage, Resolved, simulate
from cathxr.ultrasound.scatterers import UNIT, imaginary_part, lattice_key, mixed, real_part, scatterers_at

from ...ultrasound_support.phantoms import QUIET, decibel, moved, phantom, rms, with_settings

DEPTHS = ((40, 110), (110, 200), (200, 290), (290, 440))


@pytest.fixture(scope="module")
def tissue() -> PolarImage:
    return simulate(phantom(0.0, 1.0, 0.0), moved(), QUIET)


def test_the_envelope_is_rayleigh_distributed(tissue: PolarImage) -> None:
    """Mean over standard deviation is sqrt(pi / (4 - pi)) = 1.913. Each depth band holds more than 700 independent
    speckles, so that the ratio's standard error is below 1.1 · 1.913 / sqrt(700) = 0.08; and the tail is as long."""
    for first, last in DEPTHS:
        part = tissue.envelope[:, first:last]
        assert part.mean() / part.std() == pytest.approx(1.913, abs=0.16), (first, last)
    whole = tissue.envelope[:, 40:] / rms(tissue.envelope[:, 40:])
    for level in (0.5, 1.0, 1.5):
        assert np.mean(whole > level) == pytest.approx(np.exp(-(level**2)), abs=0.03)


def test_its_level_is_the_scatter_at_every_depth(tissue: PolarImage) -> None:
    """-50 dB for myocardium; 0.6 dB: 8.7 / 2 / sqrt(700) = 0.16 of chance, the rest what the closed gain leaves."""
    for first, last in DEPTHS:
        assert decibel(rms(tissue.envelope[:, first:last])) == pytest.approx(QUIET.myocardium_db, abs=0.6)
    half = simulate(phantom(0.0, 0.5, 0.0), moved(), QUIET)
    assert decibel(rms(half.envelope) / rms(tissue.envelope)) == pytest.approx(-6.02, abs=0.1)  # 8 bits: 0.4 %


def _correlation_length(values: FloatArray, axis: int) -> float:
    """Return the standard deviation of the Gaussian that the squared envelope's autocovariance is, in samples.

    For complex Gaussian speckle the intensity's autocovariance is the squared magnitude of the field's.
    """
    intensity = np.square(values) - np.mean(np.square(values))
    spectrum = np.abs(np.fft.rfft(intensity, n=2 * values.shape[axis], axis=axis)) ** 2
    covariance = np.fft.irfft(spectrum, axis=axis).mean(axis=1 - axis)
    lags = np.arange(1, 30)
    share = covariance[lags] / covariance[0]
    below = int(np.argmax(share < 0.5))
    at = np.interp(0.5, share[[below, below - 1]], lags[[below, below - 1]]) if below else 0.5 / (1.0 - share[0])
    return float(at / np.sqrt(2.0 * np.log(2.0)))


def test_it_is_as_wide_as_the_point_spread_function_and_widens_with_depth(tissue: PolarImage) -> None:
    """Laterally: the intensity's correlation of a Gaussian amplitude PSF of sigma has sigma too (field: sigma · sqrt 2,
    squared again). The lattice's own correlation is added. 15 %: some 45 · 20 speckles a band, and linear read-out."""
    resolved = Resolved.of(QUIET)
    widths = []
    for first, last in DEPTHS:
        reach = QUIET.apex_mm + tissue.ranges_mm[first:last].mean()
        own = resolved.correlation_mm / np.sqrt(2.0)
        expected = np.hypot(resolved.sigma_lateral_rad * reach, own)
        measured = _correlation_length(tissue.envelope[:, first:last], 0) * resolved.line_rad * reach
        assert measured == pytest.approx(expected, rel=0.15), (first, last)
        widths.append(measured)
        axial = _correlation_length(tissue.envelope[:, first:last], 1) * resolved.sample_mm
        assert axial == pytest.approx(np.hypot(resolved.sigma_axial_mm, own), rel=0.15), (first, last)
    assert all(far > 1.2 * near for near, far in pairwise(widths))


def test_a_higher_frequency_is_finer() -> None:
    low, high = (Resolved.of(with_settings(frequency_mhz=mhz, depth_mm=40.0)) for mhz in (5.0, 10.0))
    assert low.sigma_axial_mm == pytest.approx(2.0 * high.sigma_axial_mm)
    assert low.sigma_lateral_rad > 1.5 * high.sigma_lateral_rad


def test_speckle_stays_in_the_tissue_when_the_probe_advances_along_the_beam(tissue: PolarImage) -> None:
    """Six samples nearer: on the centre line the picture moves by six samples, and is the same; unmoved it is not.

    0.95: the beam's width changes by one part in 40, and the lines beside the middle one move a little sideways.
    """
    nearer = simulate(phantom(0.0, 1.0, 0.0), moved(x_mm=6.0 * Resolved.of(QUIET).sample_mm), QUIET)
    lines = slice(93, 99)
    before = tissue.envelope[lines, 166:386]
    after = nearer.envelope[lines, 160:380]
    still = nearer.envelope[lines, 166:386]
    assert np.corrcoef(before.ravel(), after.ravel())[0, 1] > 0.95
    assert abs(np.corrcoef(before.ravel(), still.ravel())[0, 1]) < 0.3


def test_speckle_stays_in_the_tissue_when_the_probe_slides_and_turns(tissue: PolarImage) -> None:
    """0.5 mm along the catheter, and 1 degree within the plane: the same points of the tissue look the same.

    0.9: the beam crosses a point from another direction, 1.2 degrees at 40 mm of range.
    """
    angle = np.radians(1.0)
    turned = moved(z_mm=0.5)
    turned[:3, :3] = [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    for pose in (moved(z_mm=0.5), turned):
        other = simulate(phantom(0.0, 1.0, 0.0), pose, QUIET)
        x, z = np.meshgrid(np.arange(25.0, 70.0, 0.1), np.arange(-10.0, 10.0, 0.1))
        points = np.stack([x, np.zeros_like(x), z, np.ones_like(x)], axis=-1) @ np.linalg.inv(pose).T
        here, there = _at(tissue, x, z), _at(other, points[..., 0], points[..., 2])
        assert np.corrcoef(here.ravel(), there.ravel())[0, 1] > 0.9
        assert abs(np.corrcoef(here[:, 30:].ravel(), here[:, :-30].ravel())[0, 1]) < 0.2


def _at(image: PolarImage, x: FloatArray, z: FloatArray) -> FloatArray:
    """Return the envelope at points of the plane, bilinear."""
    of = image.settings
    line = (np.arctan2(z, x + of.apex_mm) / of.sector_rad + 0.5) * of.lines - 0.5
    sample = (np.hypot(x + of.apex_mm, z) - of.apex_mm) / of.depth_mm * of.samples - 0.5
    i, j = line.astype(int), sample.astype(int)
    a, b = line - i, sample - j
    e = image.envelope
    near, far = e[i, j] * (1 - a) + e[i + 1, j] * a, e[i, j + 1] * (1 - a) + e[i + 1, j + 1] * a
    return np.asarray(near * (1 - b) + far * b)


def test_the_lattice_is_white_and_unit() -> None:
    """Mean 0, mean square 1, real and imaginary and neighbours independent: 20 000 points, four standard errors."""
    points = [(x, y, z) for x in range(-14, 14) for y in range(-14, 14) for z in range(-13, 13)]
    keys = [mixed(lattice_key(*point)) for point in points]
    values = np.array([complex(real_part(key), imaginary_part(key)) for key in keys]).reshape(28, 28, 26)
    values /= np.sqrt(4.0 * (256.0**2 - 1.0) / 12.0)
    limit = 4.0 / np.sqrt(values.size)
    assert abs(values.mean()) < limit
    assert np.mean(np.abs(values) ** 2) == pytest.approx(1.0, abs=limit)
    assert abs(np.mean(values**2)) < limit
    for axis in range(3):
        rolled = np.roll(values, 1, axis=axis)
        assert abs(np.mean(values * rolled.conj())) < limit


def test_a_key_is_mixed_as_in_plain_integers() -> None:
    for x, y, z in ((0, 0, 0), (1, 2, 3), (-5, 7, -9), (123456, -98765, 4)):
        h = (x * 0x85EBCA77 + y * 0xC2B2AE3D + z * 0x27D4EB2F) & 0xFFFFFFFF
        h ^= h >> 16
        h = h * 0x7FEB352D & 0xFFFFFFFF
        h ^= h >> 15
        h = h * 0x846CA68B & 0xFFFFFFFF
        h ^= h >> 16
        assert int(mixed(lattice_key(x, y, z))) == h


def test_between_the_lattice_points_the_field_has_the_same_variance_and_the_stated_correlation() -> None:
    """At random places mean square 1; along a line the correlation's area is sqrt(2 pi) · correlation_mm."""
    rng = np.random.default_rng(5)
    starts = rng.uniform(-500.0, 500.0, (4000, 3))
    lags = np.arange(-1.9, 1.95, 0.1)
    fields = np.empty((len(lags), len(starts)), complex)
    for at, lag in enumerate(lags):
        for index, start in enumerate(starts):
            pair = np.zeros(2)
            scatterers_at(start[0] + lag, start[1], start[2], pair)
            fields[at, index] = complex(pair[0], pair[1]) / UNIT
    assert np.mean(np.abs(fields) ** 2) == pytest.approx(1.0, abs=0.04)
    middle = fields[len(lags) // 2]
    area = float(np.sum(np.mean(fields * middle.conj(), axis=1).real) * 0.1)
    resolved = Resolved.of(QUIET)
    # 8 %: 4000 products a lag, 39 lags, standard error 0.1 · sqrt(39) / sqrt(4000) / 1.55 = 0.6 %; steps of a tenth.
    assert area == pytest.approx(np.sqrt(2.0 * np.pi) * resolved.correlation_mm / resolved.cell_mm, rel=0.08)


def test_speckle_changes_slowly_when_the_catheter_rolls() -> None:
    """Four layers 0.27 mm apart, all of 1.2 mm thick: at 50 mm, 0.2 degrees are 0.17 mm, 0.8 degrees 0.7 mm, and
    3 degrees 2.6 mm. The field's correlation falls about linearly over the thickness, the envelope's as its square.
    """
    settings = with_settings(slices=3)
    field = phantom(0.0, 1.0, 0.0)
    part = (slice(None), slice(250, 310))
    before = simulate(field, moved(), settings).envelope[part]
    alike = []
    for degrees in (0.2, 0.8, 3.0):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        rolled = moved()
        rolled[:2, :2] = [[c, -s], [s, c]]
        alike.append(np.corrcoef(before.ravel(), simulate(field, rolled, settings).envelope[part].ravel())[0, 1])
    # A band holds some 600 speckles: 0.04 of chance, three times over.
    assert alike[0] == pytest.approx((1.0 - 0.17 / 1.2) ** 2, abs=0.12)
    assert alike[1] == pytest.approx((1.0 - 0.7 / 1.2) ** 2, abs=0.12)
    assert abs(alike[2]) < 0.12


def test_its_level_is_the_same_in_every_direction(tissue: PolarImage) -> None:
    """Cells are cubes, seen from any side: 1 dB, of which 0.2 of chance."""
    rng = np.random.default_rng(3)
    for _ in range(4):
        pose = moved()
        pose[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        pose[:3, 0] *= np.sign(np.linalg.det(pose[:3, :3]))
        level = rms(simulate(phantom(0.0, 1.0, 0.0), pose, QUIET).envelope)
        assert decibel(level) == pytest.approx(decibel(rms(tissue.envelope)), abs=1.0)
