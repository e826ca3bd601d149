"""What many pairs say about the cameras' poses: a linear Gaussian problem with the rig's own covariance as its prior.

Pairs that show the same place in the box repeat the same systematic error of the detection, so that each cell of the
box counts once; the cells' scatter about the fit, and what neighbours share of it, scale the errors.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from cathxr.calibration.epipolar import CAMERAS, PARAMETERS, Geometry, Pairs, delay_slope, derivative, gap_noise
from cathxr.core import FloatArray, Rig
from cathxr.geometry.calibration_error import camera_errors

CELL_MM = 8.0
FLOOR_MM = 0.015
"""What the detection leaves in a place however many pairs show it (0.06 px): shading and reflections of the tube."""
PLAY_MM = 0.15
"""How far the catheter may lie from the middle of the inlet: the bore is about a third of a millimetre wider."""
DELAY_S = 0.005
"""Prior standard deviation of a delay between the cameras that nobody measured."""
KNOCK_RAD, KNOCK_MM = np.deg2rad(0.5), 1.0
"""How far a knocked camera may have turned and moved, about its own centre."""
HYPOTHESES = ("none", *CAMERAS, "both")
POSES = np.r_[0:6, 15:21]
_ROUNDS = 8
_HUBER = 2.5


@dataclass(frozen=True, eq=False)
class Cells:
    """M places of the box, each seen by `count` pairs of one session; residuals in mm.

    gap, sigma (M,); design (M, 30): of the gap by the parameters; delay (M,): by the front camera's offset, per s;
    tip_box (M, 3); session (M,); entry (2,) mean y, z of the entry and entry_design (2, 30).
    """

    gap: FloatArray
    sigma: FloatArray
    design: FloatArray
    delay: FloatArray
    tip_box: FloatArray
    session: np.ndarray[tuple[int], np.dtype[np.int64]]
    count: FloatArray
    entry: FloatArray
    entry_design: FloatArray


def cells_of(rig: Rig, pairs: Pairs, *, parameters: FloatArray | None = None) -> Cells:
    """Return the places that the pairs show, at `parameters` (30,) away from the rig (0 unless given)."""
    at = np.zeros(PARAMETERS) if parameters is None else parameters
    geometry = Geometry(rig)
    voxel = np.floor(pairs.tip_box / CELL_MM).astype(np.int64)
    _, cell = np.unique(np.column_stack([pairs.session, voxel]), axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    count = np.bincount(cell).astype(np.float64)

    def mean(values: FloatArray) -> FloatArray:
        total = np.zeros((len(count), *values.shape[1:]))
        np.add.at(total, cell, values)
        return total / count.reshape(-1, *([1] * (values.ndim - 1)))

    noise = np.sqrt(mean(np.square(gap_noise(rig, pairs))) / count)
    return Cells(
        gap=mean(geometry.gaps(at, pairs)),
        sigma=np.hypot(noise, FLOOR_MM),
        design=mean(derivative(lambda each: geometry.gaps(each, pairs), at)),
        delay=mean(delay_slope(rig, pairs)),
        tip_box=mean(pairs.tip_box),
        session=np.asarray(np.round(mean(pairs.session.astype(np.float64))), dtype=np.int64),
        count=count,
        entry=geometry.entries(at, pairs).mean(axis=0),
        entry_design=derivative(lambda each: geometry.entries(each, pairs), at).mean(axis=0),
    )


def prior_covariance(rig: Rig, *, knocked: str = "none") -> FloatArray:
    """Return the parameters' covariance (30, 30): as the rig states it, and wider for cameras that were knocked."""
    errors = camera_errors(rig)
    result = np.zeros((PARAMETERS, PARAMETERS))
    for index, name in enumerate(CAMERAS):
        at = slice(15 * index, 15 * index + 15)
        result[at, at] = errors[name].covariance
        if knocked in (name, "both"):
            pose = slice(15 * index, 15 * index + 6)
            result[pose, pose] += _knock(rig, name)
    return result


