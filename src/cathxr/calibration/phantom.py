"""The accuracy protocol: tip errors in the holes of a phantom, systematic and random, and how well visits repeat."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cathxr.calibration.phantom_dwells import Dwell, Visit, find_dwells, matched
from cathxr.core import CalibrationError, FloatArray, Status, Track
from cathxr.core.phantom import Phantom


@dataclass(frozen=True, eq=False)
class HoleVisit:
    """One visit. error (3,) mm: the mean tip minus the hole; aligned (3,): after the rigid alignment."""

    session: str
    hole: str
    region: str
    dwell: Dwell
    error: FloatArray
    aligned: FloatArray


@dataclass(frozen=True)
class ErrorRow:
    """Errors of one region's visits, mm: mean, 95th percentile, largest, and mean and largest after alignment."""

    region: str
    visits: int
    mean: float
    p95: float
    largest: float
    aligned_mean: float
    aligned_largest: float


@dataclass(frozen=True, eq=False)
class PhantomResult:
    """What the phantom shows.

    bias (3,): mean error vector; systematic_mm: rms over the holes of each hole's mean error; random_mm: rms of visits
    about their hole's mean (None without a hole visited twice); within_mm: rms of single Tracks about their visit's
    mean. All are lengths of 3D vectors. turned_deg, moved_mm: the rigid alignment of the phantom. stated_mm: median
    sigma of the Tracks. notes: skipped, repeated and foreign rests, by name.
    """

    phantom: Phantom
    visits: tuple[HoleVisit, ...]
    rows: tuple[ErrorRow, ...]
    bias: FloatArray
    systematic_mm: float
    random_mm: float | None
    within_mm: float
    turned_deg: float
    moved_mm: float
    stated_mm: float
    notes: tuple[str, ...]


def phantom_errors(phantom: Phantom, sessions: Sequence[tuple[str, Sequence[Track]]]) -> PhantomResult:
    """Return the errors of the tip in the phantom's holes, from one or more sessions (name, tracks).

    Raises:
        CalibrationError: the tip rested in fewer than three of the holes.
    """
    found: list[tuple[str, Dwell, int]] = []
    notes: list[str] = []
    for name, tracks in sessions:
        dwells = find_dwells(tracks)
        visits = matched(phantom, dwells)
        found += [(name, dwells[each.dwell], each.hole) for each in visits]
        notes += _notes(phantom, name, dwells, visits)
    seen = len({hole for _, _, hole in found})
    if seen < 3:
        raise CalibrationError(_too_few(phantom, seen, [each for _, tracks in sessions for each in tracks]))
    holes = np.array([hole for _, _, hole in found])
    tips = np.stack([dwell.mean_box for _, dwell, _ in found])
    places = phantom.positions_mm[holes]
    rotation, centre, shift = _aligned(places, tips, holes)
    errors = tips - places
    left = tips - ((places - centre) @ rotation.T + centre + shift)
    made = tuple(
        HoleVisit(name, phantom.holes[hole].name, phantom.holes[hole].region, dwell, errors[i], left[i])
        for i, (name, dwell, hole) in enumerate(found)
    )
    present = np.unique(holes)
    means = np.stack([errors[holes == each].mean(axis=0) for each in present])
    turn = float(np.rad2deg(np.arccos(np.clip(0.5 * (np.trace(rotation) - 1.0), -1.0, 1.0))))
    return PhantomResult(
        phantom=phantom,
        visits=made,
        rows=_rows(made),
        bias=means.mean(axis=0),
        systematic_mm=_rms(means),
        random_mm=_between(errors, holes),
        within_mm=float(np.sqrt(np.mean([np.square(dwell.std_mm).sum() for _, dwell, _ in found]))),
        turned_deg=turn,
        moved_mm=float(np.linalg.norm(shift)),
        stated_mm=float(np.median([dwell.sigma_mm for _, dwell, _ in found])),
        notes=tuple(notes),
    )


