"""Groups frames into series that can be read as volumes, and says of the others why they cannot."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cathxr.core import FloatArray
from cathxr.heart.reading.frames import Frame
from cathxr.heart.reading.phases import Phase, split
from cathxr.heart.reading.pixels import is_decodable, syntax_name
from cathxr.heart.reading.plan import MIN_SLICES

_SAME_DIRECTION = 1e-3
_FEW_ORIENTATIONS = 4


@dataclass(frozen=True, eq=False)
class Series:
    """Frames of one series, one orientation, one size. number: from 1, what --series takes.

    problem: why it cannot be read as a CT volume, in words, "" where it can. frames: copies of one object left out.
    """

    number: int
    kind: str
    problem: str
    frames: tuple[Frame, ...]
    phases: tuple[Phase, ...]
    copies: int


def series_of(frames: Sequence[Frame]) -> list[Series]:
    """Return every series among the frames, volumes and others, in the archive's own order of series."""
    groups: dict[tuple[object, ...], list[Frame]] = defaultdict(list)
    for each in frames:
        spacing = None if each.spacing_mm is None else tuple(np.round(each.spacing_mm, 4))
        size = each.layout.rows, each.layout.columns
        groups[each.series, each.kind, each.modality, each.is_hounsfield, size, spacing].append(each)
    parts = [part for group in groups.values() for part in _by_orientation(group)]
    parts.sort(key=lambda part: (part[0].order, -len(part), part[0].number))
    return [_series(number, part) for number, part in enumerate(parts, start=1)]


def _series(number: int, part: list[Frame]) -> Series:
    kept = _without_copies(part)
    problem = _problem(kept)
    phases = () if problem else tuple(split(kept))
    if phases and max(_positions(each) for each in phases) < MIN_SLICES:
        few = len({tuple(each.position) for each in kept if each.position is not None})
        problem, phases = f"only {few} slice{'s' * (few > 1)}", ()
    return Series(number, kept[0].kind, problem, tuple(kept), phases, len(part) - len(kept))


def with_phases(series: Series, phases: Sequence[Phase]) -> Series:
    """Return the series with its frames told apart in another way."""
    return replace(series, phases=tuple(phases))


def _positions(phase: Phase) -> int:
    return len({tuple(each.position) for each in phase.frames if each.position is not None})


def _problem(frames: Sequence[Frame]) -> str:
    """Return why frames are no CT volume, or ""."""
    first = frames[0]
    reasons = (
        (first.kind == "localiser", "a localiser"),
        (first.kind == "segmentation", "a segmentation: give it with --labels"),
        (first.kind == "secondary", "a screen picture"),
        (first.modality not in ("CT", "unknown"), f"{first.modality}, not CT"),
        (first.kind != "image", "not a CT image"),
        (not first.is_hounsfield, "values other than Hounsfield units"),
        (
            any(not is_decodable(each.layout) for each in frames),
            f"unsupported compression ({syntax_name(first.layout)})",
        ),
        (first.spacing_mm is None, "no pixel spacing"),
        (any(each.position is None for each in frames), "no positions of slices"),
        (any(each.axes is None for each in frames), "slices that turn about, or without orientation"),
    )
    return next((words for holds, words in reasons if holds), "")


def _compression(frames: Sequence[Frame]) -> str:
    return next((syntax_name(each.layout) for each in frames if not is_decodable(each.layout)), "")


def _without_copies(frames: Sequence[Frame]) -> list[Frame]:
    """Return the frames without those whose object was met before: a file that lies in the folder twice."""
    met: set[tuple[object, ...]] = set()
    kept = []
    for each in frames:
        # The identifier alone proves nothing: careless de-identification gives all slices the same one.
        place = None if each.position is None else tuple(each.position)
        same = each.identity, place, each.timing
        if each.identity and same in met:
            continue
        met.add(same)
        kept.append(each)
    return kept


def _by_orientation(frames: Sequence[Frame]) -> list[list[Frame]]:
    """Return the frames in parts of one orientation each; all in one, without orientation, where they turn about."""
    parts: list[tuple[FloatArray | None, list[Frame]]] = []
    for each in frames:
        same = (part for axes, part in parts if _is_same(axes, each.axes))
        part = next(same, None)
        if part is None:
            parts.append((each.axes, [each]))
        else:
            part.append(each)
    if len(parts) > _FEW_ORIENTATIONS and max(len(part) for _, part in parts) < MIN_SLICES:
        return [[replace(each, axes=None) for each in frames]]
    return [part for _, part in parts]


def _is_same(axes: FloatArray | None, others: FloatArray | None) -> bool:
    if axes is None or others is None:
        return axes is others
    return bool(np.abs(axes - others).max() < _SAME_DIRECTION)
