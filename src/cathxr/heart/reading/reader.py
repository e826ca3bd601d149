"""Finds series at a path, and reads one of them as a volume: DICOM (folder, ZIP, file), NIfTI, NRRD."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from cathxr.core import DataError
from cathxr.heart.reading.archive import unpacked
from cathxr.heart.reading.assembly import assemble
from cathxr.heart.reading.choosing import Choice, chosen_series, nothing_to_read
from cathxr.heart.reading.contrast import contrast_of
from cathxr.heart.reading.copies import single, told_apart
from cathxr.heart.reading.frames import looks_like_dicom
from cathxr.heart.reading.phases import choose
from cathxr.heart.reading.pixels import PixelSource
from cathxr.heart.reading.plan import plan_of
from cathxr.heart.reading.quiet import quiet
from cathxr.heart.reading.scan import VOLUME_ENDINGS, Scan, scan, scan_paths
from cathxr.heart.reading.series import Series, series_of
from cathxr.heart.reading.stack import stack_of
from cathxr.heart.reading.summary import SeriesSummary, summary_of, technical_of
from cathxr.heart.reading.volume_files import read_volume_file, summary_of_file
from cathxr.heart.volume import Progress, Volume, silent


@dataclass(frozen=True)
class _Found:
    """What lies at a path: one volume file, or DICOM series."""

    file: Path | None
    series: tuple[Series, ...]
    scan: Scan | None


def find_series(path: Path, *, progress: Progress = silent) -> list[SeriesSummary]:
    """Return what is at `path`, a folder, a ZIP archive or a file: every series, those that cannot be read too.

    Raises:
        DataError: nothing there can be read, or the path or archive is damaged.
    """
    with quiet(), _found(path, progress) as found:
        if found.file is not None:
            return summary_of_file(found.file, path)
        pixels, summaries = PixelSource(), []
        for number, each in enumerate(found.series):
            progress("Looking at the series", number / len(found.series))
            summaries.append(summary_of(each, pixels))
        if found.scan is not None and (count := len(found.scan.damaged)):
            # Which series they belong to cannot be told, so that every one says so.
            which = "1 file in the folder is" if count == 1 else f"{count} files in the folder are"
            remark = f"{which} damaged or cut off: copy the series again."
            summaries = [_with_remark(each, remark) for each in summaries]
        return summaries


def read_volume(
    path: Path, *, phase: str | float | None = None, series: int | None = None, progress: Progress = silent
) -> Volume:
    """Return the CT at `path` on a regular, orthogonal, right-handed grid, in HU.

    path: DICOM files in a folder or a ZIP archive (other series and files among them are left out), one DICOM file of
    many frames, NIfTI or NRRD. phase: per cent of the RR interval ("75", "75 %"), delay ("310 ms"), or a label that
    `find_series` lists; without it the end of diastole. series: its number in `find_series`.

    Raises:
        DataError: what is there cannot be read as one CT volume, or several could be; the sentence says what to do.
    """
    with quiet(), _found(path, progress) as found:
        if found.file is not None:
            return read_volume_file(found.file, path, phase=phase, progress=progress)
        assert found.scan is not None, "series come from a scan"
        if found.scan.damaged:
            raise DataError(_damaged(path, found.scan))
        pixels = PixelSource()
        chosen = chosen_series(path, found.series, series=series, phase=phase, pixels=pixels)
        return _read(chosen, phase, pixels, progress)


def _read(choice: Choice, phase: str | float | None, pixels: PixelSource, progress: Progress) -> Volume:
    series = choice.series
    chosen, words = choose(told_apart(series.phases, pixels), phase)
    words = choice.words or words
    stack, copies = single(stack_of(chosen.frames), pixels)
    plan = plan_of(stack)
    hu, grid = assemble(stack, plan, pixels, progress)
    contrast = contrast_of(hu, grid.spacing_mm.tolist())
    remarks = (*copies, *plan.remarks)
    return Volume(hu, grid, technical_of(series, remarks=remarks, phase=words, contrast=contrast))


def _with_remark(summary: SeriesSummary, remark: str) -> SeriesSummary:
    technical = replace(summary.technical, remarks=(*summary.technical.remarks, remark))
    return replace(summary, technical=technical)


@contextmanager
def _found(path: Path, progress: Progress) -> Iterator[_Found]:
    """Yield what is at the path; an unpacked archive is there as long as the block runs."""
    if path.is_dir():
        yield _in_folder(path, path, progress)
    elif not path.exists():
        raise DataError(f"{path} is not there; give a folder of DICOM files, a ZIP archive, a NIfTI or an NRRD file.")
    elif path.name.lower().endswith(VOLUME_ENDINGS):
        yield _Found(path, (), None)
    elif path.suffix.lower() == ".zip" or _begins(path, b"PK\x03\x04"):
        with unpacked(path, progress=progress) as folder:
            yield _in_folder(folder, path, progress)
    elif path.name.upper() == "DICOMDIR":
        yield _in_folder(path.parent, path.parent, progress)
    elif looks_like_dicom(path):
        yield _of_scan(scan_paths([path]), path)
    else:
        raise DataError(
            f"{path} is neither DICOM nor a ZIP archive, a NIfTI or an NRRD file; give one of these, or a DICOM folder."
        )


def _in_folder(folder: Path, path: Path, progress: Progress) -> _Found:
    looked = scan(folder, progress=progress)
    if not looked.frames and len(looked.volumes) == 1:
        return _Found(looked.volumes[0], (), None)
    return _of_scan(looked, path)


def _of_scan(looked: Scan, path: Path) -> _Found:
    if not looked.frames:
        raise DataError(_damaged(path, looked) if looked.damaged else nothing_to_read(path, looked))
    return _Found(None, tuple(series_of(looked.frames)), looked)


def _damaged(path: Path, looked: Scan) -> str:
    numbers: Sequence[int] = looked.damaged
    which = f"file {numbers[0]} in name order is" if len(numbers) == 1 else f"{len(numbers)} files are"
    first = "" if len(numbers) == 1 else f" (the first is number {numbers[0]} in name order)"
    return f"{path}: {which} damaged or cut off{first}; copy the series again from where it came from."


def _begins(path: Path, mark: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(len(mark)) == mark
