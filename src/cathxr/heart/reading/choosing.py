"""Chooses the series to read among those at a path: contrast, then the phase, then the finest slices; else asks."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cathxr.core import DataError
from cathxr.heart.reading.phases import Phase, choose
from cathxr.heart.reading.pixels import PixelSource
from cathxr.heart.reading.scan import Scan
from cathxr.heart.reading.series import Series
from cathxr.heart.reading.summary import SeriesSummary, summary_of

_SAME_PITCH = 1.2
_LISTED = 8


@dataclass(frozen=True)
class Choice:
    """The series to read. words: how its phase was chosen among several series, "" where one only was there."""

    series: Series
    words: str = ""


def chosen_series(
    path: Path, offers: Sequence[Series], *, series: int | None, phase: str | float | None, pixels: PixelSource
) -> Choice:
    """Return the series that is asked for, else the one that is best read for a heart.

    Raises:
        DataError: there is none that can be read, or several that nothing here tells apart.
    """
    if series is not None:
        return Choice(_numbered(path, offers, series))
    readable = [each for each in offers if not each.problem]
    if not readable:
        raise DataError(_nothing_readable(path, offers))
    if len(readable) == 1:
        return Choice(readable[0])
    looked = [(each, summary_of(each, pixels)) for each in readable]
    whole = [each for each in looked if not each[1].problem] or looked
    bright = [each for each in whole if each[1].contrast is not None and each[1].contrast.is_bright] or whole
    if phase is not None:
        bright = [each for each in bright if _has(each[0], phase)] or bright
    if len(bright) == 1:
        return Choice(bright[0][0])
    if found := _by_phase(bright, phase):
        return found
    finest = min(_pitch(each[1]) for each in bright)
    fine = [each for each in bright if _pitch(each[1]) <= _SAME_PITCH * finest]
    if len(fine) == 1:
        return Choice(fine[0][0])
    if found := _by_phase(fine, phase):
        return found
    several = "; ".join(_described(each[1]) for each in fine[:_LISTED])
    raise DataError(f"{path} holds {len(fine)} series that could be read: {several}. Choose one with --series.")


def nothing_to_read(path: Path, looked: Scan) -> str:
    """Return the sentence for a place without any DICOM picture."""
    if len(looked.volumes) > 1:
        return f"{path} holds {len(looked.volumes)} volume files (NIfTI, NRRD) and no DICOM; give one of the files."
    if looked.without_pictures:
        return f"{path} holds no pictures, only DICOM reports or directories; give the folder of the slices."
    if looked.others:
        return (
            f"{path} holds no DICOM: none of its {looked.others} files is; give the folder of the slices, and if they "
            "were exported encrypted, export them again without."
        )
    return f"{path} is empty; give a folder that holds DICOM files."


def _numbered(path: Path, offers: Sequence[Series], number: int) -> Series:
    found = next((each for each in offers if each.number == number), None)
    if found is None:
        raise DataError(f"{path} has no series {number}; its series are numbered 1 to {len(offers)}.")
    if found.problem:
        raise DataError(f"Series {number} of {path} cannot be read as a CT: {found.problem}; choose another one.")
    return found


def _nothing_readable(path: Path, offers: Sequence[Series]) -> str:
    modalities = {each.frames[0].modality for each in offers if each.kind == "image"} - {"CT", "unknown"}
    if modalities and not any(each.frames[0].modality == "CT" for each in offers):
        return f"{path} holds {' and '.join(sorted(modalities))}, not CT; a heart is built from a CT with contrast."
    if len(offers) == 1:
        return (
            f"{path} holds one series that cannot be read as a CT volume ({offers[0].problem}); give the folder of the "
            "whole CT series."
        )
    listed = "; ".join(f"series {each.number}: {each.problem}" for each in offers[:_LISTED])
    return f"{path} holds no series that can be read as a CT volume ({listed}); give the folder of the whole CT series."


def _has(series: Series, phase: str | float) -> bool:
    try:
        choose(series.phases, phase)
    except DataError:
        return False
    return True


def _by_phase(looked: Sequence[tuple[Series, SeriesSummary]], asked: str | float | None) -> Choice | None:
    """Return the end-diastolic one of series that are one phase each on the same grid; None where they are not that."""
    singles = [(each, each.phases[0]) for each, _ in looked if len(each.phases) == 1]
    kinds = {(summary.size, summary.spacing_mm and tuple(round(each, 3) for each in summary.spacing_mm),
              summary.technical.kernel) for _, summary in looked}  # fmt: skip
    labels = {phase.label for _, phase in singles}
    if len(singles) != len(looked) or len(kinds) != 1 or len(labels) != len(singles) or "" in labels:
        return None
    phases: list[Phase] = sorted((phase for _, phase in singles), key=lambda each: each.percent or 0.0)
    try:
        best, words = choose(phases, asked)
    except DataError:
        return None
    return Choice(next(series for series, phase in singles if phase is best), words)


def _pitch(summary: SeriesSummary) -> float:
    return summary.spacing_mm[2] if summary.spacing_mm else float("inf")


def _described(summary: SeriesSummary) -> str:
    parts = [f"{summary.slices} slices of {_pitch(summary):.2f} mm", *summary.phases[:1], summary.technical.kernel]
    return f"{summary.number} ({', '.join(each for each in parts if each)})"
