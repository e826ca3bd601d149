"""The virtual wall's depth against shapes whose distance is known."""

import numpy as np
import pytest

from cathxr.core import DataError, FloatArray
from cathxr.heart import builtin_path, read_heart
from cathxr.heart.acoustic import leads_out
from cathxr.heart.model import Opening
from cathxr.heart.volume import Grid, LabelVolume
from cathxr.heart.wall_field import BoxDepth, wall_field
from cathxr.registration import read_registration

RADIUS = 12.0
SPACING = np.array([0.8, 0.7, 1.0])


def sphere() -> LabelVolume:
    """A ball of blood of 12 mm around (5, -3, 8), its shell of 4 mm labelled as myocardium."""
    shape = (44, 60, 52)
    matrix = np.diag([*SPACING, 1.0])
    matrix[:3, 3] = np.array([5.0, -3.0, 8.0]) - SPACING * (np.array(shape[::-1]) - 1) / 2.0
    grid = Grid(shape, matrix)
    k, j, i = np.indices(shape)
    away = np.linalg.norm(grid.to_ct(np.stack([i, j, k], axis=-1)) - [5.0, -3.0, 8.0], axis=-1)
    labels = np.where(away <= RADIUS, 3, np.where(away <= RADIUS + 4.0, 9, 0)).astype(np.uint8)
    return LabelVolume(labels, grid, {3: "left_atrium", 9: "myocardium"})


def around(away: FloatArray) -> FloatArray:
    directions = np.random.default_rng(5).normal(size=(len(away), 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.array([5.0, -3.0, 8.0]) + away[:, None] * directions


def test_depth_of_a_sphere() -> None:
    field = wall_field(sphere())
    away = np.linspace(1.0, 25.0, 300)
    off = field.depth_ct(around(away)) - (away - RADIUS)
    # Voxels of up to 1 mm: the boundary is off by half of one, and by its corners; the mean is much better.
    assert np.abs(off).max() < 0.9
    assert abs(off[(away > 8.0) & (away < 20.0)].mean()) < 0.25


def test_beyond_the_field_depth_is_never_too_small() -> None:
    away = np.linspace(30.0, 200.0, 50)
    depth = wall_field(sphere()).depth_ct(around(away))
    assert (depth > away - RADIUS - 1.0).all()


def test_the_box_is_put_through_the_registration() -> None:
    field = wall_field(sphere())
    ct_from_box = np.array([[0.0, 0.0, 2.0, 5.0], [2.0, 0.0, 0.0, -3.0], [0.0, 2.0, 0.0, 8.0], [0.0, 0.0, 0.0, 1.0]])
    points = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    in_ct = field.depth_ct(np.array([[5.0, -3.0, 8.0], [5.0, 17.0, 8.0]]))
    assert BoxDepth(field, ct_from_box)(points) == pytest.approx(in_ct)


def test_blood_goes_on_beyond_an_opening() -> None:
    opening = Opening("vein", "Vein", "left_atrium", np.array([17.0, -3.0, 8.0]), np.array([1.0, 0.0, 0.0]), 6.0)
    plain, through = wall_field(sphere()), wall_field(sphere(), vessels=[opening])
    along = np.column_stack([np.linspace(10.0, 30.0, 40), np.full(40, -3.0), np.full(40, 8.0)])
    assert plain.depth_ct(along).max() > 10.0
    assert through.depth_ct(along).max() < 0.0
    aside = np.array([[24.0, 3.0, 8.0]])  # 3 mm beside the tube
    assert through.depth_ct(aside)[0] == pytest.approx(3.0, abs=0.9)


def test_without_blood_there_is_no_wall() -> None:
    grid = Grid((4, 4, 4), np.eye(4))
    with pytest.raises(DataError, match="no blood"):
        wall_field(LabelVolume(np.full((4, 4, 4), 9, np.uint8), grid, {9: "myocardium"}))


def test_the_built_in_heart() -> None:
    reading = pytest.importorskip("cathxr.heart.reading")
    heart = read_heart(builtin_path())
    assert heart.labels is not None
    assert heart.registration is not None
    labels = reading.read_labels(heart.labels, like=None)
    vessels = [opening for key, opening in heart.openings.items() if leads_out(key, labels)]
    depth = BoxDepth(wall_field(labels, vessels=vessels), read_registration(heart.registration).matrix)
    registration = read_registration(heart.registration)
    # From the inlet through the right atrium to the upper caval mouth a straight catheter stays in the blood, within a
    # voxel or two where it rubs along; the middle of the septum between the atria is wall; the valve's middle is blood.
    line = depth(np.column_stack([np.linspace(0.0, 70.0, 50), np.zeros(50), np.zeros(50)]))
    assert line.max() < 2.0
    assert np.median(line) < -4.0
    named = {key: float(depth(registration.box(point[None]))[0]) for key, point in heart.points_ct.items()}
    assert named["interatrial_septum"] > 0.5
    assert named["tricuspid_valve"] < -5.0
    assert depth(np.array([[45.0, 55.0, 0.0]]))[0] > 5.0
