"""Has the rig changed since it was calibrated? From tracked sessions and pictures of the markers, in one verdict."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from cathxr.calibration.epipolar import CAMERAS, PARAMETERS, Geometry, Pairs, gap_noise, joined, px_per_mm
from cathxr.calibration.epipolar_fit import Judgement, cells_of, judged, prior_covariance, system_of
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import CalibrationError, FloatArray, Rig, Roi
from cathxr.geometry import CameraModel, nearest_to_rays
from cathxr.geometry.calibration_error import intrinsics_covariance, pose_jacobian
from cathxr.geometry.pose import perturbed

FEWEST_PAIRS, FEWEST_CELLS = 40, 12
SIGNIFICANT = 1e-3
HARMFUL_MM = 0.1
"""A change that moves tips by less than this does not make a rig bad, however certain it is."""
_SURE = 0.9
_DELAY_SIGMAS, _DELAY_S = 4.0, 0.001
_BLOCK_S = 4.0
_GRID = 4


@dataclass(frozen=True)
class SessionRow:
    """One session's agreement. rms and mean of the signed distance between the rays, mm; its trend, mm per minute."""

    name: str
    pairs: int
    rms_mm: float
    rms_px: float
    mean_mm: float
    mean_std_mm: float
    trend_mm_min: float
    trend_std_mm_min: float
    shape_px: tuple[float, float]


@dataclass(frozen=True)
class RegionRow:
    """One region's agreement. z: the mean distance over what the rig's stated errors and the noise let expect."""

    name: str
    cells: int
    mean_mm: float
    rms_mm: float
    expected_mm: float

    @property
    def z(self) -> float:
        """The mean in units of its expected standard deviation."""
        return self.mean_mm / self.expected_mm


@dataclass(frozen=True, eq=False)
class SessionCheck:
    """What tracked sessions say. tip_shift_mm: how far tips in the ROI would move (rms) if the pairs were believed."""

    pairs: Pairs
    gaps_mm: FloatArray
    sessions: tuple[SessionRow, ...]
    regions: tuple[RegionRow, ...]
    entry_mm: FloatArray
    judgement: Judgement
    tip_shift_mm: float


@dataclass(frozen=True, eq=False)
class MarkerCheck:
    """What one camera's markers say. change (6,): of camera_from_box since the calibration, and its covariance.

    p_value: how likely so great a change is with the errors of both; residual_px (N, 2) at the rig's pose, by name.
    """

    camera: str
    names: tuple[str, ...]
    residual_px: FloatArray
    rms_px: float
    rms_after_px: float
    change: FloatArray
    covariance: FloatArray
    p_value: float
    turned_deg: float
    moved_mm: float
    tip_shift_mm: float


@dataclass(frozen=True)
class Verdict:
    """good, and one sentence that says why and what to do."""

    good: bool
    sentence: str


def check_sessions(rig: Rig, sessions: Sequence[tuple[str, Pairs]]) -> SessionCheck:
    """Return what the pairs of one or more sessions (name, pairs) say of the rig.

    Raises:
        CalibrationError: too few pairs, or all in one place.
    """
    pairs = joined([each for _, each in sessions])
    if len(pairs) < FEWEST_PAIRS:
        raise CalibrationError(
            f"Only {len(pairs)} picture pairs are tracked and slow enough to judge the rig, {FEWEST_PAIRS} are needed: "
            "record a minute in which the catheter moves slowly through the whole box."
        )
    cells = cells_of(rig, pairs)
    if len(cells.gap) < FEWEST_CELLS:
        raise CalibrationError(
            f"The tip was in only {len(cells.gap)} places (8 mm apart), {FEWEST_CELLS} are needed: record a minute in "
            "which the catheter moves slowly through the whole box."
        )
    system = system_of(rig, cells)
    judgement = judged(rig, system)
    gaps = Geometry(rig).gaps(np.zeros(PARAMETERS), pairs)
    scale = px_per_mm(rig, pairs)
    rows = [_session_row(rig, name, pairs.where(pairs.session == i), gaps, scale, pairs.session == i)
            for i, (name, _) in enumerate(sessions) if (pairs.session == i).any()]  # fmt: skip
    count = len(cells.gap)
    spread = system.design @ system.prior(prior_covariance(rig)) @ system.design.T + np.diag(np.square(system.noise))
    regions = []
    for name, inside in _regions(rig.roi, cells.tip_box):
        if inside.any():
            weight = np.zeros(count + 2)
            weight[:count][inside] = 1.0 / inside.sum()
            own = cells.gap[inside]
            expected = float(np.sqrt(weight @ spread @ weight))
            rms = float(np.sqrt(np.mean(np.square(own))))
            regions.append(RegionRow(name, int(inside.sum()), float(own.mean()), rms, expected))
    shift = tip_shift_mm(rig, judgement.change[:PARAMETERS])
    return SessionCheck(pairs, gaps, tuple(rows), tuple(regions), cells.entry, judgement, shift)


