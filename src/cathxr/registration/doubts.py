"""What is odd about landmarks that do give a registration: swapped or stray ones by name, other sizes, poor fits."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cathxr.core import FloatArray
from cathxr.registration.chances import chi_square_beyond, f_beyond
from cathxr.registration.degeneracy import size_ratio
from cathxr.registration.fit import Fit, Points, closed_form, jacobian
from cathxr.registration.model import Kind, LandmarkPair

_CHANCE = 0.01
"""How likely chance alone may be to raise a doubt."""
_LEAST_GAIN_MM = 1.0
_MOST_CYCLES = 9
_SCALES = (0.8, 1.25)
_POOR_FIT_MM = 5.0
_MOST_STRETCH = 1.25


@dataclass(frozen=True)
class Doubt:
    """One thing that is odd. grave: the result should not be used as it is. names: the landmarks at fault."""

    sentence: str
    grave: bool
    names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Swap:
    """Another assignment of the landmarks that fits far better. order: whose `ct` each one's `box` takes."""

    order: tuple[int, ...]
    fre_mm: float
    with_swap_mm: float


def best_swap(points: Points, kind: Kind) -> Swap | None:
    """Return the exchange of two or three landmarks that fits so much better that chance does not explain it."""
    count = len(points)
    kind = Kind.SIMILARITY if kind is Kind.AFFINE else kind  # an affinity bends to fit whatever it is given
    spare = 3 * count - kind.parameters
    orders = _exchanges(count)
    if not orders or spare < 1:
        return None
    now = _squares(points.box, points.ct, kind)
    squares = [_squares(points.box, points.ct[list(order)], kind) for order in orders]
    best = int(np.argmin(squares))
    fre, swapped = (float(np.sqrt(each / count)) for each in (now, squares[best]))
    chance = f_beyond(spare, spare, now / max(squares[best], 1e-12)) * len(orders)
    if chance > _CHANCE or fre - swapped < _LEAST_GAIN_MM:
        return None
    return Swap(orders[best], fre, swapped)


def find_doubts(
    pairs: Sequence[LandmarkPair],
    points: Points,
    kind: Kind,
    *,
    fit: Fit,
    without: Sequence[Fit | None],
    swap: Swap | None,
) -> list[Doubt]:
    """Return what is odd, the gravest first. without: for each landmark the fit to all the others."""
    doubts = []
    if swap is not None:
        doubts.append(swap_doubt(pairs, swap))
    else:
        stray = _stray(pairs, points, kind, fit=fit, without=without)
        if stray is not None:
            doubts.append(stray)
        elif fit.fre_mm > _POOR_FIT_MM:
            doubts.append(
                Doubt(
                    f"The landmarks fit poorly (FRE {fit.fre_mm:.1f} mm), and none of them alone is at fault: check "
                    "that all belong to this heart and were measured in this box.",
                    grave=False,
                )
            )
    doubts += _size_doubts(points, kind, fit)
    doubts += _stated_doubts(points, fit)
    return doubts


def _exchanges(count: int) -> list[tuple[int, ...]]:
    """Return the orders in which two landmarks, or three in a ring, are exchanged."""
    found = []
    for first, second in combinations(range(count), 2):
        order = list(range(count))
        order[first], order[second] = second, first
        found.append(tuple(order))
    if count > _MOST_CYCLES:
        return found
    for ring in combinations(range(count), 3):
        for to in ((ring[1], ring[2], ring[0]), (ring[2], ring[0], ring[1])):
            order = list(range(count))
            for place, taken in zip(ring, to, strict=True):
                order[place] = taken
            found.append(tuple(order))
    return found


def _squares(box: FloatArray, ct: FloatArray, kind: Kind) -> float:
    linear, translation = closed_form(box, ct, kind)
    return float(np.square(ct - box @ linear.T - translation).sum())


