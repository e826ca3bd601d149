"""The slices of a volume show its voxels where they are, and the letters say which side of the patient is which."""

from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from cathxr.heart.slices import PLANES, hanging, letters_of, slice_of
from cathxr.heart.volume import Grid

SHAPE = (4, 5, 6)


def grid_of(axes: np.ndarray, spacing: tuple[float, float, float] = (0.5, 0.7, 1.5)) -> Grid:
    """Return a grid whose i, j, k run along the columns of `axes` in ct."""
    matrix = np.eye(4)
    matrix[:3, :3] = axes * spacing
    matrix[:3, 3] = (-30.0, 12.0, 700.0)
    return Grid(SHAPE, matrix)


def right_handed() -> list[np.ndarray]:
    """Return all 24 ways in which i, j, k can run along the patient's axes."""
    found = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        axes = np.zeros((3, 3))
        for n in range(3):
            axes[order[n], n] = signs[n]
        if np.linalg.det(axes) > 0.0:
            found.append(axes)
    return found


@pytest.mark.parametrize("axes", right_handed())
def test_however_a_volume_is_stored_its_slices_look_the_same(axes: np.ndarray) -> None:
    seen = hanging(grid_of(axes))
    assert [seen.plane(name).letters for name in PLANES] == [
        ("R", "L", "A", "P"), ("R", "L", "H", "F"), ("A", "P", "H", "F"),
    ]  # fmt: skip
    assert seen.tilt_deg == pytest.approx(0.0, abs=1e-6)


@given(
    turn=arrays(float, 3, elements=st.floats(-1.5, 1.5)),
    axes=st.sampled_from(right_handed()),
)
def test_what_is_seen_at_a_place_is_the_voxel_of_that_place(turn: np.ndarray, axes: np.ndarray) -> None:
    grid = grid_of(Rotation.from_rotvec(turn).as_matrix() @ axes)
    seen = hanging(grid)
    voxels = np.arange(np.prod(SHAPE), dtype=np.int16).reshape(SHAPE)
    hung = seen.hung(voxels)
    assert hung.shape == seen.shape[::-1]
    for x, y, z in ((0, 0, 0), (seen.shape[0] - 1, 1, 2), tuple(each - 1 for each in seen.shape)):
        place = seen.to_ct((x, y, z))
        i, j, k = np.round(grid.to_voxel(place)).astype(int)
        # Rounding of float64 in coordinates of some hundred mm: far below 1e-9 of a voxel.
        assert np.allclose(grid.to_voxel(place), (i, j, k), atol=1e-9)
        assert hung[z, y, x] == voxels[k, j, i]
        assert seen.voxel_at(place) == (x, y, z)
        assert slice_of(hung, "axial", z)[y, x] == slice_of(hung, "coronal", y)[z, x]
        assert slice_of(hung, "axial", z)[y, x] == slice_of(hung, "sagittal", x)[z, y]
    assert np.allclose(seen.to_seen(seen.to_ct((1.25, 2.5, -0.75))), (1.25, 2.5, -0.75), atol=1e-9)


@given(turn=arrays(float, 3, elements=st.floats(-0.6, 0.6)))
def test_the_axes_of_the_planes_are_the_nearest_to_the_patients(turn: np.ndarray) -> None:
    seen = hanging(grid_of(Rotation.from_rotvec(turn).as_matrix()))
    directions = seen.ct_from_seen[:3, :3] / np.linalg.norm(seen.ct_from_seen[:3, :3], axis=0)
    shares = np.diag(np.diag([1.0, 1.0, -1.0]) @ directions)  # left, back, feet
    assert (shares > 0.0).all()
    assert np.degrees(np.arccos(np.clip(shares.min(), -1.0, 1.0))) == pytest.approx(seen.tilt_deg, abs=1e-6)


def test_the_spacing_belongs_to_the_axis_as_it_is_seen() -> None:
    sagittal_stack = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # i to the back, j up, k to the left
    seen = hanging(grid_of(sagittal_stack))
    plane = seen.plane("sagittal")
    assert (plane.columns, plane.rows, plane.slices) == (6, 5, 4)
    assert plane.spacing_mm == pytest.approx((0.5, 0.7, 1.5))
    assert seen.plane("axial").spacing_mm == pytest.approx((1.5, 0.5, 0.7))


def test_an_oblique_volume_names_both_directions_of_a_side() -> None:
    tilted = hanging(grid_of(Rotation.from_euler("z", 30.0, degrees=True).as_matrix()))
    assert tilted.plane("axial").letters == ("RA", "LP", "AL", "PR")
    assert tilted.tilt_deg == pytest.approx(30.0)
    slightly = hanging(grid_of(Rotation.from_euler("z", 9.0, degrees=True).as_matrix()))
    assert slightly.plane("axial").letters == ("R", "L", "A", "P")


@pytest.mark.parametrize(
    ("direction", "letters"),
    [((1, 0, 0), "L"), ((0, -2, 0), "A"), ((0, 0, 5), "H"), ((-1, 0.5, 0), "RP"), ((0.3, 0.4, -1), "FPL")],
)
def test_letters(direction: tuple[float, float, float], letters: str) -> None:
    assert letters_of(direction) == letters


def test_places_outside_are_no_voxel_and_no_slice() -> None:
    seen = hanging(grid_of(np.eye(3)))
    assert seen.voxel_at(seen.to_ct((-0.4, 0.0, 0.0))) == (0, 0, 0)
    assert seen.voxel_at(seen.to_ct((-0.6, 0.0, 0.0))) is None
    with pytest.raises(ValueError, match="0 to 3 of the axial slices, got 4"):
        slice_of(np.zeros(SHAPE), "axial", 4)