def check_markers(rig: Rig, sighting: Sighting) -> MarkerCheck:
    """Return what the markers in one camera's picture say of its pose.

    Raises:
        CalibrationError: the picture shows too few markers.
    """
    camera = rig.cameras[sighting.camera]
    places = {each.name: each.position_mm for group in rig.markers.values() for each in group}
    found = [each for each in sighting.markers if each.name in places]
    if len(found) < 4:
        why = sighting.problem or f"only {len(found)} of the rig's markers are seen, four are needed."
        raise CalibrationError(f"The {sighting.camera} camera's picture cannot be used for the check: {why}")
    points = np.stack([places[each.name] for each in found])
    residual = _residual(CameraModel.of(camera), found, points)
    rms = float(np.sqrt(np.mean(np.square(residual))))
    change, after = np.zeros(6), residual
    sigma = np.array([max(each.sigma_px, 0.03) for each in found])
    information = np.eye(6)
    for _ in range(10):
        model = CameraModel(camera.intrinsics, perturbed(camera.camera_from_box, change), camera.size_px)
        after = _residual(model, found, points)
        jacobian = (pose_jacobian(model, points) / sigma[:, None, None]).reshape(-1, 6)
        information = jacobian.T @ jacobian
        step = np.linalg.solve(information, jacobian.T @ (after / sigma[:, None]).reshape(-1))
        # both are left perturbations: to first order they add, and the last steps are tiny
        change = change + step
        if np.abs(step).max() < 1e-10:
            break
    left = float(np.sqrt(np.mean(np.square(after / sigma[:, None])) * after.size / max(1, after.size - 6)))
    covariance = np.asarray(np.linalg.inv(information) * max(1.0, left) ** 2, dtype=np.float64)
    stated = _pose_given_lens(rig, sighting.camera)
    p_value = float(chi2.sf(change @ np.linalg.solve(covariance + stated, change), 6))
    whole = np.zeros(PARAMETERS)
    at = 15 * CAMERAS.index(sighting.camera)
    whole[at : at + 6] = change
    moved = camera.camera_from_box.inverse().translation_mm
    pose = perturbed(camera.camera_from_box, change)
    return MarkerCheck(
        sighting.camera, tuple(each.name for each in found), residual, rms, float(np.sqrt(np.mean(np.square(after)))),
        change, covariance, p_value, float(np.rad2deg(np.linalg.norm(change[:3]))),
        float(np.linalg.norm(pose.inverse().translation_mm - moved)), tip_shift_mm(rig, whole),
    )  # fmt: skip


def verdict(sessions: SessionCheck | None, markers: Sequence[MarkerCheck]) -> Verdict:
    """Return the judgement in one sentence, from whichever evidence there is. Markers decide which camera moved."""
    moved = [each for each in markers if each.p_value < SIGNIFICANT and each.tip_shift_mm >= HARMFUL_MM]
    if moved:
        names = [f"the {each.camera} camera ({each.moved_mm:.1f} mm, {each.turned_deg:.2f}°)" for each in moved]
        which = " and ".join(names)
        effect = max(each.tip_shift_mm for each in moved)
        return Verdict(
            False, f"Drifted: {which} moved since the calibration, which shifts the tip by about {effect:.1f} mm: "
            "calibrate the markers again."
        )  # fmt: skip
    if sessions is not None:
        delay, std = sessions.judgement.delay_s
        if abs(delay) > max(_DELAY_S, _DELAY_SIGMAS * std):
            return Verdict(
                False, f"The cameras are {abs(delay) * 1e3:.1f} ms apart in time (the front camera's stamps are "
                f"{'late' if delay > 0 else 'early'}): run cathxr calibrate timing, then check again."
            )  # fmt: skip
        if sessions.judgement.p_value < SIGNIFICANT and sessions.tip_shift_mm >= HARMFUL_MM:
            return Verdict(
                False, f"Drifted: the two views of the catheter disagree more than the rig's stated errors allow; "
                f"{_who(sessions.judgement, markers)}, and the tip is off by about {sessions.tip_shift_mm:.1f} mm: "
                "calibrate the markers again, or refine the poses with --refine."
            )  # fmt: skip
    parts = []
    if sessions is not None:
        rms = float(np.sqrt(np.mean(np.square(sessions.gaps_mm))))
        parts.append(f"the two views of the catheter agree to {rms:.2f} mm, as the rig's stated errors let expect")
    parts += [f"the {each.camera} camera's markers are where they were ({each.rms_px:.2f} px)" for each in markers]
    return Verdict(True, f"Good: {'; '.join(parts)}.")


