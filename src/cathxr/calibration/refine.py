"""Better poses from tracked sessions: the rig's own poses as prior, the agreement of the two views as the evidence."""

from dataclasses import dataclass, replace

import numpy as np

from cathxr.calibration.drift import FEWEST_CELLS, FEWEST_PAIRS, roi_grid, tip_shift_mm
from cathxr.calibration.epipolar import CAMERAS, PARAMETERS, Geometry, Pairs
from cathxr.calibration.epipolar_fit import POSES, Judgement, cells_of, judged, system_of
from cathxr.core import CalibrationError, FloatArray, Provenance, Rig
from cathxr.geometry.calibration_error import camera_errors, point_covariances
from cathxr.geometry.pose import perturbed

LEAST_SPAN = 0.2
"""The tips must span at least this share of the ROI along every axis (5th to 95th percentile)."""
LEAST_GAIN = 0.1
"""Held-out disagreement must fall by at least this share."""
HELD_OUT_BLOCK_S, HELD_OUT_EVERY = 3.0, 4
_FEWEST_HELD_OUT = 15
_RELINEARISED = 3


@dataclass(frozen=True, eq=False)
class Refinement:
    """The refined rig and what speaks for it.

    before_mm, after_mm: rms distance of the rays in pairs that had no part in the fit; n_used, n_held_out: pairs;
    cells: places in the fit; moved: by camera (mm, degrees); tip_shift_mm: rms over the ROI; expected_before_mm,
    expected_after_mm: the tip's expected error (root of the mean trace) over the ROI as the two rigs state it.
    """

    rig: Rig
    judgement: Judgement
    before_mm: float
    after_mm: float
    n_used: int
    n_held_out: int
    cells: int
    moved: dict[str, tuple[float, float]]
    tip_shift_mm: float
    expected_before_mm: float
    expected_after_mm: float


def refined(rig: Rig, pairs: Pairs, *, date: str) -> Refinement:
    """Return the rig with poses refined from the pairs of tracked sessions; every fourth 3 s are held out to judge it.

    Raises:
        CalibrationError: too few pairs, the ROI poorly covered, or held-out pairs agree no better than before.
    """
    fitted, held = _split(pairs)
    _check_cover(rig, fitted, held)
    change = np.zeros(PARAMETERS)
    judgement: Judgement | None = None
    cells = cells_of(rig, fitted)
    for _ in range(_RELINEARISED):
        cells = cells_of(rig, fitted, parameters=change)
        # the linear problem as seen from the rig's own poses, where the prior is
        cells = replace(cells, gap=cells.gap - cells.design @ change, entry=cells.entry - cells.entry_design @ change)
        judgement = judged(rig, system_of(rig, cells))
        change = np.zeros(PARAMETERS)
        change[POSES] = judgement.change[POSES]
    assert judgement is not None
    geometry = Geometry(rig)
    delay = judgement.delay_s[0]
    before, after = (_held_out_rms(rig, held, at) for at in (np.zeros(PARAMETERS), change))
    if not after <= (1.0 - LEAST_GAIN) * before:
        raise CalibrationError(
            f"The poses are not refined, and the rig is left as it is: pairs that had no part in the fit agree to "
            f"{after:.3f} mm after it and {before:.3f} mm before, so there is nothing to gain here"
            + (f"; the cameras are {delay * 1e3:.1f} ms apart in time." if abs(delay) > 0.001 else ".")
        )
    new = _with_poses(rig, change, judgement, n=len(cells.gap), date=date)
    moved = {}
    for name, old, now in zip(CAMERAS, geometry.cameras(np.zeros(PARAMETERS)), geometry.cameras(change), strict=True):
        turn = np.rad2deg(np.linalg.norm(change[15 * CAMERAS.index(name) :][:3]))
        moved[name] = (float(np.linalg.norm(now.centre_box - old.centre_box)), float(turn))
    return Refinement(
        new, judgement, before, after, len(fitted), len(held), len(cells.gap), moved, tip_shift_mm(rig, change),
        expected_tip_mm(rig), expected_tip_mm(new),
    )  # fmt: skip


