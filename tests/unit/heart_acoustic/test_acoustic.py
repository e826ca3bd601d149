"""The acoustic volume of analytic hearts: values, where the edges lie, and that no stairs are left."""

import numpy as np
import pytest
from scipy import ndimage

from cathxr.core import DataError
from cathxr.heart.acoustic import acoustic_volume, texture_grid
from cathxr.heart.acoustic_codes import CHANNELS, SCALES, AcousticVolume
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.model import Opening
from cathxr.heart.resample import sampler
from cathxr.heart.tissues import TISSUES
from cathxr.heart.volume import Grid, LabelVolume, Technical, Volume

SPACING = 1.0
GRID = Grid((90, 90, 90), np.diag([SPACING, SPACING, SPACING, 1.0]))
CENTRE = np.array([44.3, 45.1, 44.8])
RADIUS = 20.0


def points(grid: Grid) -> np.ndarray:
    k, j, i = np.indices(grid.shape)
    return grid.to_ct(np.stack([i, j, k], axis=-1).astype(float))


def labelled(**masks: np.ndarray) -> LabelVolume:
    labels = np.zeros(GRID.shape, np.uint8)
    for key, mask in masks.items():
        labels[mask & (labels == 0)] = CATALOGUE[key].label
    return LabelVolume(labels, GRID, {CATALOGUE[key].label: key for key in masks})


def ball(radius: float = RADIUS) -> np.ndarray:
    return np.linalg.norm(points(GRID) - CENTRE, axis=-1) <= radius


def channel(made: AcousticVolume, name: str) -> np.ndarray:
    return made.rgba[..., CHANNELS.index(name)].astype(float) / 255.0


def sampled(made: AcousticVolume, name: str, at_mm: np.ndarray) -> np.ndarray:
    """What a texture unit gives: trilinear samples of a channel's codes."""
    voxels = made.grid.to_voxel(at_mm)
    return ndimage.map_coordinates(channel(made, name), voxels[..., ::-1].T, order=1, mode="nearest").T


def directions(count: int = 300) -> np.ndarray:
    """Directions spread over the sphere (Fibonacci's lattice)."""
    z = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    flat = np.sqrt(1.0 - z**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)


@pytest.fixture(scope="module")
def embedded() -> AcousticVolume:
    """A ball of blood in a block of labelled myocardium, by a CT that sees both."""
    blood = ball()
    hu = np.where(blood, 400, 60).astype(np.int16)
    return acoustic_volume(
        labelled(left_ventricle=blood, myocardium=~blood), volume=Volume(hu, GRID, Technical("CT")), size=96
    )


def test_values_deep_inside_are_the_tables(embedded: AcousticVolume) -> None:
    for key, at in (("blood", CENTRE), ("myocardium", CENTRE + np.array([0.0, 32.0, 0.0]))):
        tissue = TISSUES[key]
        for name, value in (
            ("impedance", tissue.impedance_mrayl),
            ("scatter", tissue.scatter),
            ("attenuation", tissue.attenuation),
        ):
            code = float(SCALES[name].code(value))
            # One byte: rounding, and float32 on the way.
            assert sampled(embedded, name, at[None])[0] == pytest.approx(code, abs=1.0 / 255.0), (key, name)
        assert sampled(embedded, "interface", at[None])[0] == 0.0


def test_the_half_level_lies_on_the_boundary(embedded: AcousticVolume) -> None:
    levels = [float(SCALES["scatter"].code(TISSUES[each].scatter)) for each in ("blood", "myocardium")]
    half = sum(levels) / 2.0
    radii = np.arange(RADIUS - 4.0, RADIUS + 4.0, 0.02)
    along = sampled(embedded, "scatter", CENTRE + radii[:, None, None] * directions())
    crossing = radii[np.argmax(along > half, axis=0)]
    # Smoothing with sigma = 1.5 voxels moves a ball's boundary inwards by sigma^2 / R = 0.11 mm, and the ball's own
    # voxels are known to a fraction of one; so is the place in any one direction.
    assert np.mean(crossing) == pytest.approx(RADIUS, abs=0.25)
    assert np.std(crossing) < 0.15
    assert np.abs(crossing - np.mean(crossing)).max() < 0.5