def tip_shift_mm(rig: Rig, change: FloatArray) -> float:
    """Return how far (rms) tips seen at places throughout the ROI are moved by a change (30,) of the parameters."""
    points = roi_grid(rig.roi)
    geometry = Geometry(rig)
    before, after = geometry.cameras(np.zeros(PARAMETERS)), geometry.cameras(change)
    rays = np.stack([new.ray(old.project(points)) for old, new in zip(before, after, strict=True)])
    moved = nearest_to_rays(np.stack([each.centre_box for each in after]), rays) - points
    return float(np.sqrt(np.mean(np.square(moved).sum(axis=1))))


def roi_grid(roi: Roi, *, count: int = _GRID) -> FloatArray:
    """Return points (count^3, 3) mm throughout the ROI, in the middles of equal blocks."""
    share = (np.arange(count) + 0.5) / count
    axes = [low + share * (high - low) for low, high in zip(roi.min_mm, roi.max_mm, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _who(judgement: Judgement, markers: Sequence[MarkerCheck]) -> str:
    """Return which camera moved, where that can be told."""
    best = max(CAMERAS, key=lambda each: judgement.probability[each])
    if judgement.probability[best] > _SURE:
        return f"the {best} camera moved (probability {min(0.99, judgement.probability[best]):.0%})"
    if judgement.probability["both"] > _SURE:
        return "both cameras moved"
    return "which camera moved cannot be told" + ("" if markers else " without pictures of the markers")


def _pose_given_lens(rig: Rig, name: str) -> FloatArray:
    """Return the covariance (6, 6) of a stated pose for the lens as it is: the lens is the same in both pictures."""
    stated = prior_covariance(rig)
    at = 15 * CAMERAS.index(name)
    pose = stated[at : at + 6, at : at + 6]
    cross = stated[at : at + 6, at + 6 : at + 15]
    lens = intrinsics_covariance(rig.cameras[name].intrinsics)
    return np.asarray(pose - cross @ np.linalg.pinv(lens, hermitian=True) @ cross.T, dtype=np.float64)


def _residual(model: CameraModel, found: Sequence[FoundMarker], points: FloatArray) -> FloatArray:
    return np.stack([each.centre_px for each in found]) - model.project(points)


def _session_row(rig: Rig, name: str, own: Pairs, gaps: FloatArray, scale: FloatArray, mask: FloatArray) -> SessionRow:
    """Return one session's row; the trend over time from means of blocks of four seconds."""
    gap = gaps[mask]
    noise = gap_noise(rig, own)
    block = np.floor((own.t_s - own.t_s[0]) / _BLOCK_S).astype(int)
    present = np.unique(block)
    means = np.array([gap[block == each].mean() for each in present])
    times = np.array([own.t_s[block == each].mean() for each in present]) / 60.0
    floor = float(np.median(noise)) / np.sqrt(len(own))
    mean_std = max(floor, float(means.std(ddof=1)) / np.sqrt(len(means))) if len(means) > 1 else float(np.inf)
    trend, trend_std = 0.0, float(np.inf)
    if len(means) > 3:
        centred = times - times.mean()
        trend = float(centred @ means / (centred @ centred))
        left = means - means.mean() - trend * centred
        trend_std = float(np.sqrt(left @ left / (len(means) - 2) / (centred @ centred)))
    shape = np.sqrt(np.mean(np.square(own.shape_px), axis=0))
    return SessionRow(
        name, len(own), float(np.sqrt(np.mean(gap**2))), float(np.sqrt(np.mean(np.square(gap * scale[mask])))),
        float(gap.mean()), mean_std, trend, trend_std, (float(shape[0]), float(shape[1])),
    )  # fmt: skip


def _regions(roi: Roi, tip_box: FloatArray) -> list[tuple[str, FloatArray]]:
    """Return (name, mask (M,)) of the thirds of the insertion and the four sides around its axis."""
    share = (tip_box[:, 0] - roi.min_mm[0]) / (roi.max_mm[0] - roi.min_mm[0])
    thirds = np.clip((share * 3).astype(int), 0, 2)
    y, z = tip_box[:, 1], tip_box[:, 2]
    sides = (
        ("up (+z)", (z >= 0) & (z >= np.abs(y))), ("down (-z)", (z < 0) & (-z >= np.abs(y))),
        ("left (+y)", (y > 0) & (y > np.abs(z))), ("right (-y)", (y < 0) & (-y > np.abs(z))),
    )  # fmt: skip
    depths = [(name, thirds == index) for index, name in enumerate(("near the inlet", "middle", "far end"))]
    return [("all", np.ones(len(share), dtype=bool)), *depths, *sides]
