"""Where things are: poses, the volume's look-up, the picture's millimetres; and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from cathxr.ultrasound import AcousticField, IceSettings, PolarImage, Scales, ct_from_transducer, fan_picture, simulate
from cathxr.ultrasound.sampling import codes_at, first_code_at

from ...ultrasound_support.phantoms import QUIET, moved, phantom, share_within, voxel_centres


def test_the_volume_is_looked_up_as_scipy_does() -> None:
    """The plain reference of the loops: linear interpolation, the edge's value outside. 1e-12: rounding."""
    rng = np.random.default_rng(1)
    rgba = rng.integers(0, 256, (5, 6, 7, 4), dtype=np.uint8)
    points = rng.uniform(-2.0, 9.0, (500, 3))
    out = np.empty(4)
    for i, j, k in points:
        codes_at(rgba, i, j, k, out)
        expected = [
            map_coordinates(rgba[..., c].astype(float), [[k], [j], [i]], order=1, mode="nearest")[0] for c in range(4)
        ]
        assert out * 255.0 == pytest.approx(expected, abs=1e-10)
        assert first_code_at(rgba, i, j, k) == pytest.approx(out[0], abs=1e-12)


def test_impedance_is_coded_finely_near_blood_and_reaches_bone_and_air() -> None:
    scales = Scales()
    for log_ratio in (-1.4, -0.2, -0.01, 0.0, 0.018, 0.3, 1.39):
        byte = np.rint(255.0 * scales.code_log_impedance(log_ratio))
        step = 0.5 * (scales.impedance_high - scales.impedance_low) / 255.0  # half a step, in the bent scale
        allowed = step * np.hypot(scales.impedance_width, log_ratio) * 1.05
        assert scales.log_impedance(byte / 255.0) == pytest.approx(log_ratio, abs=allowed)
    assert 2.0 * step * scales.impedance_width < 0.0012


def _blob(x_mm: float, y_mm: float, z_mm: float) -> AcousticField:
    x, y, z = voxel_centres()
    return phantom(0.0, share_within(1.5 - np.sqrt((x - x_mm) ** 2 + (y - y_mm) ** 2 + (z - z_mm) ** 2)), 0.0)


def _brightest(image: PolarImage) -> tuple[float, float]:
    """Return x and z (mm, frame `transducer`) of the echoes' centre."""
    weight = image.envelope**2
    angle, r = np.meshgrid(image.angles_rad, image.ranges_mm, indexing="ij")
    reach = r + image.settings.apex_mm
    x, z = reach * np.cos(angle) - image.settings.apex_mm, reach * np.sin(angle)
    return float((weight * x).sum() / weight.sum()), float((weight * z).sum() / weight.sum())


@pytest.mark.parametrize("apex_mm", [3.0, 20.0])
def test_a_point_is_where_the_frame_says(apex_mm: float) -> None:
    """x along the beam, z distal, whatever the apex; half a voxel, as the speckle in a blob of 3 mm is uneven."""
    image = simulate(_blob(40.0, 0.0, 15.0), moved(), replace(QUIET, apex_mm=apex_mm))
    assert _brightest(image) == pytest.approx((40.0, 15.0), abs=0.5)


def test_the_plane_contains_the_catheters_axis() -> None:
    """With the tip's z along ct's y, and its x along ct's x, a point on y is in the plane, and a point on z is not."""
    tip = np.eye(4)
    tip[:3, :3] = np.column_stack([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    image = simulate(_blob(40.0, 15.0, 0.0), ct_from_transducer(tip, offset_mm=5.0, radius_mm=1.5), QUIET)
    assert _brightest(image) == pytest.approx((40.0 - 1.5, 15.0 + 5.0), abs=0.5)
    missed = simulate(_blob(40.0, 0.0, 15.0), tip, QUIET)
    assert missed.envelope.max() < 1e-3 * image.envelope.max()


def test_the_picture_has_a_scale() -> None:
    """A blob 40 mm deep and 15 mm distal is at that pixel, on the left; depth and width are the sector's."""
    image = simulate(_blob(40.0, 0.0, 15.0), moved(), replace(QUIET, gain_db=20.0))
    picture = fan_picture(image, mm_per_px=0.25)
    rows, columns = np.nonzero(picture.grey > 0.6 * picture.grey.max())
    column, row = picture.pixel_of(15.0, 40.0)
    assert columns.mean() == pytest.approx(column, abs=3.0)
    assert rows.mean() == pytest.approx(row, abs=3.0)
    assert column < picture.face_px[0]
    assert picture.inside[int(picture.pixel_of(0.0, 79.5)[1]), int(picture.face_px[0])]
    assert picture.grey[~picture.inside].max() == 0
    reach = QUIET.depth_mm + QUIET.apex_mm
    assert picture.inside.sum() * 0.25**2 == pytest.approx(
        np.pi / 4.0 * (reach**2 - QUIET.apex_mm**2), rel=0.01
    )  # of a quarter of a ring; the boundary is 250 mm of 0.25 mm pixels in 6700 mm²


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="depth_mm: expected 10 to 300, got 5"):
        IceSettings(depth_mm=5.0)
    with pytest.raises(ValueError, match="slices: expected 1 or 3"):
        IceSettings(slices=2)
    with pytest.raises(ValueError, match="tgc_db: expected 8 numbers, got 3"):
        IceSettings(tgc_db=(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="rgba: expected uint8"):
        AcousticField(np.zeros((2, 2, 2, 3), np.uint8), np.eye(4))
    with pytest.raises(ValueError, match="can be inverted"):
        AcousticField(np.zeros((2, 2, 2, 4), np.uint8), np.zeros((4, 4)))
    field = phantom()
    with pytest.raises(ValueError, match="not orthogonal"):
        simulate(field, np.diag([1.0, 2.0, 1.0, 1.0]))
    with pytest.raises(ValueError, match="right-handed"):
        simulate(field, np.diag([1.0, 1.0, -1.0, 1.0]))
    with pytest.raises(ValueError, match="scatter_max: expected a positive number"):
        Scales(scatter_max=0.0)
    with pytest.raises(ValueError, match="mm_per_px"):
        fan_picture(simulate(field, moved(), QUIET), mm_per_px=0.0)
