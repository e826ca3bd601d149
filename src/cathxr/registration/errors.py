"""How far off a registered point is expected to be: predicted by propagation, measured by leaving landmarks out.

Fitzpatrick, West and Maurer, "Predicting error in rigid-body point-based registration", IEEE TMI 1998: their formula
for a rigid motion with equal, isotropic errors is `fitzpatrick_tre_mm`; `predicted_tre_mm` is the same propagation for
any kind and any errors, and equals it in that case.
"""

from collections.abc import Sequence

import numpy as np

from cathxr.core import FloatArray
from cathxr.registration.fit import Fit, Points, fitted, jacobian
from cathxr.registration.model import Kind

_LEAST_SPREAD = 1e-3
"""Landmarks whose spread is less than this share of the largest, along a direction that counts, fix nothing there."""


def predicted_tre_mm(points_box: FloatArray, *, linear: FloatArray, covariance: FloatArray, kind: Kind) -> FloatArray:
    """Return the expected target registration error (N,), mm, at points (N, 3) of `box`: 3D root mean square.

    linear (3, 3): of the registration; covariance (p, p): of its parameters, see `jacobian`.
    """
    moves = jacobian(np.asarray(points_box, dtype=np.float64), linear, kind)
    squares = np.einsum("nip,pq,niq->n", moves, covariance, moves)
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def fitzpatrick_tre_mm(landmarks: FloatArray, targets: FloatArray, *, fle_mm: float) -> FloatArray:
    """Return Fitzpatrick's expected TRE (M,), mm, at targets (M, 3) for rigid landmarks (N, 3) of one frame, mm.

    TRE2 = FLE2 / N (1 + 1/3 sum d2 / f2): d from the target, f (root mean square) from the landmarks to each principal
    axis. Raises ValueError for collinear landmarks.
    """
    centre = landmarks.mean(axis=0)
    _, sizes, axes = np.linalg.svd(landmarks - centre, full_matrices=False)
    squares = np.square(sizes) / len(landmarks)
    beside = squares.sum() - squares  # mean square distance of the landmarks to each axis
    if beside[0] < 1e-12 * squares.sum():
        raise ValueError("landmarks: expected some off the line through the others")
    along = np.square((targets - centre) @ axes.T)
    off = along.sum(axis=1, keepdims=True) - along
    return np.asarray(fle_mm * np.sqrt((1.0 + (off / beside).sum(axis=1) / 3.0) / len(landmarks)))


def held_out_fits(points: Points, kind: Kind) -> tuple[Fit | None, ...]:
    """Return for each landmark the fit to all the others; None where these do not fix one."""
    found: list[Fit | None] = []
    for index in range(len(points)):
        others = np.arange(len(points)) != index
        found.append(fitted(points.subset(others), kind) if fixes(points.box[others], kind) else None)
    return tuple(found)


def held_out_mm(points: Points, fits: Sequence[Fit | None]) -> list[float | None]:
    """Return for each landmark how far the fit to all the others puts it off, mm; None where there is none.

    It holds the landmark's own error too, so that its root mean square is an upper estimate of the TRE there.
    """
    return [
        None if fit is None else float(np.linalg.norm(ct - fit.apply(box)))
        for fit, box, ct in zip(fits, points.box, points.ct, strict=True)
    ]


def fixes(points: FloatArray, kind: Kind) -> bool:
    """Return whether points (N, 3) fix a fit: enough, and spread out in as many directions as it takes."""
    if len(points) < kind.fewest_pairs:
        return False
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    needed = 2 if kind is Kind.AFFINE else 1
    return bool(sizes[0] > 0.0 and sizes[needed] > _LEAST_SPREAD * sizes[0])


def condition_number(points: FloatArray, kind: Kind) -> float:
    """Return the landmarks' greatest spread over the least that counts: the third's for affine, else the second's."""
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    least = float(sizes[2 if kind is Kind.AFFINE else 1])
    return float(sizes[0]) / least if least > 0.0 else float("inf")
