"""The catheter as a check: both cameras see the centre of its rounded end, so the two rays to it must meet.

From a tracked session: the signed distance between the two rays of each pair (the epipolar distance, in space), what
noise it should have, and how both change with the cameras' poses and lenses.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cathxr.core import Detection, FloatArray, Intrinsics, Observation, Rig, Status, Track
from cathxr.geometry import CameraModel, nearest_to_rays
from cathxr.geometry.pose import perturbed

CAMERAS = ("top", "front")
SLOWEST_CARRY_MM = 0.05
"""A pair is used when the tip moves at most this far between its two pictures."""
FASTEST_MM_S = 60.0
"""... and not faster than this: an unknown delay of a millisecond must not look like a turned camera."""
_NEIGHBOUR_S = 0.25
_STEP_PX = 0.01
_DENSE = 400
PARAMETERS = 30
"""For each camera 6 of the pose (`geometry.pose.perturbed`: rad, mm), then 9 of the lens (as in Provenance)."""
_STEPS = np.tile([1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4, 1e-2, 1e-2, 1e-2, 1e-2, 1e-5, 1e-5, 1e-6, 1e-6, 1e-5], 2)


@dataclass(frozen=True, eq=False)
class Pairs:
    """N picture pairs that can judge the calibration.

    session (N,) index; t_s (N,) seconds of the session's clock; top_px, front_px (N, 2): the rounded end's centre, raw
    pixels; noise_px2 (N, 2, 2, 2): its covariance in each view; tip_box, velocity (N, 3) mm, mm/s; skew_s (N,);
    entry_px (N, 2, 2): the entry as each camera should see it, entry_along (N, 3) the direction there;
    shape_px (N, 2): rms distance of each view's midline from the Track's projected centreline.
    """

    session: np.ndarray[tuple[int], np.dtype[np.int64]]
    t_s: FloatArray
    top_px: FloatArray
    front_px: FloatArray
    noise_px2: FloatArray
    tip_box: FloatArray
    velocity: FloatArray
    skew_s: FloatArray
    entry_px: FloatArray
    entry_along: FloatArray
    shape_px: FloatArray

    def __len__(self) -> int:
        return len(self.t_s)

    def where(self, mask: FloatArray) -> "Pairs":
        """Return the pairs of a mask (N,) or of indices."""
        return Pairs(*(getattr(self, name)[mask] for name in self.__dataclass_fields__))


@dataclass(frozen=True, eq=False)
class Geometry:
    """Two cameras whose PARAMETERS (30,) are away from a rig's by what is given."""

    rig: Rig

    def cameras(self, parameters: FloatArray) -> tuple[CameraModel, CameraModel]:
        """Return the top and the front camera at the parameters."""
        made = []
        for index, name in enumerate(CAMERAS):
            camera = self.rig.cameras[name]
            own = parameters[15 * index : 15 * index + 15]
            pose = perturbed(camera.camera_from_box, own[:6])
            lens, change = camera.intrinsics, own[6:]
            moved = Intrinsics(lens.focal_px + change[:2], lens.centre_px + change[2:4], lens.distortion + change[4:])
            made.append(CameraModel(moved, pose, camera.size_px))
        return made[0], made[1]

    def gaps(self, parameters: FloatArray, pairs: Pairs) -> FloatArray:
        """Return the signed distances (N,) mm between the two rays of each pair."""
        return signed_gaps(*self.cameras(parameters), pairs.top_px, pairs.front_px)

    def entries(self, parameters: FloatArray, pairs: Pairs) -> FloatArray:
        """Return where each pair's catheter crosses x = 0: (N, 2) mm, y and z; both 0 but for its play."""
        cameras = self.cameras(parameters)
        rays = np.stack([camera.ray(pairs.entry_px[:, view]) for view, camera in enumerate(cameras)])
        points = nearest_to_rays(np.stack([each.centre_box for each in cameras]), rays)
        along = pairs.entry_along
        return np.asarray(points[:, 1:] - points[:, :1] / along[:, :1] * along[:, 1:], dtype=np.float64)


def signed_gaps(top: CameraModel, front: CameraModel, top_px: FloatArray, front_px: FloatArray) -> FloatArray:
    """Return the signed distances (N,), mm, between the rays through top_px and front_px (N, 2) raw pixels."""
    normal = np.cross(top.ray(top_px), front.ray(front_px))
    length = np.maximum(np.linalg.norm(normal, axis=-1), 1e-9)
    return np.asarray(normal @ (front.centre_box - top.centre_box) / length, dtype=np.float64)


