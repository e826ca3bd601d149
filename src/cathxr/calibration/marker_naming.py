"""From hypotheses to names one can trust: what stands alone, what fits better elsewhere, and chance are sorted out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cathxr.calibration.marker_search import Hypothesis, Scene, predicted, refitted
from cathxr.core import FloatArray

LEAST_MARKERS = 4
_RIVAL = 6.0
"""A hypothesis whose score (a log-likelihood) is this near to the best one's would do as well."""
_GATE = 16.0
_MOST_RMS_MM, _MOST_RMS_PX = 0.4, 0.6
_MOST_CHANCE = 0.01
_SIZE_CHANCE, _ALIKE = 0.35, 1.3
_MOST_RATIO = 1.7


@dataclass(frozen=True, eq=False)
class Naming:
    """named (M,): each marker's spot or -1. doubtful: indices of markers for which more than one spot would do.

    places (M, 2): where each marker should be, px, or inf; rms_px: of the named about there. why: why nothing is
    named, "" where something is. unsure: names that were too few or too much a matter of chance.
    """

    named: NDArray[np.int64]
    doubtful: tuple[int, ...]
    places: FloatArray
    depths: FloatArray
    hypothesis: Hypothesis | None
    rms_px: float = 0.0
    why: str = ""
    unsure: tuple[int, ...] = ()


def naming_of(scene: Scene, hypotheses: list[Hypothesis]) -> Naming:
    """Return the names of spots by ranked hypotheses."""
    nothing = np.full(len(scene.points), -1, dtype=np.int64)
    nowhere = np.full((len(scene.points), 2), np.inf)
    if not hypotheses:
        return Naming(nothing, (), nowhere, np.zeros(len(nothing)), None, why="none")
    best = hypotheses[0]
    named = _without_loners(scene, _that_stand(scene, best, best.named.copy()))
    doubtful = {m for m in np.flatnonzero(named >= 0).tolist() if _has_rival_spot(scene, best, named, m)}
    for other in hypotheses[1:]:
        if other.score < best.score - _RIVAL:
            break
        differs = (other.named != best.named) & (named >= 0)
        doubtful |= set(np.flatnonzero(differs & (other.named >= 0)).tolist())
        # A rival may also take a spot for another marker, or leave a marker out for want of its spot.
        taken = np.isin(best.named, other.named[(other.named >= 0) & (other.named != best.named)])
        doubtful |= set(np.flatnonzero(differs & taken).tolist())
    final, normal = refitted(scene, best, named)
    places, _, depths = predicted(scene, final, normal)
    use = named >= 0
    off = scene.pixels[named[use]] - places[use]
    rms = float(np.sqrt(np.mean(np.sum(off**2, axis=1)))) if use.any() else 0.0
    sure = named.copy()
    sure[list(doubtful)] = -1
    why = _why_not(scene, final, sure, rms)
    unsure = tuple(int(m) for m in np.flatnonzero(sure >= 0)) if why else ()
    return Naming(nothing if why else sure, tuple(sorted(doubtful)), places, depths, final, rms, why, unsure)


def _that_stand(scene: Scene, best: Hypothesis, named: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the names without those that do not lie where the others put them."""
    while (named >= 0).sum() > LEAST_MARKERS:
        worst, which = _GATE, -1
        for m in np.flatnonzero(named >= 0):
            far = _distance(scene, best, named, int(m))[named[m]]
            if far > worst:
                worst, which = far, int(m)
        if which < 0:
            break
        named[which] = -1
    return named


def _without_loners(scene: Scene, named: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the names without a single marker of a cross: one spot that happens to lie there proves no cross."""
    for cross in (scene.own, ~scene.own):
        if cross.sum() > 1 and (named[cross] >= 0).sum() == 1:
            named[cross] = -1
    return named


def _distance(scene: Scene, best: Hypothesis, named: NDArray[np.int64], marker: int) -> FloatArray:
    """Return the squared distance (B,), in sigmas, of each spot from where the other named markers put this one."""
    others = named.copy()
    others[marker] = -1
    pose, normal = refitted(scene, best, others)
    places, spreads, _ = predicted(scene, pose, normal)
    off = scene.pixels - places[marker]
    spread = spreads[marker][None] + np.eye(2) * scene.tolerances[:, None, None] ** 2
    return np.asarray(np.einsum("bi,bi->b", off, np.linalg.solve(spread, off[..., None])[..., 0]))


def _has_rival_spot(scene: Scene, best: Hypothesis, named: NDArray[np.int64], marker: int) -> bool:
    """Return whether another spot of that colour and size lies about as well where the marker should be."""
    if (named >= 0).sum() <= LEAST_MARKERS - 1:
        return False
    far = _distance(scene, best, named, marker)
    own = named[marker]
    ratio = scene.radii / scene.radii[own]
    rival = (far < _GATE) & (far < far[own] + _RIVAL) & np.isfinite(scene.fits[marker])
    rival &= (ratio < _MOST_RATIO) & (ratio > 1.0 / _MOST_RATIO)
    rival[own] = False
    return bool(rival.any())


def _why_not(scene: Scene, final: Hypothesis, named: NDArray[np.int64], rms_px: float) -> str:
    """Return why the names cannot be trusted: "few", "apart", "chance", or "" where they can."""
    use = np.flatnonzero(named >= 0)
    if len(use) < LEAST_MARKERS:
        return "few"
    if rms_px > _MOST_RMS_PX + _MOST_RMS_MM * scene.px_per_mm:
        return "apart"
    sizes = scene.radii[named[use]] * (scene.points[use] @ final.rotation[2] + final.translation[2])
    alike = sizes.max() < _ALIKE * sizes.min()
    width, height = scene.model.size_px
    # How many ways there were to pick spots, times the chance that, three of them placing the camera, the others fall
    # where they must by accident (spots crowd on a quarter of the picture).
    ways = float(np.prod([max(np.isfinite(scene.fits[m]).sum(), 1) for m in use]))
    area = np.pi * max(2.0 * rms_px, 1.0) ** 2
    chance = (
        ways * (4.0 * area / (width * height)) ** (len(use) - 3) * (_SIZE_CHANCE if alike else 1.0) ** (len(use) - 1)
    )
    return "chance" if chance > _MOST_CHANCE else ""
