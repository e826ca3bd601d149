"""The phantom that the segmentation's tests share, and what came of it."""

from dataclasses import dataclass

import pytest

from cathxr.heart.segmentation import Segmentation, segment
from cathxr.heart.volume import LabelVolume, Volume

from ...heart_support.phantoms import HeartLook, four_chambers


@dataclass(frozen=True, eq=False)
class Case:
    """A scan, what is in it, and what was found."""

    volume: Volume
    truth: LabelVolume
    found: Segmentation


@pytest.fixture(scope="session")
def phantom() -> Case:
    """Four chambers at 1.5 mm, oblique; the chest cut by the field of view."""
    volume, truth = four_chambers((110, 110, 110), (1.5, 1.5, 1.5), oblique_deg=(9.0, -6.0, 14.0), look=HeartLook())
    return Case(volume, truth, segment(volume))