def test_no_stairs_are_left(embedded: AcousticVolume) -> None:
    h = 0.5
    ways = directions()
    at = CENTRE + RADIUS * ways
    gradient = np.stack(
        [
            sampled(embedded, "impedance", at + h * axis) - sampled(embedded, "impedance", at - h * axis)
            for axis in np.eye(3)
        ],
        axis=1,
    )
    cosine = (gradient * ways).sum(axis=1) / np.linalg.norm(gradient, axis=1)
    error = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    # A step of one voxel s between two wide terraces, smoothed with sigma, leans by atan(s / (sigma sqrt(2 pi))): 15
    # degrees with sigma = 1.5 s, and only there, at the ball's six poles. Impedance has some 20 bytes over the edge, of
    # which 8 lie between the two samples: rounding turns a gradient by up to 0.5 * sqrt(2) / 8 = 5 degrees more.
    # The labels' own faces would be off by up to 55 degrees, 30 in the mean.
    assert error.max() < 20.0
    assert np.percentile(error, 95) < 10.0
    assert error.mean() < 4.0


def test_the_interface_is_where_the_boundary_is_and_as_strong(embedded: AcousticVolume) -> None:
    radii = np.arange(RADIUS - 6.0, RADIUS + 6.0, 0.05)
    codes = sampled(embedded, "interface", CENTRE + radii[:, None, None] * directions())
    strength = SCALES["interface"].value(codes * 255.0)
    peak = radii[strength.mean(axis=1).argmax()]
    assert peak == pytest.approx(RADIUS, abs=0.4)
    # Along a radius, half the gradient of ln Z adds up to half the step: the amplitude reflection coefficient.
    blood, muscle = TISSUES["blood"].impedance_mrayl, TISSUES["myocardium"].impedance_mrayl
    total = strength.sum(axis=0) * 0.05
    # A byte of this channel is 4 to 7 % of its value there.
    assert total.mean() == pytest.approx(np.log(muscle / blood) / 2.0, rel=0.1)


def test_touching_pools_have_no_seam_between_them() -> None:
    first = ball() & (points(GRID)[..., 0] < CENTRE[0])
    made = acoustic_volume(labelled(left_ventricle=first, left_atrium=ball() & ~first), size=80)
    blood = float(SCALES["scatter"].code(TISSUES["blood"].scatter))
    across = CENTRE + np.linspace(-12.0, 12.0, 49)[:, None] * np.array([1.0, 0.3, 0.2])
    # A byte for rounding, and one for the two profiles' sum, which is one only as far as float32 goes.
    assert np.abs(sampled(made, "scatter", across) - blood).max() < 2.0 / 255.0


def test_without_a_ct_there_are_walls_pericardium_and_lung() -> None:
    made = acoustic_volume(labelled(left_ventricle=ball()), size=96)
    for away, key in ((4.5, "myocardium"), (20.5, "lung")):
        tissue = TISSUES[key]
        codes = sampled(made, "impedance", CENTRE + (RADIUS + away) * directions(60))
        assert np.abs(codes - float(SCALES["impedance"].code(tissue.impedance_mrayl))).max() < 3.0 / 255.0, key
    radii = np.arange(RADIUS + 2.0, RADIUS + 18.0, 0.05)
    codes = sampled(made, "attenuation", CENTRE + radii[:, None, None] * directions(60))
    half = (SCALES["attenuation"].code(20.0) + SCALES["attenuation"].code(TISSUES["pericardium"].attenuation)) / 2.0
    lung_from = radii[np.argmax(codes > half, axis=0)] - RADIUS
    # 9 mm of muscle and 2 mm of pericardium; the distance is found on a grid of 0.9 mm.
    assert lung_from.mean() == pytest.approx(11.0, abs=0.4)
    assert np.std(lung_from) < 0.25


def test_a_vessel_goes_on_beyond_its_opening() -> None:
    up = np.array([0.0, 0.0, 1.0])
    mouth = Opening("superior_vena_cava", "SVC", "right_atrium", CENTRE + RADIUS * up, up, 14.0)
    blood = float(SCALES["scatter"].code(TISSUES["blood"].scatter))
    made = acoustic_volume(labelled(right_atrium=ball()), openings={"superior_vena_cava": mouth}, size=80)
    along = CENTRE + np.linspace(10.0, 31.0, 40)[:, None] * up
    assert np.abs(sampled(made, "scatter", along) - blood).max() < 2.0 / 255.0
    closed = acoustic_volume(labelled(right_atrium=ball()), size=80)
    assert sampled(closed, "scatter", CENTRE[None] + 24.0 * up)[0] > blood + 0.2


