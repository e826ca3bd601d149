"""What `calibrate markers` shows: pictures in the report's folder, and tables on the console."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from cathxr.calibration.error_map import ErrorSummary, error_summary
from cathxr.calibration.poses import PosesResult, pose_std
from cathxr.calibration.sighting import Sighting
from cathxr.core import DataError, PixelArray
from cathxr.storage.atomic import os_reason, written_whole

_GOOD_MM, _USABLE_MM = 0.1, 0.3
"""The whole chain may err by 0.3 mm on average, of which the poses may take a third before anything else errs."""


class Report:
    """Pictures that are drawn first and written together."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._drawn: dict[str, bytes] = {}

    @property
    def paths(self) -> list[Path]:
        """Where the pictures are, or will be."""
        return [self._folder / name for name in self._drawn]

    def add_sighting(self, name: str, pixels: PixelArray, sighting: Sighting) -> None:
        """Draw what was found in a picture."""
        from cathxr.calibration.marker_drawing import sighting_png

        self._drawn[f"markers_{name}.png"] = sighting_png(pixels, sighting)

    def add_result(self, result: PosesResult) -> None:
        """Draw the residuals and the error to expect."""
        # Matplotlib takes a second to load, which a wrong path need not wait for.
        from cathxr.calibration.poses_drawing import error_map_png, residuals_png

        self._drawn["markers_residuals.png"] = residuals_png(result)
        self._drawn["expected_error.png"] = error_map_png(result.rig)

    def write(self) -> None:
        """Write what was drawn.

        Raises:
            DataError: the folder cannot be made or written to.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise DataError(
                f"{self._folder}: cannot make the report's folder ({os_reason(error)}); choose another with --report."
            ) from error
        for path, png in zip(self.paths, self._drawn.values(), strict=True):
            with written_whole(path) as part:
                part.write_bytes(png)


def print_result(console: Console, result: PosesResult, paths: Sequence[Path]) -> None:
    """Print residuals, poses with their errors, the error to expect, warnings, and a judgement."""
    console.print(_residual_table(result))
    console.print(_pose_table(result))
    summary = error_summary(result.rig)
    console.print(
        f"Expected error over the region of interest: rms {summary.mean_mm:.3f} mm, 95 % below "
        f"{summary.p95_mm:.3f} mm, greatest {summary.max_mm:.3f} mm.",
        soft_wrap=True,
    )
    if not any(marker.provenance.std for markers in result.rig.markers.values() for marker in markers):
        console.print(
            "The fiducials' positions count as exact, for the rig states no std for them: 0.1 mm of error in how the "
            "crosses are built shifts everything by about as much.",
            soft_wrap=True,
        )
    for warning in result.warnings:
        console.print(f"Warning: {warning}", style="yellow", soft_wrap=True, markup=False)
    console.print(judgement(result, summary), style="bold", soft_wrap=True, markup=False)
    for path in paths:
        console.print(f"Picture: {path}", soft_wrap=True, markup=False, highlight=False)


def judgement(result: PosesResult, summary: ErrorSummary) -> str:
    """Return one sentence: good, or what to do better."""
    four = [name for name in result.rms_px if sum(each.camera == name and each.used for each in result.residuals) < 6]
    lenses = [
        name
        for name in result.rms_px
        if not result.rig.cameras[name].intrinsics.provenance.std
        and result.rig.cameras[name].intrinsics.provenance.covariance is None
    ]
    advice = []
    if four:
        advice.append(f"put in both crosses at once, so that the {' and the '.join(four)} camera sees eight fiducials")
    if lenses:
        advice.append(
            f"calibrate the {' and the '.join(lenses)} lens, whose error the rig does not state and which counts as "
            "exact here"
        )
    if result.warnings:
        return "Doubtful: look into the warnings first."
    if summary.mean_mm <= _GOOD_MM:
        return "Good." + (f" Better still: {'; '.join(advice)}." if advice else "")
    word = "Usable" if summary.mean_mm <= _USABLE_MM else "Poor"
    return f"{word}: {'; '.join(advice) or 'take sharper pictures, or several of each camera'}."


def _residual_table(result: PosesResult) -> Table:
    table = Table(title="Residuals: seen minus where the pose puts it", title_justify="left")
    for name in ("camera", "fiducial"):
        table.add_column(name)
    for name in ("x, px", "y, px", "distance, px", "sigma, px"):
        table.add_column(name, justify="right")
    table.add_column("")
    before = ""
    for each in result.residuals:
        x, y = each.residual_px
        table.add_row(
            "" if each.camera == before else each.camera,
            each.name,
            f"{x:+.3f}",
            f"{y:+.3f}",
            f"{float(np.hypot(x, y)):.3f}",
            f"{each.sigma_px * result.noise_scale[each.camera]:.3f}",
            "" if each.used else "left out",
            style=None if each.used else "red",
        )
        before = each.camera
    return table


def _pose_table(result: PosesResult) -> Table:
    table = Table(title="Poses, with standard deviations", title_justify="left")
    table.add_column("")
    rows: dict[str, list[str]] = {}
    for name, rms in result.rms_px.items():
        table.add_column(name, justify="right")
        for what, value in _pose_rows(result, name, rms).items():
            rows.setdefault(what, []).append(value)
    for what, values in rows.items():
        table.add_row(what, *values)
    return table


def _pose_rows(result: PosesResult, name: str, rms: float) -> dict[str, str]:
    camera = result.rig.cameras[name]
    std = pose_std(camera)
    assert std is not None, "a calibrated pose states its covariance"
    centre = camera.camera_from_box.inverse().translation_mm
    shift, turn = result.moved[name]
    return {
        "residual, rms px": f"{rms:.3f}",
        "centre x, y, z in the box, mm": ", ".join(f"{each:.2f}" for each in centre),
        "  std, mm": ", ".join(f"{each:.3f}" for each in std[0]),
        "turn about its x, y, z: std, °": ", ".join(f"{each:.4f}" for each in np.rad2deg(std[1])),
        "moved from the rig's earlier pose": f"{shift:.2f} mm, {turn:.3f}°",
    }