def gap_noise(rig: Rig, pairs: Pairs) -> FloatArray:
    """Return the standard deviation (N,), mm, that the pictures' noise gives each gap."""
    geometry = Geometry(rig)
    cameras = geometry.cameras(np.zeros(PARAMETERS))
    slope = np.empty((len(pairs), 2, 2))
    for view in range(2):
        for axis in range(2):
            step = np.zeros(2)
            step[axis] = _STEP_PX
            pixels = [[pairs.top_px, pairs.front_px], [pairs.top_px, pairs.front_px]]
            pixels[0][view], pixels[1][view] = pixels[0][view] + step, pixels[1][view] - step
            ahead, behind = (signed_gaps(*cameras, *each) for each in pixels)
            slope[:, view, axis] = (ahead - behind) / (2.0 * _STEP_PX)
    return np.asarray(np.sqrt(np.einsum("nvi,nvij,nvj->n", slope, pairs.noise_px2, slope)), dtype=np.float64)


def px_per_mm(rig: Rig, pairs: Pairs) -> FloatArray:
    """Return the mean scale (N,) of the two views at each tip."""
    scales = [
        np.linalg.norm(CameraModel.of(rig.cameras[name]).project_with_jacobian(pairs.tip_box)[1], axis=(1, 2))
        for name in CAMERAS
    ]
    return np.asarray(np.mean(scales, axis=0) / np.sqrt(2.0), dtype=np.float64)


def derivative(values: Callable[[FloatArray], FloatArray], parameters: FloatArray) -> FloatArray:
    """Return the derivative (..., 30) of `values` by the parameters, by central differences."""
    result = []
    for column, size in enumerate(_STEPS):
        step = np.zeros(PARAMETERS)
        step[column] = size
        result.append((values(parameters + step) - values(parameters - step)) / (2.0 * size))
    return np.stack(result, axis=-1)


def delay_slope(rig: Rig, pairs: Pairs) -> FloatArray:
    """Return how the gaps (N,), mm/s, change when the front camera's clock turns out to be ahead of the top's.

    A front picture whose stamp is `d` too late was taken `d` earlier, so that its point must be carried on by `d` more.
    """
    cameras = Geometry(rig).cameras(np.zeros(PARAMETERS))
    speed_px = _pixel_speed(cameras[1], pairs)
    step = _STEP_PX / max(1e-9, float(np.abs(speed_px).max(initial=1e-9)))
    ahead = signed_gaps(*cameras, pairs.top_px, pairs.front_px + step * speed_px)
    behind = signed_gaps(*cameras, pairs.top_px, pairs.front_px - step * speed_px)
    return np.asarray((ahead - behind) / (2.0 * step), dtype=np.float64)


def session_pairs(rig: Rig, observations: Iterable[Observation], tracks: Iterable[Track], *, session: int = 0) -> Pairs:
    """Return the pairs of one session that are tracked and slow enough, in order; maybe none.

    rig: the one that the Tracks were made with; the pairs hold pixels and can judge any rig of these cameras.
    observations, tracks: as recorded, joined by `seq` and instant.
    """
    by_key = {(each.seq, each.t_ns): each for each in tracks if each.status is Status.TRACKED}
    both = [(each, by_key[each.seq, each.t_ns]) for each in observations if (each.seq, each.t_ns) in by_key]
    complete = []
    for observation, track in both:
        found = [each for name in CAMERAS if (each := observation.detection(name)) is not None and each.found]
        if len(found) == len(CAMERAS):
            complete.append((observation, track, found))
    if len(complete) < 3:
        return _no_pairs()
    cameras = [CameraModel.of(rig.cameras[name]) for name in CAMERAS]
    t_s = np.array([each.t_ns for each, _, _ in complete]) * 1e-9
    tips = np.stack([track.shape_box[0] for _, track, _ in complete if track.shape_box is not None])
    velocity, known = _velocities(t_s, tips)
    skew_s = np.array([each.skew_ns for each, _, _ in complete]) * 1e-9
    speed = np.linalg.norm(velocity, axis=1)
    usable = known & (speed * np.abs(skew_s) <= SLOWEST_CARRY_MM) & (speed <= FASTEST_MM_S)
    rows = [_row(cameras, *complete[index]) for index in np.flatnonzero(usable)]
    if not rows:
        return _no_pairs()
    pixels, noise, entries, along, shape = (np.stack(each) for each in zip(*rows, strict=True))
    pairs = Pairs(
        np.full(len(rows), session), t_s[usable], pixels[:, 0], pixels[:, 1], noise, tips[usable], velocity[usable],
        skew_s[usable], entries, along, shape,
    )  # fmt: skip
    # what is left of the skew: the front's point carried to the top's instant
    carried = pairs.front_px - _pixel_speed(cameras[1], pairs) * pairs.skew_s[:, None]
    return replace(pairs, front_px=carried)


