"""The poses' figures for the page."""

import numpy as np

from cathxr.calibration.error_map import ErrorSummary
from cathxr.calibration.poses import PosesResult, pose_std
from cathxr.wire.calibration_messages import Figure

_GOOD_MM, _USABLE_MM = 0.1, 0.3
"""The whole chain may err by 0.3 mm on average, of which the poses may take a third before anything else errs."""


def result_figures(result: PosesResult, summary: ErrorSummary) -> list[Figure]:
    """Return each camera's residual, error and displacement, and the error to expect at the tip."""
    figures = [
        Figure(
            label="Expected error in the region of interest",
            value=f"{summary.mean_mm:.3f} mm (95 %: {summary.p95_mm:.3f}, most: {summary.max_mm:.3f})",
            level="good" if summary.mean_mm <= _GOOD_MM else "warn" if summary.mean_mm <= _USABLE_MM else "bad",
        )
    ]
    for name, rms in result.rms_px.items():
        used = sum(each.used for each in result.residuals if each.camera == name)
        text = f"{rms:.3f} px (RMS of {used} fiducials)"
        figures.append(Figure(label=f"{name}: residual", value=text))
        std = pose_std(result.rig.cameras[name])
        if std is not None:
            place, turn = float(np.linalg.norm(std[0])), float(np.rad2deg(np.linalg.norm(std[1])))
            figures.append(Figure(label=f"{name}: pose known to", value=f"{place:.3f} mm, {turn:.4f}°"))
        shift, angle = result.moved[name]
        figures.append(Figure(label=f"{name}: moved from the rig's pose", value=f"{shift:.2f} mm, {angle:.2f}°"))
    figures += [Figure(label="Note", value=each, level="warn") for each in result.warnings]
    return figures
