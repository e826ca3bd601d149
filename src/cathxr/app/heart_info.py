"""`cathxr heart info`: what series, phases, spacing and contrast are at a path."""

from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.heart_progress import shown_progress
from cathxr.app.page_options import PATH
from cathxr.heart.reading import SeriesSummary, find_series

_WIDTH = 110
_LISTED_PHASES = 10


@click.command("info")
@click.argument("path", type=PATH)
@told_in_a_sentence
def info(path: Path) -> None:
    """Show the series at PATH: a DICOM folder or ZIP archive, a DICOM file, NIfTI or NRRD.

    Whether there is contrast is judged from the voxels. Nothing is written, and nothing that names a patient is shown.

    \b
    Examples:
      cathxr heart info ct_series/
      cathxr heart info export.zip
    """
    with shown_progress() as progress:
        found = find_series(path, progress=progress)
    console = Console()
    if not console.is_terminal:
        console = Console(width=_WIDTH)
    console.print(_table(found))
    for each in found:
        for remark in _remarks(each):
            console.print(f"  {each.number}: {remark}", markup=False, highlight=False)
    console.print(_what_next(found), markup=False, highlight=False)


def _table(found: list[SeriesSummary]) -> Table:
    """Return the table, without columns that say nothing of any series."""
    rows = [_row(each) for each in found]
    names = [name for name in rows[0] if any(row[name] for row in rows)]
    table = Table(title="Series", title_justify="left", title_style="bold")
    for name in names:
        table.add_column(name, justify="right" if name in ("", "slices", "kV") else "left")
    for each, row in zip(found, rows, strict=True):
        table.add_row(*(row[name] for name in names), style="dim" if each.problem else None)
    return table


def _row(summary: SeriesSummary) -> dict[str, str]:
    technical = summary.technical
    return {
        "": str(summary.number),
        "kind": technical.modality,
        "slices": str(summary.slices),
        "voxels, mm": _times(summary.spacing_mm, ".2f"),
        "covers, mm": _times(summary.extent_mm, ".0f"),
        "slices are": "" if summary.orientation == "unknown" else summary.orientation,
        "phase": _phases(summary),
        "contrast": _contrast(summary),
        "kernel": technical.kernel,
        "kV": "" if technical.tube_voltage_kv is None else f"{technical.tube_voltage_kv:.0f}",
    }


def _times(values: tuple[float, float, float] | None, form: str) -> str:
    return "" if values is None else " × ".join(format(each, form) for each in values)


def _phases(summary: SeriesSummary) -> str:
    if len(summary.phases) <= 1:
        return "".join(summary.phases)
    return f"{len(summary.phases)} phases"


def _contrast(summary: SeriesSummary) -> str:
    """Return the blood's brightness, as far as a pool of it is there."""
    contrast = summary.contrast
    if contrast is None:
        return ""
    if contrast.is_bright:
        return f"yes, {contrast.pool_hu:.0f} HU"
    return "no" if contrast.pool_hu is None else "hardly any"


def _remarks(summary: SeriesSummary) -> list[str]:
    """Return what the table has no room for, a sentence each."""
    if summary.problem:
        whole = summary.problem[0].upper() + summary.problem[1:]
        return [f"cannot be read. {whole.rstrip('.')}."]
    remarks = list(summary.technical.remarks)
    if len(summary.phases) > 1:
        listed = ", ".join(summary.phases[:_LISTED_PHASES])
        more = f" and {len(summary.phases) - _LISTED_PHASES} more" if len(summary.phases) > _LISTED_PHASES else ""
        chosen = summary.chosen and f"; {summary.chosen} is taken as end-diastole"
        remarks.append(f"phases {listed}{more}{chosen or '; give one with --phase'}.")
    contrast = summary.contrast
    if contrast is not None and not contrast.is_bright:
        pool = (
            ""
            if contrast.pool_hu is None
            else f" (the largest is {contrast.pool_ml:.0f} mL at {contrast.pool_hu:.0f} HU)"
        )
        remarks.append(f"no bright blood pool of a heart's size is to be seen{pool}.")
    return remarks


def _what_next(found: list[SeriesSummary]) -> str:
    good = [each for each in found if not each.problem and each.contrast is not None and each.contrast.is_bright]
    if not any(not each.problem for each in found):
        return "None of these is a CT volume that a heart can be built from."
    if not good:
        return "Chambers can only be told apart in a CT with contrast; ready masks may be given with --labels."
    numbers = " or ".join(str(each.number) for each in good)
    choose = f" --series {good[0].number}" if len([each for each in found if not each.problem]) > 1 else ""
    return f"Fit for a heart: series {numbers}. Build it with: cathxr heart build PATH{choose} --out HEART/"
