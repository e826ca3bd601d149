"""How far a segmentation is from the truth: volumes, and the distance between the two surfaces."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.segmentation.images import box_of
from cathxr.heart.volume import LabelVolume

BLOOD = [each.label for each in CATALOGUE.values() if each.label <= CATALOGUE["left_atrial_appendage"].label]
CHAMBERS = ("left_ventricle", "right_ventricle", "left_atrium", "right_atrium")


@dataclass(frozen=True)
class Agreement:
    """Volumes mL; distance of the two surfaces: mean and 95th percentile, mm, both ways.

    wall_mm: the mean where the surface is a wall, and not a cut through the blood at a valve's plane or a vein's mouth.
    """

    found_ml: float
    true_ml: float
    wall_mm: float
    mean_mm: float
    p95_mm: float
    dice: float

    @property
    def volume_error(self) -> float:
        """Relative, positive where too much was found."""
        return self.found_ml / self.true_ml - 1.0


def agreement(found: LabelVolume, truth: LabelVolume, key: str) -> Agreement:
    """Return how one structure's voxels agree; the distance is between their outermost voxels' centres."""
    box = box_of(found.mask(key) | truth.mask(key), 3)
    mine, wanted = found.mask(key)[box], truth.mask(key)[box]
    spacing = truth.grid.spacing_mm[::-1]
    sides = [
        _between(mine, wanted, _at_wall(found.labels[box]), spacing),
        _between(wanted, mine, _at_wall(truth.labels[box]), spacing),
    ]
    distances, at_wall = (np.concatenate(each) for each in zip(*sides, strict=True))
    both = float(np.count_nonzero(mine & wanted))
    return Agreement(
        found_ml=found.volume_ml(key),
        true_ml=truth.volume_ml(key),
        wall_mm=float(distances[at_wall].mean()),
        mean_mm=float(distances.mean()),
        p95_mm=float(np.quantile(distances, 0.95)),
        dice=2.0 * both / float(np.count_nonzero(mine) + np.count_nonzero(wanted)),
    )


def _at_wall(labels: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
    """Return which voxels have a face towards something that is no blood."""
    return np.asarray(ndimage.binary_dilation(~np.isin(labels, BLOOD)))


def _between(
    one: npt.NDArray[np.bool_],
    other: npt.NDArray[np.bool_],
    at_wall: npt.NDArray[np.bool_],
    spacing_mm: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return how far mm each voxel at one surface is from the other's, and whether it is at a wall."""
    rim = one & ~ndimage.binary_erosion(one)
    other_rim = other & ~ndimage.binary_erosion(other)
    distances = ndimage.distance_transform_edt(~other_rim, sampling=spacing_mm)
    return np.asarray(distances[rim]), np.asarray(at_wall[rim])


def chambers(found: LabelVolume, truth: LabelVolume) -> dict[str, Agreement]:
    """Return the agreement of each of the four chambers."""
    return {key: agreement(found, truth, key) for key in CHAMBERS}


def table(rows: dict[str, Agreement], spacing_mm: float) -> str:
    """Return the rows of a Markdown table."""
    lines = [
        "| structure | true, mL | found, mL | error | walls, mm (voxels) | with the mouths | 95 % | Dice |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for key, each in rows.items():
        distances = [f"{value:.2f} ({value / spacing_mm:.2f})" for value in (each.wall_mm, each.mean_mm, each.p95_mm)]
        lines.append(
            f"| {CATALOGUE[key].name} | {each.true_ml:.1f} | {each.found_ml:.1f} | "
            f"{100.0 * each.volume_error:+.1f} % | {' | '.join(distances)} | {each.dice:.3f} |"
        )
    return "\n".join(lines)
