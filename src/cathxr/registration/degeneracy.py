"""Landmarks that give no registration, refused with a sentence: too few, alike, in line, in one plane, mirrored."""

from collections.abc import Sequence

import numpy as np

from cathxr.core import FloatArray, RegistrationError
from cathxr.registration.fit import Points, closed_form
from cathxr.registration.model import Kind, LandmarkPair

_SAME_MM = 0.01
_LEAST_SPREAD_MM = 1.0
_LEAST_SHARE = 0.02
_METRES = (400.0, 2500.0)
_CENTIMETRES = (7.0, 14.0)
_MIRROR_FACTOR = 4.0
_LEAST_GAIN_MM = 1.0
_LEAST_DEPTH_MM = 4.0


def check_configuration(pairs: Sequence[LandmarkPair], kind: Kind) -> None:
    """Return when the landmarks can fix a registration of a kind.

    Raises:
        RegistrationError: they cannot; the sentence names those at fault and says what to do.
    """
    _check_count(pairs, kind)
    _check_names(pairs)
    box, ct = np.stack([each.box_mm for each in pairs]), np.stack([each.ct_mm for each in pairs])
    _check_units(box, ct)
    for frame, points in (("box", box), ("ct", ct)):
        _check_apart(pairs, frame, points)
    for frame, points in (("box", box), ("ct", ct)):
        _check_spread(pairs, frame, points, kind)


def check_handedness(points: Points, kind: Kind, *, swap_mm: float | None, swap_sentence: str) -> None:
    """Return when the landmarks do not fit far better in a mirror.

    swap_mm: the FRE with the likeliest exchange of landmarks, which swap_sentence tells; None: there is none.

    Raises:
        RegistrationError: they do: a registration never mirrors.
    """
    if kind is Kind.AFFINE:
        if np.linalg.det(closed_form(points.box, points.ct, Kind.AFFINE)[0]) > 0.0:
            return
        if swap_sentence:
            raise RegistrationError(f"The affine fit would mirror the heart. {swap_sentence}")
        told = "The affine fit would mirror the heart"
    else:
        depth = np.linalg.svd(points.box - points.box.mean(axis=0), compute_uv=False)[2] / np.sqrt(len(points))
        proper, mirror = (_fre_mm(points, kind, mirrored=each) for each in (False, True))
        if depth < _LEAST_DEPTH_MM or proper < _MIRROR_FACTOR * mirror or proper - mirror < _LEAST_GAIN_MM:
            return
        if swap_mm is not None and swap_mm < 1.5 * mirror + 0.5:
            return  # two landmarks changed about look like a mirror too, and are likelier
        told = (
            f"The landmarks fit a mirror image of the heart (FRE {mirror:.1f} mm) and not the heart itself "
            f"({proper:.1f} mm)"
        )
    raise RegistrationError(
        f"{told}: one axis of `box` or `ct` has the wrong sign (`ct` is LPS, +z of the box is up), or several "
        "landmarks are exchanged; correct the coordinates, a registration never mirrors."
    )


def size_ratio(box: FloatArray, ct: FloatArray) -> float:
    """Return how much larger the landmarks (N, 3) are spread in `ct` than in `box`; 1 where one has no spread."""
    spreads = [float(np.sqrt(np.square(each - each.mean(axis=0)).sum())) for each in (ct, box)]
    return spreads[0] / spreads[1] if min(spreads) > 0.0 else 1.0


def _fre_mm(points: Points, kind: Kind, *, mirrored: bool) -> float:
    linear, translation = closed_form(points.box, points.ct, kind, mirrored=mirrored)
    return float(np.sqrt(np.square(points.ct - points.box @ linear.T - translation).sum(axis=1).mean()))


def _check_count(pairs: Sequence[LandmarkPair], kind: Kind) -> None:
    if len(pairs) >= kind.fewest_pairs:
        return
    where = ", not all in one plane" if kind is Kind.AFFINE else ", not all on one line"
    if kind is Kind.AFFINE and len(pairs) == 3:
        where += " (three suffice for a rigid registration)"
    raise RegistrationError(
        f"{_counted(len(pairs))} landmarks: {kind.value} registration takes at least {kind.fewest_pairs}{where}; "
        "add more landmarks."
    )


def _check_names(pairs: Sequence[LandmarkPair]) -> None:
    names = [each.name for each in pairs]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise RegistrationError(f"The landmark {twice[0]!r} is given twice; give each its own name, once.")


def _check_apart(pairs: Sequence[LandmarkPair], frame: str, points: FloatArray) -> None:
    for first in range(len(points)):
        for second in range(first + 1, len(points)):
            if np.linalg.norm(points[first] - points[second]) < _SAME_MM:
                raise RegistrationError(
                    f"The landmarks {pairs[first].name} and {pairs[second].name} are at the same place in `{frame}`; "
                    "measure one of them again, or leave one out."
                )


def _check_units(box: FloatArray, ct: FloatArray) -> None:
    ratio = size_ratio(box, ct)
    for (low, high), unit, per in ((_METRES, "metres", 1000), (_CENTIMETRES, "centimetres", 10)):
        for each, frame in ((ratio, "box"), (1.0 / ratio, "ct")):
            if low <= each <= high:
                raise RegistrationError(
                    f"The landmarks are {each:.0f} times nearer to each other in `{frame}` than in the other frame, as "
                    f"if `{frame}` were in {unit}: give millimetres, {per} times as much."
                )


def _check_spread(pairs: Sequence[LandmarkPair], frame: str, points: FloatArray, kind: Kind) -> None:
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(len(points))
    names = ", ".join(each.name for each in pairs)
    if sizes[1] < max(_LEAST_SPREAD_MM, _LEAST_SHARE * sizes[0]):
        raise RegistrationError(
            f"The landmarks {names} lie on one line in `{frame}` (to {sizes[1]:.1f} mm), so that the rotation about it "
            "is unknown; add a landmark well beside it."
        )
    if kind is Kind.AFFINE and sizes[2] < max(_LEAST_SPREAD_MM, _LEAST_SHARE * sizes[0]):
        raise RegistrationError(
            f"The landmarks {names} lie in one plane in `{frame}` (to {sizes[2]:.1f} mm), and affine registration "
            "takes at least four that do not; add one off the plane, or use --kind rigid."
        )


def _counted(count: int) -> str:
    return {0: "No", 1: "Only one", 2: "Only two", 3: "Only three"}.get(count, str(count))