def _too_few(phantom: Phantom, seen: int, tracks: Sequence[Track]) -> str:
    """Return the sentence for fewer than three holes: most often the rig is not that of the box, or nobody waited."""
    lost = [each.reason for each in tracks if each.status is not Status.TRACKED]
    if len(lost) > 0.5 * len(tracks) and lost:
        most = Counter(lost).most_common(1)[0][0].rstrip(".")
        return (
            f"Only {len(tracks) - len(lost)} of {len(tracks)} Tracks are tracked ({most}): calibrate the rig for this "
            "box first, as one that is only drawn, or another's, does not do."
        )
    return (
        f"The tip rested in only {seen} holes of the phantom {phantom.name!r}, three are needed: leave it for two "
        "seconds in every hole, in order, and check that the phantom sits as its file says."
    )


def _rms(vectors: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(vectors).sum(axis=1))))


def _between(errors: FloatArray, holes: FloatArray) -> float | None:
    """Return the standard deviation (3D) of visits about their hole's mean, None without a hole visited twice."""
    squares, spare = 0.0, 0
    for each in np.unique(holes):
        own = errors[holes == each]
        squares += float(np.square(own - own.mean(axis=0)).sum())
        spare += len(own) - 1
    return float(np.sqrt(squares / spare)) if spare else None


def _aligned(places: FloatArray, tips: FloatArray, holes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (rotation (3, 3), centre (3,), shift (3,)) of the phantom that fits the tips best, each hole once.

    Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A 1976.
    """
    present = np.unique(holes)
    source = np.stack([places[holes == each].mean(axis=0) for each in present])
    target = np.stack([tips[holes == each].mean(axis=0) for each in present])
    centre, goal = source.mean(axis=0), target.mean(axis=0)
    left, _, right = np.linalg.svd((target - goal).T @ (source - centre))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(left @ flip @ right, dtype=np.float64), centre, goal - centre


def _rows(visits: Sequence[HoleVisit]) -> tuple[ErrorRow, ...]:
    """Return the row of all visits, then one for each region."""
    regions = list(dict.fromkeys(each.region for each in visits if each.region))
    rows = []
    for region in ("", *regions):
        own = [each for each in visits if not region or each.region == region]
        raw = np.array([np.linalg.norm(each.error) for each in own])
        aligned = np.array([np.linalg.norm(each.aligned) for each in own])
        rows.append(
            ErrorRow(
                region or "all", len(own), float(raw.mean()), float(np.quantile(raw, 0.95)), float(raw.max()),
                float(aligned.mean()), float(aligned.max()),
            )
        )  # fmt: skip
    return tuple(rows)


def _notes(phantom: Phantom, session: str, dwells: Sequence[Dwell], visits: Sequence[Visit]) -> list[str]:
    """Return one sentence for each departure from the protocol."""
    notes = []
    seen = {each.hole for each in visits}
    missed = [each.name for index, each in enumerate(phantom.holes) if index not in seen]
    if missed:
        holes = "hole" if len(missed) == 1 else "holes"
        notes.append(f"{session}: the tip never rested in {holes} {', '.join(missed)}.")
    for before, after in pairwise(visits):
        step = (after.hole - before.hole) % len(phantom.holes)
        now = f"at {dwells[after.dwell].start_s - dwells[0].start_s:.0f} s"
        if step == 0:
            notes.append(f"{session}: hole {phantom.holes[after.hole].name} was visited twice running ({now}).")
        elif step > 1 and not missed:
            notes.append(
                f"{session}: hole {phantom.holes[after.hole].name} came after "
                f"{phantom.holes[before.hole].name}, out of order ({now})."
            )
    elsewhere = len(dwells) - len(visits)
    if elsewhere:
        rests = "one rest was" if elsewhere == 1 else f"{elsewhere} rests were"
        notes.append(f"{session}: {rests} in no hole and left out.")
    return notes
