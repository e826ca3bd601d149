"""A lens's figures for the page."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from cathxr.calibration.board_views import BoardView
from cathxr.calibration.intrinsics import IntrinsicsResult
from cathxr.wire.calibration_messages import Figure

_GOOD_PX, _USABLE_PX = 0.3, 0.6
"""Residuals of a flat board and a focused webcam lie below the first; beyond the second something is wrong."""
_ENOUGH = 10


def progress_figures(views: Sequence[BoardView]) -> list[Figure]:
    """Return what can be said while views are collected."""
    corners = sum(len(each.corners_px) for each in views)
    return [Figure(label="Corners so far", value=str(corners))]


def result_figures(result: IntrinsicsResult) -> list[Figure]:
    """Return the lens with its standard deviations."""
    found = result.intrinsics
    std = found.provenance.std
    rms = found.provenance.rms_px or 0.0

    def pair(label: str, values: Sequence[float], key: str) -> Figure:
        deviations = std.get(key)
        parts = [
            f"{value:.2f}" if deviations is None else f"{value:.2f} ± {deviation:.2f}"
            for value, deviation in zip(values, np.zeros(2) if deviations is None else deviations, strict=True)
        ]
        return Figure(label=label, value=f"{', '.join(parts)} px")

    level: Literal["good", "warn", "bad"] = "good" if rms <= _GOOD_PX else "warn" if rms <= _USABLE_PX else "bad"
    figures = [
        Figure(label="Residual (RMS)", value=f"{rms:.3f} px", level=level),
        pair("Focal lengths", found.focal_px.tolist(), "focal_px"),
        pair("Centre", found.centre_px.tolist(), "centre_px"),
        Figure(label="Distortion k1 k2 p1 p2 k3", value="  ".join(f"{each:+.4f}" for each in found.distortion)),
        Figure(
            label="Views used", value=str(len(result.views)), level="good" if len(result.views) >= _ENOUGH else "warn"
        ),
    ]
    # The first one is the verdict, which stands above all figures.
    return figures + [Figure(label="Note", value=each, level="warn") for each in result.warnings[1:]]
