"""How far a segmentation is from the truth: volumes, and the distance between the two surfaces."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.segmentation.images import box_of
from cathxr.heart.volume import LabelVolume

CHAMBERS = ("left_ventricle", "right_ventricle", "left_atrium", "right_atrium")


@dataclass(frozen=True)
class Agreement:
    """Volumes mL; distance of the two surfaces: mean and 95th percentile, mm, both ways."""

    found_ml: float
    true_ml: float
    mean_mm: float
    p95_mm: float
    dice: float

    @property
    def volume_error(self) -> float:
        """Relative, positive where too much was found."""
        return self.found_ml / self.true_ml - 1.0


def agreement(found: LabelVolume, truth: LabelVolume, key: str) -> Agreement:
    """Return how one structure's voxels agree; the distance is between their outermost voxels' centres."""
    mine, wanted = found.mask(key), truth.mask(key)
    box = box_of(mine | wanted, 3)
    mine, wanted = mine[box], wanted[box]
    there, back = _between(mine, wanted, truth), _between(wanted, mine, truth)
    distances = np.concatenate([there, back])
    both = float(np.count_nonzero(mine & wanted))
    dice = 2.0 * both / float(np.count_nonzero(mine) + np.count_nonzero(wanted))
    return Agreement(
        found.volume_ml(key), truth.volume_ml(key), float(distances.mean()), float(np.quantile(distances, 0.95)), dice
    )


def _between(one: npt.NDArray[np.bool_], other: npt.NDArray[np.bool_], like: LabelVolume) -> npt.NDArray[np.float64]:
    """Return the distance mm of each of one surface's voxels (those with a neighbour outside) to the other surface."""
    rim = one & ~ndimage.binary_erosion(one)
    other_rim = other & ~ndimage.binary_erosion(other)
    return np.asarray(ndimage.distance_transform_edt(~other_rim, sampling=like.grid.spacing_mm[::-1])[rim])


def chambers(found: LabelVolume, truth: LabelVolume) -> dict[str, Agreement]:
    """Return the agreement of each of the four chambers."""
    return {key: agreement(found, truth, key) for key in CHAMBERS}


def table(rows: dict[str, Agreement], spacing_mm: float) -> str:
    """Return the rows of a Markdown table."""
    lines = [
        "| structure | true, mL | found, mL | error | mean distance, mm (voxels) | 95 %, mm (voxels) | Dice |",
        "|---|---|---|---|---|---|---|",
    ]
    for key, each in rows.items():
        distances = [f"{value:.2f} ({value / spacing_mm:.2f})" for value in (each.mean_mm, each.p95_mm)]
        lines.append(
            f"| {CATALOGUE[key].name} | {each.true_ml:.1f} | {each.found_ml:.1f} | "
            f"{100.0 * each.volume_error:+.1f} % | {' | '.join(distances)} | {each.dice:.3f} |"
        )
    return "\n".join(lines)
