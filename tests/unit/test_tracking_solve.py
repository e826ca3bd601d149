"""From two midlines to one curve, from nothing: whatever the pictures' size and wherever the points happen to lie."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cathxr.core import Detection, FloatArray
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.tracking import solve
from cathxr.tracking.fit import CurveFit, camera_table, fit_curve
from cathxr.tracking.pair_work import PairWork
from cathxr.tracking.solve import Solution, solved

RADIUS_MM, LENGTH_MM, BEND_MM = 1.5, 90.0, 40.0


def centreline(at_mm: FloatArray) -> FloatArray:
    """Return points (N, 3), mm, of a straight catheter with an end that bends up and to the side, from its tip on."""
    along = LENGTH_MM - at_mm
    bent = np.maximum(along - (LENGTH_MM - BEND_MM), 0.0)
    return np.column_stack([along - bent**2 / 200.0, bent**2 / 90.0, bent**2 / 120.0])


def seen_by(name: str, camera: CameraModel, spacing_mm: float, first_mm: float) -> Detection:
    """Return a clean midline of a view: the centre of the cap, and points `spacing_mm` apart behind it."""
    at = np.append(0.0, np.arange(first_mm, LENGTH_MM, spacing_mm))
    points = camera.project(centreline(at))
    ahead = camera.project(centreline(at - 0.1)) - points
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    count = len(points)
    width = RADIUS_MM * float(np.linalg.norm(points[-1] - points[-2])) / spacing_mm
    return Detection(
        name,
        0,
        0,
        curve_px=points,
        normal_px=np.column_stack([-ahead[:, 1], ahead[:, 0]]),
        sigma_px=np.full(count, 0.05),
        half_width_px=np.full(count, width),
        tip_px=points[0] + width * ahead[0],
        tip_sigma_px=0.1,
    )


@pytest.mark.parametrize("width", [320, 640, 1280])
@pytest.mark.parametrize("phase", [0.1, 0.5, 0.9])
def test_points_of_both_views_need_not_lie_opposite_one_another(width: int, phase: float) -> None:
    """The views' rays pass each other by up to half the points' spacing, which in a small picture is a millimetre."""
    scale = width / 1280
    cameras = []
    for name in ("top", "front"):
        full = example_rig().cameras[name]
        lens = replace(
            full.intrinsics,
            focal_px=0.8 * scale * full.intrinsics.focal_px,
            centre_px=scale * (full.intrinsics.centre_px + 0.5) - 0.5,
        )
        cameras.append(CameraModel(lens, full.camera_from_box, (width, round(720 * scale))))
    spacing_mm = 0.65 / scale
    views = [
        seen_by("top", cameras[0], spacing_mm, 1.0 + spacing_mm),
        seen_by("front", cameras[1], spacing_mm, 1.0 + phase * spacing_mm),
    ]
    table, work = camera_table(cameras), PairWork()
    work.take(views)
    found = solved(cameras, table, views, work, radius_mm=RADIUS_MM)
    assert isinstance(found, Solution), found
    assert np.linalg.norm(found.fit.control[0] - centreline(np.zeros(1))[0]) < 0.3


@pytest.mark.parametrize(("apart_mm", "resolved"), [(0.2, True), (3.0, False)])
def test_one_view_is_left_out_only_where_both_do_not_say_otherwise(
    monkeypatch: pytest.MonkeyPatch, apart_mm: float, resolved: bool
) -> None:
    """Both views' ends fit one curve, unsurely; without one view's end the fit is sure, and its tip somewhere else."""
    cameras = [CameraModel.of(example_rig().cameras[name]) for name in ("top", "front")]
    views = [seen_by(name, camera, 1.0, 1.0) for name, camera in zip(("top", "front"), cameras, strict=True)]

    def moved(*args: Any, without_end: int | None = None, **kwargs: Any) -> CurveFit | None:
        fit = fit_curve(*args, without_end=without_end, **kwargs)
        if fit is None or without_end is None:
            return fit
        return replace(fit, control=fit.control + np.array([apart_mm, 0.0, 0.0]))

    def unsure(*_: Any, without: int | None, **__: Any) -> tuple[str | None, float]:
        return {None: (None, 1.0), 0: ("the end lies elsewhere", 0.1), 1: (None, 0.1)}[without]

    monkeypatch.setattr(solve, "fit_curve", moved)
    monkeypatch.setattr(solve, "judged", unsure)
    table, work = camera_table(cameras), PairWork()
    work.take(views)
    found = solved(cameras, table, views, work, radius_mm=RADIUS_MM)
    assert isinstance(found, Solution), found
    assert (found.sigma_mm, found.doubtful) == ((0.1, "front") if resolved else (1.0, None))
