"""The fits: closed forms for a start, then weighted least squares with errors in both frames.

Closed form: Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991.
Weighted: each pair's misfit has the covariance C + L B L' (B: of the point in `box`, C: of the point in `ct`), which is
taken anew from the newest L in each step of Gauss and Newton (generalised total least squares): Balachandran and
Fitzpatrick, "Iterative solution for rigid-body point-based registration with anisotropic weighting", SPIE 2009.
"""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.registration.model import Kind

_STEPS = 60
_SMALL = 1e-10
"""A step this small (rad, mm) no longer matters: nothing is measured to a hundred thousandth of a millimetre."""
_LEAST_VARIANCE = 1e-12


@dataclass(frozen=True, eq=False)
class Points:
    """Landmarks as arrays: box, ct (N, 3) mm; box_variances, ct_variances (N, 3) mm2 along each axis of its frame.

    open: (N,) which pairs have an error of unknown size besides, the same along every axis: it is estimated.
    """

    box: FloatArray
    ct: FloatArray
    box_variances: FloatArray
    ct_variances: FloatArray
    open: FloatArray

    def __len__(self) -> int:
        return len(self.box)

    def subset(self, index: FloatArray) -> "Points":
        """Return those of an index or mask."""
        return Points(
            self.box[index], self.ct[index], self.box_variances[index], self.ct_variances[index], self.open[index]
        )


@dataclass(frozen=True, eq=False)
class Fit:
    """point_ct = linear (3, 3) point_box + translation (3,) mm.

    residuals (N, 3) mm in `ct`, measured minus fitted. misfit: the sum of squared residuals over their variances;
    spare: degrees of freedom. information (p, p): inverse covariance of the parameters (see `jacobian`).
    open_variance: what was estimated of the unknown error, mm2 along each axis; None where nothing was open.
    """

    linear: FloatArray
    translation: FloatArray
    residuals: FloatArray
    misfit: float
    spare: int
    information: FloatArray
    open_variance: float | None = None

    def apply(self, points_box: FloatArray) -> FloatArray:
        """Return points (..., 3) of `box` in `ct`."""
        return np.asarray(points_box @ self.linear.T + self.translation)

    @property
    def fre_mm(self) -> float:
        """Root mean square length of the residuals."""
        return float(np.sqrt(np.square(self.residuals).sum(axis=1).mean()))