def test_a_thin_wall_between_two_pools_stays() -> None:
    x = points(GRID)[..., 0]
    first, second = ball() & (x < CENTRE[0] - 1.5), ball() & (x > CENTRE[0] + 1.5)
    made = acoustic_volume(labelled(left_atrium=first, right_atrium=second), size=128)
    centre = sampled(made, "scatter", CENTRE[None])[0]
    blood, muscle = (float(SCALES["scatter"].code(TISSUES[each].scatter)) for each in ("blood", "myocardium"))
    # 3 mm between pools that are known to a voxel of 1 mm: at least half of the wall's contrast has to be left.
    assert centre > (blood + muscle) / 2.0


def test_lung_and_bone_come_from_the_ct() -> None:
    hu = np.full(GRID.shape, -850, np.int16)
    near = points(GRID) - CENTRE
    hu[np.linalg.norm(near, axis=-1) < 27.0] = 60
    hu[ball()] = 400
    hu[(np.abs(near[..., 0] - 28.0) < 4.0) & (np.abs(near[..., 1]) < 4.0)] = 1300
    made = acoustic_volume(labelled(right_atrium=ball()), volume=Volume(hu, GRID, Technical("CT")), size=96)
    impedance = made.physical("impedance")
    at = np.round(made.grid.to_voxel(np.stack([CENTRE - [31, 0, 0], CENTRE + np.array([28, 0, 0])]))).astype(int)
    lung, bone = (float(impedance[tuple(each[::-1])]) for each in at)
    assert lung == pytest.approx(TISSUES["lung"].impedance_mrayl, rel=0.15)  # a byte is 10 % at this end of the scale
    assert bone == pytest.approx(TISSUES["bone"].impedance_mrayl, rel=0.15)


def test_same_input_same_bytes_and_the_labels_stay() -> None:
    labels = labelled(left_ventricle=ball(15.0))
    before = labels.labels.copy()
    one, other = acoustic_volume(labels, size=48), acoustic_volume(labels, size=48)
    assert np.array_equal(one.rgba, other.rgba)
    assert np.array_equal(labels.labels, before)


def test_the_texture_covers_the_heart_and_a_margin_along_the_labels_axes() -> None:
    labels = labelled(left_ventricle=ball(15.0) & (points(GRID)[..., 2] < CENTRE[2]))
    grid = texture_grid(labels, 64)
    assert max(grid.shape) == 64
    assert np.ptp(grid.spacing_mm) == pytest.approx(0.0, abs=1e-9)
    corners = grid.to_ct(np.array([[0, 0, 0], np.array(grid.shape[::-1]) - 1]))
    assert (corners[0] <= CENTRE - [15.0, 15.0, 15.0] - 10.0).all()
    assert (corners[1] >= CENTRE + [15.0, 15.0, 0.0] + 10.0).all()


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(DataError, match="label volume is empty"):
        acoustic_volume(LabelVolume(np.zeros(GRID.shape, np.uint8), GRID, {}))
    labels = labelled(left_ventricle=ball())
    with pytest.raises(ValueError, match="size"):
        acoustic_volume(labels, size=500)
    other = Grid(GRID.shape, np.diag([2.0, 2.0, 2.0, 1.0]))
    with pytest.raises(ValueError, match="labels' grid"):
        acoustic_volume(labels, volume=Volume(np.zeros(GRID.shape, np.int16), other, Technical("CT")))


def test_smoothed_samples_of_a_plane_are_its_values() -> None:
    target = Grid((30, 31, 32), np.diag([1.7, 1.7, 1.7, 1.0]) + np.array([[0, 0, 0, 15.0]] * 3 + [[0, 0, 0, 0]]))
    values = (points(GRID) @ [0.3, -0.2, 0.5]).astype(np.float32)
    found = sampler(GRID, target, sigma_mm=1.4)(values)
    # A Gaussian's mean of a plane is the plane; its samples, three a standard deviation, leave 1e-4.
    assert np.abs(found - points(target) @ [0.3, -0.2, 0.5]).max() < 2e-3
    turned = np.eye(4)
    turned[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    with pytest.raises(ValueError, match="same axes"):
        sampler(GRID, Grid((3, 3, 3), turned), sigma_mm=1.0)
