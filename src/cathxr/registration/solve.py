"""`register`: from pairs of landmarks to a registration, with every figure that says how good it is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cathxr.core import FloatArray, Pose, RegistrationError
from cathxr.registration.chances import chi_square_beyond
from cathxr.registration.degeneracy import check_configuration, check_handedness
from cathxr.registration.doubts import Doubt, best_swap, find_doubts, swap_doubt
from cathxr.registration.errors import condition_number, held_out_fits, held_out_mm, predicted_tre_mm
from cathxr.registration.fit import Fit, Points, fitted
from cathxr.registration.model import Kind, LandmarkPair, Registration, nearest_similarity

_CHANCE = 0.01
_DIGITS = 4


@dataclass(frozen=True, eq=False)
class Solution:
    """A registration and what is known of its errors.

    covariance (p, p): of the parameters (see `jacobian`); None where neither the landmarks' errors were stated nor
    enough landmarks are there to estimate them. spare: degrees of freedom that the fit leaves. condition: see
    `condition_number`. stretch (3,): how much longer each principal axis of the box is in `ct`, greatest first.
    doubts: what is odd, in sentences.
    """

    registration: Registration
    covariance: FloatArray | None
    spare: int
    condition: float
    stretch: FloatArray
    doubts: tuple[Doubt, ...]

    @property
    def is_grave(self) -> bool:
        """Whether a doubt says that this should not be used as it is."""
        return any(each.grave for each in self.doubts)

    def predicted_tre_mm(self, points_box: FloatArray) -> FloatArray | None:
        """Return the expected error (N,), mm, at points (N, 3) of `box`; None where it cannot be known."""
        if self.covariance is None:
            return None
        found = self.registration
        return predicted_tre_mm(
            points_box, linear=found.linear_ct_from_box, covariance=self.covariance, kind=found.kind
        )


def register(
    pairs: Sequence[LandmarkPair],
    kind: Kind = Kind.RIGID,
    *,
    method: str = "landmarks",
    date: str | None = None,
    fle_mm: float | None = None,
    heart_ct: FloatArray | None = None,
) -> Solution:
    """Return the registration of a kind that fits pairs of landmarks, with its errors.

    fle_mm: how well a landmark is known (3D root mean square, both frames together), for those pairs that do not state
    it for both frames; None: estimated from the fit. heart_ct (M, 3) mm in `ct`: the heart's surface, over which the
    greatest predicted error is sought.

    Raises:
        RegistrationError: the landmarks cannot give one (too few, alike, in line, in one plane, mirrored, wrong unit).
        ValueError: a kind that is not fitted, or an error that is not positive.
    """
    if kind is Kind.PLACEMENT:
        raise ValueError("kind: expected rigid, similarity or affine; a placement is not fitted")
    if fle_mm is not None and not (np.isfinite(fle_mm) and fle_mm > 0):
        raise ValueError(f"fle_mm: expected a positive number, got {fle_mm}")
    check_configuration(pairs, kind)
    points = points_of(pairs, fle_mm)
    swap = best_swap(points, kind)
    told = "" if swap is None else swap_doubt(pairs, swap).sentence
    check_handedness(points, kind, swap_mm=None if swap is None else swap.with_swap_mm, swap_sentence=told)
    fit = fitted(points, kind)
    if np.linalg.det(fit.linear) <= 0.0:
        raise RegistrationError("The landmarks fit no map that keeps left and right; check their coordinates.")
    covariance = _covariance(points, fit)
    without = held_out_fits(points, kind)
    held_out = held_out_mm(points, without)
    registration = _registration(pairs, kind, fit, covariance, held_out)
    worst = None
    if heart_ct is not None and covariance is not None:
        found = predicted_tre_mm(registration.box(heart_ct), linear=fit.linear, covariance=covariance, kind=kind)
        worst = float(found.max())
    return Solution(
        registration=_completed(registration, worst, _fle_mm(points, fit), method, date),
        covariance=covariance,
        spare=fit.spare,
        condition=condition_number(points.box, kind),
        stretch=np.asarray(np.linalg.svd(fit.linear, compute_uv=False), dtype=np.float64),
        doubts=tuple(find_doubts(pairs, points, kind, fit=fit, without=without, swap=swap)),
    )


def points_of(pairs: Sequence[LandmarkPair], fle_mm: float | None) -> Points:
    """Return pairs as arrays. A pair that does not state both its errors has at least those of fle_mm, or open ones."""
    none = np.zeros(3)
    box_variances = np.stack([none if each.box_std_mm is None else np.square(each.box_std_mm) for each in pairs])
    ct_variances = np.stack([none if each.ct_std_mm is None else np.square(each.ct_std_mm) for each in pairs])
    partial = np.array([each.box_std_mm is None or each.ct_std_mm is None for each in pairs])
    if fle_mm is not None:
        missing = np.maximum(fle_mm**2 / 3.0 - box_variances - ct_variances, 0.0)
        ct_variances = ct_variances + partial[:, None] * missing
        partial = np.zeros(len(pairs), dtype=bool)
    return Points(
        box=np.stack([each.box_mm for each in pairs]),
        ct=np.stack([each.ct_mm for each in pairs]),
        box_variances=box_variances,
        ct_variances=ct_variances,
        open=partial.astype(np.float64),
    )


def _covariance(points: Points, fit: Fit) -> FloatArray | None:
    """Return the parameters' covariance; where stated errors are too small for the residuals, raised to match them."""
    if points.open.any() and fit.spare < 1:
        return None
    covariance = np.linalg.inv(fit.information)
    if not points.open.any() and fit.spare >= 1 and chi_square_beyond(fit.spare, fit.misfit) < _CHANCE:
        covariance = covariance * (fit.misfit / fit.spare)
    return np.asarray(0.5 * (covariance + covariance.T))


