"""What holds for every registration: there and back, the file, independence of frames and order."""

from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cathxr.core import FloatArray
from cathxr.registration import Kind, LandmarkPair, Solution, read_registration, register, write_registration
from cathxr.registration.fit import rotation_of

KINDS = st.sampled_from([Kind.RIGID, Kind.SIMILARITY, Kind.AFFINE])
SEEDS = st.integers(0, 2**32 - 1)
BOX = np.array([[70.0, 0, 0], [2, 3, -4], [40, -35, 30], [50, -40, -20], [30, 20, -25], [75, -30, 15.0]])
FEW = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def solved(kind: Kind, seed: int, *, noise_mm: float = 0.5) -> tuple[Solution, list[LandmarkPair]]:
    rng = np.random.default_rng(seed)
    linear = rotation_of(rng.normal(size=3)) * (1.0 if kind is Kind.RIGID else rng.uniform(0.9, 1.1))
    if kind is Kind.AFFINE:
        linear = linear @ (np.eye(3) + rng.normal(0.0, 0.02, (3, 3)))
    ct = BOX @ linear.T + rng.uniform(-300.0, 300.0, 3) + rng.normal(0.0, noise_mm, BOX.shape)
    pairs = [LandmarkPair(f"p{i}", a, b) for i, (a, b) in enumerate(zip(BOX, ct, strict=True))]
    return register(pairs, kind, heart_ct=ct), pairs


def errors(solution: Solution) -> FloatArray:
    found = solution.predicted_tre_mm(BOX)
    assert found is not None
    return found


@FEW
@given(kind=KINDS, seed=SEEDS)
def test_there_and_back_is_where_one_was(kind: Kind, seed: int) -> None:
    found = solved(kind, seed)[0].registration
    assert np.allclose(found.box(found.ct(BOX)), BOX, atol=1e-9)  # rounding: 1e-16 of 500 mm, a hundred times over
    homogeneous = np.c_[BOX, np.ones(len(BOX))] @ found.matrix.T
    assert np.allclose(homogeneous[:, :3], found.ct(BOX), atol=1e-9)
    assert np.linalg.det(found.linear_ct_from_box) > 0


@FEW
@given(kind=KINDS, seed=SEEDS)
def test_the_file_gives_back_what_was_written(kind: Kind, seed: int, tmp_path: Path) -> None:
    found = solved(kind, seed)[0].registration
    write_registration(tmp_path / "registration.toml", found)
    again = read_registration(tmp_path / "registration.toml")
    assert np.array_equal(again.matrix, found.matrix)
    for name in ("kind", "fre_mm", "tre_mm", "predicted_tre_mm", "worst_tre_mm", "fle_mm"):
        assert getattr(again, name) == getattr(found, name)
    assert found.covariance is not None
    assert again.covariance is not None
    assert np.array_equal(again.covariance, found.covariance)
    assert [each.held_out_mm for each in again.landmarks] == [each.held_out_mm for each in found.landmarks]


@FEW
@given(kind=KINDS, seed=SEEDS)
def test_moving_the_heart_changes_no_error(kind: Kind, seed: int) -> None:
    solution, pairs = solved(kind, seed)
    turn, shift = rotation_of(np.array([0.3, 1.2, -0.5])), np.array([40.0, -7.0, 3.0])
    moved = register([LandmarkPair(each.name, each.box_mm, turn @ each.ct_mm + shift) for each in pairs], kind)
    assert np.allclose(errors(moved), errors(solution), rtol=1e-6)
    assert np.allclose(moved.registration.ct(BOX), solution.registration.ct(BOX) @ turn.T + shift, atol=1e-6)


@FEW
@given(kind=KINDS, seed=SEEDS)
def test_the_order_of_the_landmarks_does_not_matter(kind: Kind, seed: int) -> None:
    solution, pairs = solved(kind, seed)
    other = register(pairs[::-1], kind)
    assert np.allclose(other.registration.matrix, solution.registration.matrix, atol=1e-9)
    assert np.allclose(errors(other), errors(solution), rtol=1e-6)


@FEW
@given(seed=SEEDS)
def test_a_freer_fit_never_leaves_more(seed: int) -> None:
    pairs = solved(Kind.RIGID, seed, noise_mm=1.0)[1]
    left = [register(pairs, kind).registration.fre_mm or 0.0 for kind in (Kind.RIGID, Kind.SIMILARITY, Kind.AFFINE)]
    assert left[0] >= left[1] - 1e-4 >= left[2] - 2e-4  # figures are rounded to 1e-4