def expected_tip_mm(rig: Rig) -> float:
    """Return the tip's expected error over the ROI, mm, as the rig states its calibration's errors."""
    spread = point_covariances(list(camera_errors(rig).values()), roi_grid(rig.roi))
    return float(np.sqrt(np.mean(np.trace(spread, axis1=1, axis2=2))))


def _split(pairs: Pairs) -> tuple[Pairs, Pairs]:
    """Return (pairs for the fit, pairs held out): blocks of time, so that neighbours do not stand on both sides."""
    held = np.zeros(len(pairs), dtype=bool)
    for session in np.unique(pairs.session):
        own = pairs.session == session
        block = np.floor((pairs.t_s - pairs.t_s[own].min()) / HELD_OUT_BLOCK_S).astype(int)
        held |= own & (block % HELD_OUT_EVERY == HELD_OUT_EVERY - 1)
    return pairs.where(~held), pairs.where(held)


def _check_cover(rig: Rig, fitted: Pairs, held: Pairs) -> None:
    """Return when the pairs suffice.

    Raises:
        CalibrationError: they do not; the sentence says along which axis.
    """
    if len(fitted) < FEWEST_PAIRS or len(held) < _FEWEST_HELD_OUT:
        raise CalibrationError(
            f"Only {len(fitted) + len(held)} picture pairs are tracked and slow enough to refine the poses: record a "
            "minute or two in which the catheter moves slowly through the whole box."
        )
    low, high = np.quantile(fitted.tip_box, [0.05, 0.95], axis=0)
    share = (high - low) / (rig.roi.max_mm - rig.roi.min_mm)
    if share.min() < LEAST_SPAN:
        axis = int(np.argmin(share))
        how = ("in and out", "to both sides (y)", "up and down (z)")[axis]
        raise CalibrationError(
            f"The tip was seen in only {share[axis]:.0%} of the region of interest along {'xyz'[axis]}, "
            f"{LEAST_SPAN:.0%} is needed to refine the poses: move the catheter {how} further, and record again."
        )
    cells = len(np.unique(np.floor(fitted.tip_box / 8.0), axis=0))
    if cells < FEWEST_CELLS:
        raise CalibrationError(
            f"The tip was in only {cells} places (8 mm apart), {FEWEST_CELLS} are needed: move it more."
        )


def _held_out_rms(rig: Rig, held: Pairs, parameters: FloatArray) -> float:
    """Return the rms of the gaps of held-out pairs, each place counting once."""
    cells = cells_of(rig, held, parameters=parameters)
    return float(np.sqrt(np.mean(np.square(cells.gap))))


def _with_poses(rig: Rig, change: FloatArray, judgement: Judgement, *, n: int, date: str) -> Rig:
    """Return the rig with both poses moved, and the covariance that the fit leaves each of them."""
    cameras = {}
    for index, name in enumerate(CAMERAS):
        camera, at = rig.cameras[name], 15 * index
        own = judgement.covariance[at : at + 15, at : at + 15]
        pose_covariance = 0.5 * (own[:6, :6] + own[:6, :6].T)
        std = {"translation_mm": np.sqrt(np.diag(pose_covariance)[3:])}
        lens_known = not own[6:, 6:].any()
        provenance = Provenance(
            std=std,
            covariance=pose_covariance,
            covariance_with_intrinsics=None if lens_known else own[:6, 6:],
            n=n,
            date=date,
            method=f"refined from {n} places of the tip in tracked sessions; before: "
            f"{camera.pose_provenance.method or 'not stated'}",
        )
        pose = perturbed(camera.camera_from_box, change[at : at + 6])
        cameras[name] = replace(camera, camera_from_box=pose, pose_provenance=provenance)
    return replace(rig, cameras={**rig.cameras, **cameras})