def joined(several: Sequence[Pairs]) -> Pairs:
    """Return the pairs of several sessions as one."""
    return Pairs(*(np.concatenate([getattr(each, name) for each in several]) for name in Pairs.__dataclass_fields__))


def _no_pairs() -> Pairs:
    none, two, three = np.empty(0), np.empty((0, 2)), np.empty((0, 3))
    return Pairs(
        np.empty(0, dtype=np.int64), none, two, two, np.empty((0, 2, 2, 2)), three, three, none,
        np.empty((0, 2, 2)), three, two,
    )  # fmt: skip


def _velocities(t_s: FloatArray, tips: FloatArray) -> tuple[FloatArray, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Return velocities (N, 3) by central differences, and where both neighbours are near enough to know them."""
    velocity = np.zeros_like(tips)
    known = np.zeros(len(tips), dtype=bool)
    apart = t_s[2:] - t_s[:-2]
    known[1:-1] = (apart > 0) & (apart <= 2.0 * _NEIGHBOUR_S)
    velocity[1:-1] = (tips[2:] - tips[:-2]) / np.maximum(apart, 1e-9)[:, None]
    return velocity, known


def _pixel_speed(camera: CameraModel, pairs: Pairs) -> FloatArray:
    _, by_point = camera.project_with_jacobian(pairs.tip_box)
    return np.asarray(np.einsum("nij,nj->ni", by_point, pairs.velocity), dtype=np.float64)


def _row(
    cameras: Sequence[CameraModel], observation: Observation, track: Track, found: Sequence[Detection]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return (pixels (2, 2), noise (2, 2, 2), entry_px (2, 2), entry_along (3,), shape_px (2,)) of one pair."""
    shape = track.shape_box
    assert shape is not None
    noise = []
    for each in found:
        assert each.tip_sigma_px is not None
        normal = each.normal_px[0]
        along = np.array([-normal[1], normal[0]])
        noise.append(np.outer(normal, normal) * each.sigma_px[0] ** 2 + np.outer(along, along) * each.tip_sigma_px**2)
    pixels = np.stack([each.curve_px[0] for each in found])
    entry = np.stack([camera.project(shape[-1]) for camera in cameras])
    along_entry = shape[max(0, len(shape) - 6)] - shape[-1]
    along_entry = along_entry / max(float(np.linalg.norm(along_entry)), 1e-9)
    distances = np.array(
        [_midline_rms(camera.project(shape), each.curve_px) for camera, each in zip(cameras, found, strict=True)]
    )
    return pixels, np.stack(noise), entry, along_entry, distances


def _midline_rms(curve_px: FloatArray, measured_px: FloatArray) -> float:
    """Return the rms distance, px, of measured points (M, 2) from a projected centreline (K, 2)."""
    at = np.linspace(0.0, 1.0, len(curve_px))
    dense = np.column_stack([np.interp(np.linspace(0.0, 1.0, _DENSE), at, axis) for axis in curve_px.T])
    apart = np.square(measured_px[::4, None, :] - dense[None]).sum(axis=-1)
    nearest = np.argmin(apart, axis=1)
    inside = nearest < _DENSE - 1  # beyond the entry the measured midline goes on and the centreline does not
    first, second = dense[np.minimum(nearest, _DENSE - 2)], dense[np.minimum(nearest, _DENSE - 2) + 1]
    along = (second - first) / np.maximum(np.linalg.norm(second - first, axis=1, keepdims=True), 1e-9)
    off = measured_px[::4] - first
    across = off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]
    return float(np.sqrt(np.mean(np.square(across[inside])))) if inside.any() else 0.0
