"""Independent jobs side by side: the same bytes, the first failure, no job left waiting for another."""

import numpy as np
import pytest

from cathxr.app.heart_threads import side_by_side
from cathxr.heart.away import away_from
from cathxr.heart.build import build_heart
from cathxr.heart.jobs import one_after_another

from .shapes import two_halves
from .test_heart_build import SOURCE, content


@pytest.mark.parametrize("together", [one_after_another, side_by_side])
def test_results_keep_the_order_of_the_jobs(together):
    assert together([lambda n=n: n * n for n in range(20)]) == [n * n for n in range(20)]
    assert together([]) == []


@pytest.mark.parametrize("together", [one_after_another, side_by_side])
def test_a_failure_is_everyones(together):
    def fails() -> int:
        raise ValueError("of this job")

    with pytest.raises(ValueError, match="of this job"):
        together([lambda: 1, fails, lambda: 2])


def test_jobs_may_run_jobs():
    def inner() -> int:
        return sum(side_by_side([lambda: 1, lambda: 2, lambda: 3]))

    assert side_by_side([inner] * 6) == [6] * 6


def test_threads_change_no_byte(tmp_path):
    for name, together in (("one", one_after_another), ("other", side_by_side)):
        build_heart(
            tmp_path / name, volume=None, labels=two_halves(), source=SOURCE, name="Halves", budget=3000,
            together=together,
        )  # fmt: skip
    assert content(tmp_path / "one") == content(tmp_path / "other")


def test_distances_from_a_mask():
    mask = np.zeros((7, 9, 11), bool)
    mask[3, 4, 5] = True
    k, j, i = np.meshgrid(*(np.arange(n) for n in mask.shape), indexing="ij")
    expected = np.sqrt((2.0 * (k - 3)) ** 2 + (0.5 * (j - 4)) ** 2 + (i - 5) ** 2)
    # Single precision.
    assert away_from(mask, np.array([2.0, 0.5, 1.0])) == pytest.approx(expected, abs=1e-4)
    assert np.isinf(away_from(np.zeros((3, 3, 3), bool), np.ones(3))).all()
