"""What of a segmentation cannot be believed, said in sentences, and labelled as not separated."""

import numpy as np
import numpy.typing as npt

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.volume import Grid


def judged(labels: npt.NDArray[np.uint8], grid: Grid, difference: float) -> tuple[npt.NDArray[np.uint8], tuple[str, ...]]:
    """Return the labels with what could not be separated taken together, and the sentences that say so."""
    return labels, ()