def swap_doubt(pairs: Sequence[LandmarkPair], swap: Swap) -> Doubt:
    """Return the doubt that an exchange of landmarks raises."""
    moved = [index for index, taken in enumerate(swap.order) if index != taken]
    names = tuple(pairs[each].name for each in moved)
    told = f"from {swap.fre_mm:.1f} to {swap.with_swap_mm:.1f} mm"
    if len(names) == 2:
        return Doubt(f"{names[0]} and {names[1]} look swapped: swapping them brings the FRE {told}.", True, names)
    right = ", ".join(f"{pairs[each].name} is {pairs[swap.order[each]].name}" for each in moved)
    told = f"{', '.join(names)} look mixed up: if what was measured as {right}, the FRE goes {told}."
    return Doubt(told, True, names)


def _stray(
    pairs: Sequence[LandmarkPair], points: Points, kind: Kind, *, fit: Fit, without: Sequence[Fit | None]
) -> Doubt | None:
    """Return a doubt about the landmark that the others contradict most, None where chance may explain it."""
    chances: list[tuple[float, int, float, float]] = []
    for index, others in enumerate(without):
        if others is None or others.spare < 1:
            continue
        off = points.ct[index] - others.apply(points.box[index])
        chances.append((_chance(points, index, kind, others, off), index, float(np.linalg.norm(off)), others.fre_mm))
    if not chances:
        return None
    chance, index, off_mm, left_mm = min(chances)
    if chance * len(chances) > _CHANCE or off_mm < _LEAST_GAIN_MM:
        return None
    name = pairs[index].name
    return Doubt(
        f"{name} does not fit the others: it is {off_mm:.1f} mm from where they put it, and without it the FRE goes "
        f"from {fit.fre_mm:.1f} to {left_mm:.1f} mm; measure it again, or leave it out.",
        True,
        (name,),
    )


def _chance(points: Points, index: int, kind: Kind, without: Fit, off: FloatArray) -> float:
    """Return how likely a landmark is to lie this far (3,) from where the others put it."""
    move = jacobian(points.box[index][None], without.linear, kind)[0]
    own = without.linear @ np.diag(points.box_variances[index]) @ without.linear.T + np.diag(points.ct_variances[index])
    own = own + (without.open_variance or 0.0) * points.open[index] * np.eye(3)
    if not own.any():
        own = 1e-12 * np.eye(3)
    spread = own + move @ np.linalg.solve(without.information, move.T)
    distance = float(off @ np.linalg.solve(spread, off))
    if without.open_variance is None:
        return chi_square_beyond(3, distance / max(1.0, without.misfit / max(1, without.spare)))
    return f_beyond(3, without.spare, distance / 3.0)


def _size_doubts(points: Points, kind: Kind, fit: Fit) -> list[Doubt]:
    """Return doubts about the heart's size and shape against the box's."""
    ratio = size_ratio(points.box, points.ct) if kind is Kind.RIGID else float(np.cbrt(np.linalg.det(fit.linear)))
    doubts = []
    if not _SCALES[0] <= ratio <= _SCALES[1]:
        what = "The landmarks' distances in `ct` are" if kind is Kind.RIGID else "The scale is"
        doubts.append(
            Doubt(
                f"{what} {ratio:.2f} times those in the box, far from 1: check the units of both, and that the model "
                "in the box was made from this heart at this size.",
                grave=True,
            )
        )
    if kind is Kind.AFFINE:
        sizes = np.linalg.svd(fit.linear, compute_uv=False)
        if sizes[0] > _MOST_STRETCH * sizes[2]:
            doubts.append(
                Doubt(
                    f"The affine fit stretches the heart {sizes[0] / sizes[2]:.2f} times more along one axis than "
                    "along another: a rigid model does not do that, so use --kind rigid, or check the landmarks.",
                    grave=False,
                )
            )
    return doubts


def _stated_doubts(points: Points, fit: Fit) -> list[Doubt]:
    """Return a doubt where the errors that were stated do not explain the residuals."""
    if points.open.any() or fit.spare < 1 or chi_square_beyond(fit.spare, fit.misfit) > _CHANCE:
        return []
    factor = float(np.sqrt(fit.misfit / fit.spare))
    return [
        Doubt(
            f"The residuals are {factor:.1f} times as large as the stated errors let expect, and the predicted errors "
            "have been raised by as much: the landmarks are known less well than stated.",
            grave=False,
        )
    ]