def closed_form(
    box: FloatArray, ct: FloatArray, kind: Kind, *, mirrored: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return (linear (3, 3), translation (3,)) that fits points (N, 3) best, all with the same weight.

    mirrored: of the maps that turn right-handed into left-handed; an affinity is taken as it comes.
    """
    centre_box, centre_ct = box.mean(axis=0), ct.mean(axis=0)
    source, goal = box - centre_box, ct - centre_ct
    if kind is Kind.AFFINE:
        linear = np.linalg.lstsq(source, goal, rcond=None)[0].T
        return linear, centre_ct - linear @ centre_box
    left, sizes, right = np.linalg.svd(goal.T @ source)
    handed = np.sign(np.linalg.det(left @ right)) or 1.0
    last = -handed if mirrored else handed
    rotation = left @ np.diag([1.0, 1.0, last]) @ right
    scale = 1.0
    if kind is Kind.SIMILARITY:
        scale = float(sizes @ np.array([1.0, 1.0, last]) / np.square(source).sum())
    return scale * rotation, centre_ct - scale * rotation @ centre_box


def fitted(points: Points, kind: Kind) -> Fit:
    """Return the fit of a kind to points, each weighted by how well it is known.

    What is open of the errors is estimated so that the misfit is what its degrees of freedom let expect (Paule and
    Mandel, "Consensus values and weighting factors", 1982); without degrees of freedom to spare it cannot be.
    """
    spare = 3 * len(points) - kind.parameters
    if not points.open.any():
        return _weighted(points, kind, 0.0)
    if spare <= 0:
        return _weighted(points, kind, 1.0)
    if not (points.box_variances.any() or points.ct_variances.any()):
        return _with_equal_weights(points, kind)
    return _weighted(points, kind, None)


def jacobian(points_box: FloatArray, linear: FloatArray, kind: Kind) -> FloatArray:
    """Return how points (N, 3) move in `ct` with the parameters, (N, 3, p).

    Rigid: rotation (rad) about the axes of `ct`, then translation (mm): L' = exp(rotation) L, t' = t + translation.
    Similarity: then the logarithm of the scale. Affine: the nine numbers of L, row by row, then the translation.
    """
    count = len(points_box)
    result = np.zeros((count, 3, kind.parameters))
    if kind is Kind.AFFINE:
        for row in range(3):
            result[:, row, 3 * row : 3 * row + 3] = points_box
        result[:, :, 9:] = np.eye(3)
        return result
    turned = points_box @ linear.T
    x, y, z = turned.T
    result[:, 0, 1], result[:, 0, 2] = z, -y
    result[:, 1, 0], result[:, 1, 2] = -z, x
    result[:, 2, 0], result[:, 2, 1] = y, -x
    result[:, :, 3:6] = np.eye(3)
    if kind is Kind.SIMILARITY:
        result[:, :, 6] = turned
    return result


def _weighted(points: Points, kind: Kind, open_variance: float | None) -> Fit:
    """Return the fit with a given open variance, mm2; None: with the one at which the misfit is as expected."""
    # About the centroids the parameters hardly depend on each other, and rounding stays small.
    centre_box, centre_ct = points.box.mean(axis=0), points.ct.mean(axis=0)
    box, ct = points.box - centre_box, points.ct - centre_ct
    linear, translation = closed_form(box, ct, kind)
    spare = 3 * len(points) - kind.parameters
    variance = _LEAST_VARIANCE if open_variance is None else open_variance
    for _ in range(_STEPS):
        weights = _weights(points, linear, variance)
        residuals = ct - box @ linear.T - translation
        weighted = np.einsum("nij,nj->ni", weights, residuals)
        moves = jacobian(box, linear, kind)
        information = np.einsum("nip,nij,njq->pq", moves, weights, moves)
        step = np.linalg.solve(information, np.einsum("nip,ni->p", moves, weighted))
        linear, translation = _moved(linear, translation, step, kind)
        more = 0.0
        if open_variance is None:
            # Newton's step: the misfit is convex and falls with the variance, so that it is approached from below
            excess = float((residuals * weighted).sum()) - spare
            slope = float((np.square(weighted) * points.open[:, None]).sum())
            before = variance
            variance = max(_LEAST_VARIANCE, variance + excess / max(slope, 1e-300))
            more = abs(variance - before) / max(variance, _LEAST_VARIANCE)
        if max(float(np.abs(step).max()), 1e-3 * more) < _SMALL:
            break
    weights = _weights(points, linear, variance)
    residuals = ct - box @ linear.T - translation
    moves = jacobian(points.box, linear, kind)
    return Fit(
        linear=linear,
        translation=translation + centre_ct - linear @ centre_box,
        residuals=residuals,
        misfit=float(np.einsum("ni,nij,nj->", residuals, weights, residuals)),
        spare=spare,
        information=np.einsum("nip,nij,njq->pq", moves, weights, moves),
        open_variance=variance if open_variance is None else None,
    )


def _with_equal_weights(points: Points, kind: Kind) -> Fit:
    """Return the fit in which nothing is known of the errors: the closed form, and the variance of its residuals."""
    linear, translation = closed_form(points.box, points.ct, kind)
    residuals = points.ct - points.box @ linear.T - translation
    spare = 3 * len(points) - kind.parameters
    squares = float(np.square(residuals).sum())
    variance = max(squares / spare, _LEAST_VARIANCE)
    moves = jacobian(points.box, linear, kind)
    information = np.einsum("nip,niq->pq", moves, moves) / variance
    return Fit(linear, translation, residuals, squares / variance, spare, information, variance)


def _weights(points: Points, linear: FloatArray, open_variance: float) -> FloatArray:
    """Return each pair's inverse covariance (N, 3, 3) in `ct`."""
    turned = np.einsum("ij,nj,kj->nik", linear, points.box_variances, linear)
    own = points.ct_variances + open_variance * points.open[:, None]
    return np.linalg.inv(turned + own[:, :, None] * np.eye(3))


def _moved(linear: FloatArray, translation: FloatArray, step: FloatArray, kind: Kind) -> tuple[FloatArray, FloatArray]:
    if kind is Kind.AFFINE:
        return linear + step[:9].reshape(3, 3), translation + step[9:]
    turned = rotation_of(step[:3]) @ linear
    if kind is Kind.SIMILARITY:
        turned = float(np.exp(step[6])) * turned
    return turned, translation + step[3:6]


def rotation_of(vector: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) by a vector (3,): its direction the axis, its length the angle, rad (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # below 1e-4 rad the series are exact to rounding, and the quotients would not be
    first, second = (1.0, 0.5) if angle < 1e-4 else (np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2)
    if angle < 1e-4:
        first = 1.0 - angle**2 / 6.0
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross, dtype=np.float64)
