"""The controls that bring the twin's catheter to a target: what a hand that knew the catheter exactly would do."""

import numpy as np
from scipy.optimize import least_squares

from cathxr.core import FloatArray
from cathxr.training.placing import PlacedTarget
from cathxr.twin import Controls
from cathxr.twin.kinematics import CatheterBody, centreline
from cathxr.twin.world import CONTROL_RANGES

_POINTS = 20
_LEAST_INSERTION_MM = 12.0
_GOOD_MM = 0.5


def controls_for(body: CatheterBody, target: PlacedTarget, start: FloatArray) -> FloatArray:
    """Return the controls (4,) that meet a target, within the twin's ranges and near to `start` (4,).

    Found by least squares from where the hand is now; where that ends beside the target, from other bends, the best of
    which is taken.
    """

    def miss(values: FloatArray) -> FloatArray:
        shape, pose = centreline(body, Controls(*values), points=_POINTS)
        offset, rotation = target.point_box - shape[0], pose.rotation
        if target.kind == "tip":
            return np.append(offset, 0.004 * (values - start))
        if target.kind == "beam":
            aside = offset - max(float(offset @ rotation[:, 0]), 0.0) * rotation[:, 0]
            return np.append(aside, 0.02 * (values - start))
        assert target.direction_box is not None
        assert target.up_box is not None
        turned = 30.0 * np.concatenate([rotation[:, 1] - target.direction_box, rotation[:, 0] - target.up_box])
        return np.concatenate([turned, [offset @ rotation[:, 1]], 0.02 * (values - start)])

    low, high = np.array(list(CONTROL_RANGES.values()), dtype=np.float64).T
    low[0] = _LEAST_INSERTION_MM
    first = np.array([max(30.0, float(np.linalg.norm(target.point_box))), 0.0, 30.0, 30.0])
    guesses = [start] + [first * [1.0, 1.0, one, other] for one in (1.0, -1.0) for other in (1.0, -1.0)]
    best: tuple[float, FloatArray] | None = None
    for guess in guesses:
        found = least_squares(miss, np.clip(guess, low + 1e-6, high - 1e-6), bounds=(low, high), xtol=1e-4, ftol=1e-6)
        if best is None or found.cost < best[0]:
            best = float(found.cost), np.asarray(found.x, dtype=np.float64)
        off = np.asarray(found.fun)[:-4]
        if float(np.linalg.norm(off)) < _GOOD_MM:
            break
    assert best is not None
    return best[1]
