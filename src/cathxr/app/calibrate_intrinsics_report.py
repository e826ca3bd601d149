"""What `calibrate intrinsics` shows: two pictures in the report's folder, and tables on the console."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from cathxr.calibration.intrinsics import IntrinsicsResult
from cathxr.core import DataError
from cathxr.storage.atomic import os_reason, written_whole

_CLEARLY = 0.8
_COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3")


def write_pictures(folder: Path, camera: str, result: IntrinsicsResult) -> list[Path]:
    """Write the coverage and the residual picture, and return their paths.

    Raises:
        DataError: the folder cannot be made or written to.
    """
    # Matplotlib takes a second to load, which a wrong path need not wait for.
    from cathxr.calibration.intrinsics_drawing import coverage_png, residual_png

    drawn = {
        folder / f"intrinsics_{camera}_coverage.png": coverage_png(result),
        folder / f"intrinsics_{camera}_residuals.png": residual_png(result),
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(
            f"{folder}: cannot make the report's folder ({os_reason(error)}); choose another with --report."
        ) from error
    for path, png in drawn.items():
        with written_whole(path) as part:
            part.write_bytes(png)
    return list(drawn)


def print_result(console: Console, result: IntrinsicsResult, *, camera: str, paths: Sequence[Path]) -> None:
    """Print the lens with its errors, the views rejected and why, warnings, and a judgement."""
    console.print(_lens_table(result, camera))
    if result.rejected:
        console.print(_rejected_table(result))
    rms = result.intrinsics.provenance.rms_px or 0.0
    console.print(f"{len(result.views)} views of {result.board.text}, {rms:.3f} px RMS.", soft_wrap=True, markup=False)
    if result.inflation > 1.2:
        console.print(
            f"Standard deviations were raised by {result.inflation**0.5:.1f}: errors within a view are alike "
            "(a board that is not flat, motion).",
            soft_wrap=True, markup=False,
        )  # fmt: skip
    for warning in result.warnings[1:]:
        console.print(f"Note: {warning}", style="yellow", soft_wrap=True, markup=False)
    style = "bold yellow" if result.warnings else "bold green"
    console.print(result.verdict, style=style, soft_wrap=True, markup=False, highlight=False)
    for path in paths:
        console.print(f"Picture: {path}", soft_wrap=True, markup=False, highlight=False)


def print_finer(console: Console, result: IntrinsicsResult, finer: IntrinsicsResult) -> None:
    """Print that corners where edges cross fit clearly better, when they do."""
    rms, finer_rms = (each.intrinsics.provenance.rms_px or 0.0 for each in (result, finer))
    if finer_rms > _CLEARLY * rms:
        return
    focal, std = finer.intrinsics.focal_px[0], finer.intrinsics.provenance.std["focal_px"][0]
    console.print(
        f"Corners where the edges cross fit better here: {finer_rms:.3f} px RMS instead of {rms:.3f} px, focal length "
        f"{focal:.2f} ± {std:.2f} px. Use them with --corners edges, unless the figures are to compare with others'.",
        style="yellow", soft_wrap=True, markup=False, highlight=False,
    )  # fmt: skip


def _lens_table(result: IntrinsicsResult, camera: str) -> Table:
    lens, std = result.intrinsics, result.intrinsics.provenance.std
    table = Table(title=f"Lens of the {camera} camera", title_justify="left")
    for name in ("", "value", "±", ""):
        table.add_column(name, justify="left" if name == "" else "right")
    groups = (
        ("focal length", ("x", "y"), "focal_px", lens.focal_px),
        ("centre", ("x", "y"), "centre_px", lens.centre_px),
    )
    for label, axes, key, values in groups:
        for axis, value, deviation in zip(axes, values, std[key], strict=True):
            table.add_row(f"{label} {axis}", f"{value:.2f}", f"{deviation:.2f}", "px")
    for name, value, deviation in zip(_COEFFICIENTS, lens.distortion, std["distortion"], strict=True):
        table.add_row(name, f"{value:+.5f}", f"{deviation:.5f}", "")
    return table


def _rejected_table(result: IntrinsicsResult) -> Table:
    table = Table(title="Not used", title_justify="left")
    table.add_column("picture", overflow="fold")
    table.add_column("why", overflow="fold")
    for each in result.rejected:
        table.add_row(each.name, each.reason)
    return table