def _fle_mm(points: Points, fit: Fit) -> float | None:
    """Return the landmarks' localisation error in `ct`, 3D root mean square; None where it is not known."""
    if points.open.any() and fit.spare < 1:
        return None
    turned = np.einsum("ij,nj,ij->ni", fit.linear, points.box_variances, fit.linear)
    variances = turned + points.ct_variances + (fit.open_variance or 0.0) * points.open[:, None]
    return float(np.sqrt(variances.sum(axis=1).mean()))


def _registration(
    pairs: Sequence[LandmarkPair],
    kind: Kind,
    fit: Fit,
    covariance: FloatArray | None,
    held_out: Sequence[float | None],
) -> Registration:
    scale, rotation = nearest_similarity(fit.linear)
    known = [each for each in held_out if each is not None]
    centre = np.stack([each.box_mm for each in pairs]).mean(axis=0)
    predicted = None
    if covariance is not None:
        predicted = float(predicted_tre_mm(centre[None], linear=fit.linear, covariance=covariance, kind=kind)[0])
    lengths = np.linalg.norm(fit.residuals, axis=1)
    return Registration(
        ct_from_box=Pose.from_matrix(rotation, fit.translation),
        kind=kind,
        method="",
        scale=1.0 if kind is Kind.RIGID else scale,
        fre_mm=_rounded(fit.fre_mm),
        tre_mm=_rounded(float(np.sqrt(np.mean(np.square(known))))) if known else None,
        predicted_tre_mm=_rounded(predicted),
        landmarks=tuple(
            LandmarkPair(
                each.name,
                each.box_mm,
                each.ct_mm,
                _rounded(float(length)),
                _rounded(out),
                each.box_std_mm,
                each.ct_std_mm,
            )
            for each, length, out in zip(pairs, lengths, held_out, strict=True)
        ),
        linear=fit.linear if kind is Kind.AFFINE else None,
        covariance=covariance,
    )


def _completed(
    registration: Registration, worst_mm: float | None, fle_mm: float | None, method: str, date: str | None
) -> Registration:
    return replace(registration, worst_tre_mm=_rounded(worst_mm), fle_mm=_rounded(fle_mm), method=method, date=date)


def _rounded(value: float | None) -> float | None:
    """Return an error as it is written: more digits would say nothing."""
    return None if value is None else round(value, _DIGITS)
