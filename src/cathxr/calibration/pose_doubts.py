"""Fiducials that lie where the others say they cannot: named, left out where enough remain, else refused."""

from dataclasses import dataclass

import numpy as np

from cathxr.calibration.pose_fit import PRIOR_FREEDOM, gain_of, pose_of
from cathxr.calibration.pose_view import FEWEST, Linear, PoseView
from cathxr.core import CalibrationError, FloatArray, Pose

FEWEST_TO_DROP = 6
"""With six or more, what is left still tells by itself whether it fits; with five there is nothing left to check by."""
_IMPLAUSIBLE = 30.0
"""Chi-square of two degrees of freedom that chance exceeds three times in ten million."""
_NEAR_SIGMAS = 6.0
_MEDIAN_2 = 2.0 * np.log(2.0)
"""Median of chi-square with two degrees of freedom."""
_ROUNDS = 6
_HOPELESS_FOUR = 10.0
"""Root of chi-square per degree of freedom above which four fiducials do not belong together: no noise does that."""


@dataclass(frozen=True)
class Outlier:
    """A fiducial left out: it lies `distance_px` from where the others say."""

    name: str
    distance_px: float


def without_outliers(view: PoseView, start: Pose) -> tuple[PoseView, Pose, tuple[Outlier, ...]]:
    """Return the view without implausible fiducials, its pose, and what was left out.

    start: a pose that most fiducials agree with.

    Raises:
        CalibrationError: fiducials contradict each other and too few would be left to tell which is right.
    """
    if len(view.names) == FEWEST:
        pose = pose_of(view, start)
        _check_four(view, pose)
        return view, pose, ()
    good = _near(view, start)
    pose = pose_of(view.of(good), start)
    seen: set[frozenset[str]] = set()
    for _ in range(_ROUNDS):
        better = _revised(view, good, pose)
        if better == good or frozenset(better) in seen:
            break
        seen.add(frozenset(good))
        good = better
        pose = pose_of(view.of(good), pose)
    out = tuple(Outlier(name, _distance(view, name, pose)) for name in view.names if name not in good)
    if out and (len(view.names) < FEWEST_TO_DROP or len(good) < FEWEST_TO_DROP - 1):
        raise CalibrationError(_refusal(view, out))
    return view.of(good), pose, out


def sentence(camera: str, outlier: Outlier) -> str:
    """Return what is wrong with a fiducial, for a person."""
    return (
        f"{outlier.name} lies {outlier.distance_px:.1f} px from where the others say in the {camera} picture: a wrong "
        "spot was taken for it, or the cross is not seated"
    )


def _near(view: PoseView, pose: Pose) -> set[str]:
    """Return the fiducials that a robust pose explains, by the spread of most of them; at least four."""
    square = np.square(view.residual_px(pose) / view.sigma_px[:, None]).sum(axis=1)
    spread = max(1.0, float(np.median(square)) / _MEDIAN_2)
    order = np.argsort(square)
    count = max(FEWEST, int((square <= _NEAR_SIGMAS**2 * spread).sum()))
    return {view.names[i] for i in order[:count]}


def _revised(view: PoseView, good: set[str], pose: Pose) -> set[str]:
    """Return the fiducials that agree with those in `good`: others taken in again, the worst one of them taken out."""
    result = set(good)
    for name in view.names:
        if name not in good and _surprise(view, name, good, pose) <= _IMPLAUSIBLE:
            result.add(name)
    if result != good or len(good) <= FEWEST:
        return result
    surprises = {name: _surprise(view, name, good - {name}, pose) for name in view.names if name in good}
    worst = max(surprises, key=surprises.__getitem__)
    return good - {worst} if surprises[worst] > _IMPLAUSIBLE else good


def _surprise(view: PoseView, name: str, others: set[str], pose: Pose) -> float:
    """Return the chi-square (2) of a fiducial's distance from where `others` say it is, in units of their spread.

    pose: near the one that `others` alone would give, so that one linear step leads there.
    """
    both = view.of(others | {name})
    linear, rest = Linear.of(both, pose), Linear.of(view.of(others), pose)
    at = 2 * both.names.index(name)
    mine, theirs = np.array([at, at + 1]), np.delete(np.arange(2 * len(both.names)), [at, at + 1])
    gain, stated = gain_of(view.of(others), rest)
    _, covariance = gain_of(both, linear)
    # How far the prediction is off, as a combination of all pixels: mine minus what the others' pose makes of it.
    combination = np.zeros((2, len(covariance)))
    combination[:, mine] = np.eye(2)
    combination[:, theirs] = -linear.by_pose[mine] @ gain
    spread = combination @ covariance @ combination.T
    distance = combination @ linear.residual
    square, freedom = _chi_square(rest, stated)
    # The spread of the others, at least as stated and steadied by it.
    inflation = max(1.0, (PRIOR_FREEDOM + square) / (PRIOR_FREEDOM + freedom))
    return float(distance @ np.linalg.solve(spread, distance)) / inflation


def _chi_square(linear: Linear, covariance: FloatArray) -> tuple[float, int]:
    contrast = np.linalg.svd(linear.by_pose)[0][:, 6:]
    rest = contrast.T @ linear.residual
    return float(rest @ np.linalg.solve(contrast.T @ covariance @ contrast, rest)), len(rest)


def _distance(view: PoseView, name: str, pose: Pose) -> float:
    one = view.of({name})
    return float(np.linalg.norm(one.residual_px(pose)))


def _check_four(view: PoseView, pose: Pose) -> None:
    """Return when four fiducials can belong together.

    Raises:
        CalibrationError: they cannot; which of them is wrong, four cannot tell.
    """
    linear = Linear.of(view, pose)
    _, covariance = gain_of(view, linear)
    square, freedom = _chi_square(linear, covariance)
    if square > freedom * _HOPELESS_FOUR**2:
        rms = float(np.sqrt(2.0 * np.square(linear.residual).mean()))
        expected = float(np.sqrt(2.0 * np.mean(linear.pixel_variance)))
        raise CalibrationError(
            f"The four fiducials of the {view.camera.name} camera ({', '.join(view.names)}) do not fit together "
            f"({rms:.1f} px left, {expected:.2f} px expected), and four cannot tell which is wrong: "
            "check that none was taken for another and that the cross is seated, or let the camera see "
            "both crosses."
        )


def _refusal(view: PoseView, out: tuple[Outlier, ...]) -> str:
    named = "; ".join(sentence(view.camera.name, each) for each in out)
    left = len(view.names) - len(out)
    return (
        f"{named}. Without {'it' if len(out) == 1 else 'them'} {left} fiducials are left, too few to be sure of: "
        "seat the crosses, clear what covers them, and take the picture again."
    )
