"""Whatever order, orientation, gaps and rescales a series has: the same volume, or an honest error."""

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cathxr.core import DataError
from cathxr.heart.reading import read_volume
from cathxr.heart.volume import Grid, Volume

from ..heart_support.dicom_series import volume_of, write_series

SLICES = 14
PLACE_MM = 1e-4  # positions are written with 6 decimals, cosines with 10

angles = st.tuples(*[st.floats(-180.0, 180.0)] * 3)
few = settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])


def bowl(slices: int = SLICES) -> np.ndarray:
    """Return a volume that no turn or shift of the slices leaves as it is, a parabola along k."""
    k, j, i = np.indices((slices, 9, 7))
    return 3.0 * k * k + 7.0 * j - 11.0 * i


@few
@given(
    seed=st.integers(0, 2**16),
    turn=angles,
    spacing=st.tuples(st.floats(0.3, 2.0), st.floats(0.3, 2.0), st.floats(0.4, 3.0)),
    origin=st.tuples(*[st.floats(-500.0, 500.0)] * 3),
)
def test_any_order_and_orientation_gives_the_same_volume(
    seed: int, turn: tuple[float, ...], spacing: tuple[float, ...], origin: tuple[float, ...]
) -> None:
    rotation = Rotation.from_euler("xyz", turn, degrees=True).as_matrix()
    written = volume_of(bowl(), spacing=spacing, rotation=rotation, origin=origin)
    with tempfile.TemporaryDirectory() as folder:
        write_series(Path(folder), written, shuffle=seed)
        found = read_volume(Path(folder))
    np.testing.assert_array_equal(found.hu, written.hu)
    np.testing.assert_allclose(found.grid.ct_from_voxel, written.grid.ct_from_voxel, atol=PLACE_MM)
    assert found.technical.remarks == ()


@few
@example(missing={0, 2, 3, 5, 7, 9}, turn=(0.0, 0.0, 0.0))  # two beside each other
@example(missing={0, 2, 4, 6, 8}, turn=(0.0, 0.0, 0.0))  # half of what is left lies twice as far apart
@given(missing=st.sets(st.integers(0, SLICES - 1), max_size=6), turn=angles)
def test_gaps_are_bridged_and_said_or_refused(missing: set[int], turn: tuple[float, ...]) -> None:
    rotation = Rotation.from_euler("xyz", turn, degrees=True).as_matrix()
    written = volume_of(bowl(), spacing=(0.7, 0.7, 2.0), rotation=rotation)
    kept = [k for k in range(SLICES) if k not in missing]
    inner = [k for k in missing if kept[0] < k < kept[-1]]
    with tempfile.TemporaryDirectory() as folder:
        write_series(Path(folder), written, missing=sorted(missing))
        found = _found_or_refused(Path(folder))
    if isinstance(found, str):
        assert inner, "nothing inside is missing, and it was refused"
        assert "missing" in found or "vary" in found
        return
    assert bool(found.technical.remarks) == bool(inner)
    at = np.rint(_slices_of(found.grid, written.grid)).astype(int)
    for k, of_found in enumerate(found.hu):
        source = at[k]
        if source in kept:
            np.testing.assert_array_equal(of_found, written.hu[source])
        else:
            # A line between the parabola's neighbours is off by 3 HU times the distances; half a HU is rounding.
            below, above = max(each for each in kept if each < source), min(each for each in kept if each > source)
            off = np.abs(of_found - written.hu[source].astype(int)).max()
            assert off <= 3.0 * (source - below) * (above - source) + 0.5


@few
@given(
    slopes=st.lists(st.sampled_from([0.25, 0.5, 1.0]), min_size=SLICES, max_size=SLICES),
    intercepts=st.lists(st.integers(-2000, 0), min_size=SLICES, max_size=SLICES),
    syntax=st.sampled_from(["implicit", "explicit", "big_endian", "deflated"]),
)
def test_any_rescale_gives_the_same_hu(slopes: list[float], intercepts: list[int], syntax: str) -> None:
    written = volume_of(bowl())
    with tempfile.TemporaryDirectory() as folder:
        write_series(Path(folder), written, slope=slopes, intercept=intercepts, syntax=syntax)
        found = read_volume(Path(folder))
    np.testing.assert_array_equal(found.hu, written.hu)


@few
@given(tilt_deg=st.floats(-25.0, 25.0), seed=st.integers(0, 99))
def test_any_tilt_keeps_what_changes_evenly(tilt_deg: float, seed: int) -> None:
    # A ramp along rows and columns: splines keep it exactly, so that only rounding (twice half a HU) and the edges err.
    k, j, i = np.indices((10, 60, 6))
    written = volume_of(4.0 * j - 9.0 * i + 0.0 * k, spacing=(0.8, 0.8, 1.0))
    with tempfile.TemporaryDirectory() as folder:
        write_series(Path(folder), written, tilt_deg=tilt_deg, shuffle=seed)
        found = read_volume(Path(folder))
    middle = found.grid.to_voxel(written.grid.to_ct([[3.0, 30.0, k] for k in range(10)]))
    np.testing.assert_allclose(middle[:, [0, 2]], [[3.0, k] for k in range(10)], atol=1e-3)
    rows = middle[:, 1]
    low = np.floor(rows).astype(int)
    values = [
        (1.0 - part) * found.hu[k, row, 3] + part * found.hu[k, row + 1, 3]
        for k, (row, part) in enumerate(zip(low, rows - low, strict=True))
    ]
    assert np.abs(np.array(values) - (4.0 * 30.0 - 27.0)).max() <= 1.5


def _slices_of(found: Grid, written: Grid) -> np.ndarray:
    """Return which slice of the written grid each slice of the found one lies on."""
    centres = found.to_ct([[0.0, 0.0, k] for k in range(found.shape[0])])
    return np.asarray(written.to_voxel(centres)[:, 2])


def _found_or_refused(folder: Path) -> Volume | str:
    """Return the volume, or the sentence that refuses it."""
    try:
        return read_volume(folder)
    except DataError as error:
        return str(error)
