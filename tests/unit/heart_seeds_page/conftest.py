"""A small volume with labels, and a segmentation that does what a test says."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from cathxr.heart.seeds import Seed
from cathxr.heart.volume import Grid, LabelVolume, Progress, Technical, Volume
from cathxr.runtime.heart_seeds import SeedSession

SHAPE = (8, 10, 12)


@dataclass
class Segmented:
    """What a segmentation gives."""

    labels: LabelVolume
    findings: tuple[str, ...] = ()


class Segmentation:
    """Labels left and right halves as ventricles; a seed of the aorta makes a corner of it aorta."""

    def __init__(self) -> None:
        self.given: list[tuple[Seed, ...]] = []
        self.error: Exception | None = None
        self.hold: threading.Event | None = None
        self.begun = threading.Event()

    def __call__(self, seeds: Sequence[Seed], progress: Progress) -> Segmented:
        self.given.append(tuple(seeds))
        self.begun.set()
        while self.hold is not None and not self.hold.wait(0.01):
            progress("Separating", 0.25)
        progress("Separating", 0.5)
        if self.error is not None:
            raise self.error
        return Segmented(labels_of(aorta=any(seed.structure == "aorta" for seed in seeds)), ("No veins were found.",))


def seed(structure: str, position_mm: tuple[float, float, float], *, radius_mm: float | None = None) -> Seed:
    """Return a seed."""
    return Seed(structure, position_mm, radius_mm)


def grid() -> Grid:
    """Return voxels of 1 x 1 x 2 mm, from the feet up."""
    matrix = np.diag([1.0, 1.0, 2.0, 1.0])
    matrix[:3, 3] = (-5.0, -20.0, 100.0)
    return Grid(SHAPE, matrix)


def labels_of(*, aorta: bool = False) -> LabelVolume:
    """Return the right half as the right ventricle under value 7, the left as the left one under value 9."""
    labels = np.full(SHAPE, 7, np.uint8)
    labels[:, :, 6:] = 9
    names = {7: "right_ventricle", 9: "left_ventricle"}
    if aorta:
        labels[0, :2, :3] = 2
        names[2] = "aorta"
    return LabelVolume(labels, grid(), names)


@pytest.fixture
def volume() -> Volume:
    """Hounsfield units that tell where each voxel is: 100 k + 10 j + i - 1000."""
    k, j, i = np.indices(SHAPE)
    return Volume((100 * k + 10 * j + i - 1000).astype(np.int16), grid(), Technical("CT"))


@pytest.fixture
def segmentation() -> Segmentation:
    return Segmentation()


@pytest.fixture
def make_session(volume: Volume, segmentation: Segmentation) -> Callable[..., SeedSession]:
    """A function that gives a session whose saved seeds are in its `written`."""

    def make(**options: Any) -> SeedSession:
        written: list[tuple[Seed, ...]] = []
        usual: dict[str, Any] = {"segmenter": segmentation, "save": written.append, "key": "k"}
        session = SeedSession(volume, **(usual | options))
        session.written = written  # type: ignore[attr-defined]
        return session

    return make