def _knock(rig: Rig, name: str) -> FloatArray:
    """Return the covariance (6, 6) of a knock: a turn about the camera's own centre, and a shift."""
    x, y, z = rig.cameras[name].camera_from_box.translation_mm
    lever = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    carried = np.block([[np.eye(3), np.zeros((3, 3))], [lever, np.eye(3)]])
    return np.asarray(carried @ np.diag([KNOCK_RAD**2] * 3 + [KNOCK_MM**2] * 3) @ carried.T, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class System:
    """Measurements (R,) with design (R, 31: parameters, delay) and noise (R,): cells first, then the entry's y and z.

    At the true change x of the parameters: value + design @ x is noise.
    """

    value: FloatArray
    design: FloatArray
    noise: FloatArray

    def prior(self, covariance: FloatArray) -> FloatArray:
        """Return the prior (31, 31) with the delay's."""
        result = np.zeros((PARAMETERS + 1, PARAMETERS + 1))
        result[:-1, :-1], result[-1, -1] = covariance, DELAY_S**2
        return result

    def log_evidence(self, covariance: FloatArray) -> float:
        """Return the logarithm of the measurements' probability density under a prior (30, 30)."""
        spread = self.design @ self.prior(covariance) @ self.design.T + np.diag(np.square(self.noise))
        _, size = np.linalg.slogdet(spread)
        return -0.5 * float(size + self.value @ np.linalg.solve(spread, self.value))

    def update(self, covariance: FloatArray, *, given_lenses: bool = True) -> tuple[FloatArray, FloatArray]:
        """Return (change (31,), covariance (31, 31)) after the measurements.

        given_lenses: the lenses stay as they are, and the poses take up what their error does here, as they did when
        they were calibrated with them; the covariance says what error pose and lens then have together.
        """
        prior = self.prior(covariance)
        gain_prior = prior.copy()
        if given_lenses:
            gain_prior = _given_lenses(prior)
        noise = np.diag(np.square(self.noise))
        spread = self.design @ gain_prior @ self.design.T + noise
        gain = np.linalg.solve(spread, self.design @ gain_prior).T
        kept = np.eye(len(prior)) - gain @ self.design
        return -gain @ self.value, np.asarray(kept @ prior @ kept.T + gain @ noise @ gain.T, dtype=np.float64)


def _given_lenses(prior: FloatArray) -> FloatArray:
    """Return the prior (31, 31) of poses and delay for lenses as they are: zero in the lenses' rows and columns."""
    lenses = np.r_[6:15, 21:30]
    cross = prior[:, lenses]
    result = prior - cross @ np.linalg.pinv(prior[np.ix_(lenses, lenses)], hermitian=True) @ cross.T
    result[lenses, :] = 0.0
    result[:, lenses] = 0.0
    return np.asarray(0.5 * (result + result.T), dtype=np.float64)


def system_of(rig: Rig, cells: Cells) -> System:
    """Return the measurements with errors that the scatter of the cells about the best fit bears out.

    Robust: a cell that the widest hypothesis leaves far off counts less (Huber). Neighbours that share their error
    count as fewer.
    """
    value = np.concatenate([cells.gap, cells.entry])
    delays = np.concatenate([cells.delay, np.zeros(2)])
    design = np.column_stack([np.vstack([cells.design, cells.entry_design]), delays])
    base = np.concatenate([cells.sigma, np.full(2, PLAY_MM)])
    weight = np.ones(len(value))
    scale = 1.0
    wide = prior_covariance(rig, knocked="both")
    count = len(cells.gap)
    for _ in range(_ROUNDS):
        noise = base * np.concatenate([np.full(count, scale), np.ones(2)]) / np.sqrt(weight)
        change, _ = System(value, design, noise).update(wide, given_lenses=False)
        left = (value + design @ change)[:count] / cells.sigma
        spent = min(7.0, 0.5 * count)  # what a fit of 5 observable pose numbers, delay and offset takes up
        scale = max(1.0, 1.4826 * float(np.median(np.abs(left))) * np.sqrt(count / max(1.0, count - spent)))
        weight[:count] = np.minimum(1.0, _HUBER / np.maximum(np.abs(left) / scale, 1e-9))
    shared = np.sqrt(_shared(cells, left))
    noise = base * np.concatenate([np.full(count, scale * shared), np.ones(2)]) / np.sqrt(weight)
    return System(value, design, noise)


def _shared(cells: Cells, left: FloatArray) -> float:
    """Return by how much the variance of a mean grows because neighbouring cells share their error: at least 1."""
    apart = np.linalg.norm(cells.tip_box[:, None] - cells.tip_box[None], axis=-1)
    near = (apart < 1.6 * CELL_MM) & ~np.eye(len(left), dtype=bool)
    if not near.any():
        return 1.0
    clipped = np.clip(left, -4.0, 4.0)
    correlation = float((np.outer(clipped, clipped)[near]).mean() / max(float(np.mean(np.square(clipped))), 1e-12))
    return 1.0 + max(0.0, correlation) * float(near.sum(axis=1).mean())


@dataclass(frozen=True, eq=False)
class Judgement:
    """What the pairs say of the rig. p_value: how likely so much disagreement is with the errors that the rig states.

    probability: of each hypothesis about which camera was knocked; change (31,), covariance (31, 31): of parameters
    and delay, over the hypotheses.
    """

    p_value: float
    probability: dict[str, float]
    change: FloatArray
    covariance: FloatArray

    @property
    def delay_s(self) -> tuple[float, float]:
        """The front camera's clock minus the top's as the pairs show it, and its standard deviation, s."""
        return float(self.change[-1]), float(np.sqrt(self.covariance[-1, -1]))


def judged(rig: Rig, system: System) -> Judgement:
    """Return what the measurements say of the rig's poses."""
    logs = np.array([system.log_evidence(prior_covariance(rig, knocked=each)) for each in HYPOTHESES])
    share = np.exp(logs - logs.max())
    share /= share.sum()
    updates = [system.update(prior_covariance(rig, knocked=each)) for each in HYPOTHESES]
    change = sum((p * x for p, (x, _) in zip(share, updates, strict=True)), np.zeros(PARAMETERS + 1))
    covariance = np.zeros((PARAMETERS + 1, PARAMETERS + 1))
    for p, (each, spread) in zip(share, updates, strict=True):
        covariance += p * (spread + np.outer(each - change, each - change))
    p_value = _disagreement(system, prior_covariance(rig))
    return Judgement(p_value, dict(zip(HYPOTHESES, map(float, share), strict=True)), change, covariance)


def _disagreement(system: System, covariance: FloatArray) -> float:
    """Return the p-value of the measurements, in the directions that a change of pose could show itself in."""
    white = system.design / system.noise[:, None]
    wide = np.zeros(PARAMETERS + 1)
    wide[[0, 1, 2, 15, 16, 17]], wide[[3, 4, 5, 18, 19, 20]] = KNOCK_RAD, KNOCK_MM
    left, sizes, _ = np.linalg.svd(white * wide, full_matrices=False)
    directions = left[:, sizes > 1.0]
    if directions.shape[1] == 0:
        return 1.0
    seen = directions.T @ (system.value / system.noise)
    spread = directions.T @ white @ system.prior(covariance) @ white.T @ directions + np.eye(len(seen))
    return float(chi2.sf(seen @ np.linalg.solve(spread, seen), len(seen)))
