"""Which spot is which marker: hypotheses of the camera's pose, grown to all the spots that lie where a marker must.

Near the expected pose, two named spots and what is expected of the camera place the others. Without an expectation,
three named spots do (P3P); of a cross that lies flat the camera's own one is taken.
"""

from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.calibration import marker_pose_kernels as kernels
from cathxr.core import FloatArray
from cathxr.geometry import CameraModel

NEAR_TURN_RAD, NEAR_SHIFT_MM = float(np.deg2rad(8.0)), 22.0
"""One sigma of how the camera may stand against the rig's pose: 15 degrees and 40 mm are within two."""
_ANY_TURN_RAD, _ANY_SHIFT_MM = 1e3, 1e6
_PLACE_PX, _PLACE_MM = 0.5, 0.2
"""How well markers and lens of a rig that is not calibrated yet are known, in the picture and on the cross."""
_LEAST_FACING = 0.5
"""A camera anywhere still looks at its own cross from its own side, within 60 degrees of the rig's direction: seen from
behind, a cross is its own mirror image, and seen from the side it is the other cross."""
_MOST_RATIO = 1.7
_GATE = 16.0
_MOST_STARTS, _MOST_TRIPLES = 1500, 2500
_PER_MARKER = 9.0
_SIZE_SIGMA = 0.2


@dataclass(frozen=True, eq=False)
class Scene:
    """What is to be matched: markers (M,) by points (M, 3) mm and `own` (M,) cross or not; spots (B,) by pixels (B, 2),
    radii (B,), sigmas (B,) px. fits (M, B): log score of each spot's colour for each marker, -inf where it is another.
    """

    model: CameraModel
    points: FloatArray
    own: NDArray[np.bool_]
    pixels: FloatArray
    radii: FloatArray
    sigmas: FloatArray
    fits: FloatArray

    @property
    def lens(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Focal lengths, centre, distortion, as the kernels take them."""
        intrinsics = self.model.intrinsics
        return intrinsics.focal_px, intrinsics.centre_px, intrinsics.distortion

    @property
    def px_per_mm(self) -> float:
        """The scale of the picture where the markers are, by the rig's pose."""
        depth = float(np.median(self.model.to_camera(self.points)[:, 2]))
        return float(self.model.intrinsics.focal_px.mean()) / max(abs(depth), 1.0)

    @property
    def tolerances(self) -> FloatArray:
        """Standard deviation (B,), px, of spots about where a rig that is not calibrated yet has its markers."""
        return np.asarray(np.sqrt(self.sigmas**2 + _PLACE_PX**2 + (_PLACE_MM * self.px_per_mm) ** 2))


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """named (M,): each marker's spot or -1; camera_from_box as rotation (3, 3) and translation (3,) mm; its score."""

    named: NDArray[np.int64]
    rotation: FloatArray
    translation: FloatArray
    score: float

    @property
    def count(self) -> int:
        """How many markers have a spot."""
        return int((self.named >= 0).sum())


def near_hypotheses(scene: Scene) -> list[Hypothesis]:
    """Return hypotheses near the rig's pose, the best first."""
    prior = _prior(scene.model, NEAR_TURN_RAD, NEAR_SHIFT_MM)
    starts = _pairs(scene)
    if not len(starts):
        return []
    answer = kernels.sweep(*(*_problem(scene), prior, starts, _MOST_RATIO, _GATE))
    return _ranked(scene, list(zip(*answer, strict=True)))


def all_hypotheses(scene: Scene) -> list[Hypothesis]:
    """Return hypotheses of a camera that may stand anywhere, the best first."""
    prior = _prior(scene.model, _ANY_TURN_RAD, _ANY_SHIFT_MM)
    try:
        flat = scene.model.undistort(scene.pixels)
    except ValueError:
        return []
    found: list[tuple[NDArray[np.int64], FloatArray, FloatArray, float]] = []
    for triple, spots in _triples(scene):
        if any((named[triple] == spots).all() and (named >= 0).sum() >= 4 for named, *_ in found):
            continue
        _, turns, shifts = cv2.solveP3P(
            scene.points[triple], flat[spots], np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_AP3P
        )
        for turn, shift in zip(turns, shifts, strict=True):
            rotation, translation = cv2.Rodrigues(turn)[0], np.asarray(shift, dtype=np.float64).ravel()
            sizes = (scene.points[triple] @ rotation[2] + translation[2]) * scene.radii[spots]
            if not (np.isfinite(sizes).all() and sizes.min() > 0 and sizes.max() < _MOST_RATIO * sizes.min()):
                continue
            if rotation[2] @ prior[0][2] < _LEAST_FACING:
                continue
            named = np.full(len(scene.points), -1, dtype=np.int64)
            named[triple] = spots
            answer = kernels.grow(*(*_problem(scene), prior, rotation, translation, named, _MOST_RATIO, _GATE))
            if answer[2] < np.inf and (named >= 0).sum() >= 4:
                found.append((named, *answer))
    return _ranked(scene, found)


def refitted(scene: Scene, hypothesis: Hypothesis, named: NDArray[np.int64]) -> tuple[Hypothesis, FloatArray]:
    """Return a hypothesis fitted to other names, its own pose expected but weakly, and its normals (6, 6)."""
    prior = (hypothesis.rotation, _centre(hypothesis), NEAR_TURN_RAD, NEAR_SHIFT_MM)
    use = named >= 0
    spots = named[use]
    rotation, translation, normal, _, _ = kernels.fit(
        scene.points[use], scene.pixels[spots], scene.tolerances[spots], scene.lens, prior,
        hypothesis.rotation, hypothesis.translation, 15,
    )  # fmt: skip
    return Hypothesis(named, rotation, translation, hypothesis.score), normal


def predicted(scene: Scene, hypothesis: Hypothesis, normal: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return places (M, 2) px, their covariance (M, 2, 2) by the pose's normals (6, 6), and depths (M,) mm."""
    places, spreads = np.full((len(scene.points), 2), np.inf), np.full((len(scene.points), 2, 2), np.inf)
    depths = scene.points @ hypothesis.rotation[2] + hypothesis.translation[2]
    covariance = np.linalg.inv(normal)
    jacobian, residual = np.empty((2, 6)), np.empty(2)
    nowhere = np.zeros(2)
    for i, point in enumerate(scene.points):
        pose = hypothesis.rotation, hypothesis.translation
        if kernels.rows_of(point, nowhere, *pose, scene.lens, 1.0, jacobian, residual):
            places[i] = -residual
            spreads[i] = jacobian @ covariance @ jacobian.T
    return places, spreads, depths


def _problem(scene: Scene) -> tuple[Any, ...]:
    """Return the scene as the kernels take it."""
    return scene.points, scene.pixels, scene.radii, scene.fits, scene.tolerances, scene.lens


def _prior(model: CameraModel, turn_rad: float, shift_mm: float) -> tuple[FloatArray, FloatArray, float, float]:
    return model.camera_from_box.rotation, model.centre_box, turn_rad, shift_mm


def _centre(hypothesis: Hypothesis) -> FloatArray:
    return np.asarray(-hypothesis.rotation.T @ hypothesis.translation)


def _pairs(scene: Scene) -> NDArray[np.int64]:
    """Return (S, 4) starts, marker, spot, marker, spot, the likeliest first."""
    fits, radii = scene.fits, scene.radii
    rows, scores = [], []
    for m, n in combinations(range(len(scene.points)), 2):
        for b, c in product(np.flatnonzero(np.isfinite(fits[m])), np.flatnonzero(np.isfinite(fits[n]))):
            if b != c and max(radii[b], radii[c]) < _MOST_RATIO**2 * min(radii[b], radii[c]):
                rows.append((m, b, n, c))
                scores.append(fits[m, b] + fits[n, c] + float(scene.own[m]) + float(scene.own[n]))
    order = np.argsort(-np.array(scores), kind="stable")[:_MOST_STARTS]
    return np.array(rows, dtype=np.int64).reshape(-1, 4)[order]


def _triples(scene: Scene) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Return markers (3,) and spots (3,) to start from, the likeliest first, the own cross's where it can."""
    markers = np.flatnonzero(scene.own) if scene.own.sum() >= 3 else np.arange(len(scene.points))
    found = []
    for triple in combinations(markers[:8], 3):
        choices = [np.flatnonzero(np.isfinite(scene.fits[m])) for m in triple]
        for spots in product(*choices):
            if len(set(spots)) == 3 and not _in_line(scene.pixels[list(spots)]):
                score = sum(scene.fits[m, b] for m, b in zip(triple, spots, strict=True))
                found.append((score, np.array(triple), np.array(spots)))
            if len(found) > 40 * _MOST_TRIPLES:
                break
    found.sort(key=lambda each: -each[0])
    return [(triple, spots) for _, triple, spots in found[:_MOST_TRIPLES]]


def _in_line(pixels: FloatArray) -> bool:
    """Return whether three points (3, 2) lie nearly on a line."""
    a, b = pixels[1] - pixels[0], pixels[2] - pixels[0]
    longest = max(float(a @ a), float(b @ b), float((a - b) @ (a - b)), 1e-9)
    return bool(abs(a[0] * b[1] - a[1] * b[0]) < 0.05 * longest)


def _ranked(scene: Scene, found: list[tuple[NDArray[np.int64], FloatArray, FloatArray, float]]) -> list[Hypothesis]:
    """Return hypotheses, each set of names once, the best score first."""
    best: dict[bytes, Hypothesis] = {}
    for named, rotation, translation, cost in found:
        use = np.flatnonzero(named >= 0)
        sizes = np.log(scene.radii[named[use]] * (scene.points[use] @ rotation[2] + translation[2]))
        uneven = float(np.sum(((sizes - np.median(sizes)) / _SIZE_SIGMA) ** 2))
        score = float(_PER_MARKER * len(use) + scene.fits[use, named[use]].sum() - 0.5 * (cost + uneven))
        key = named.tobytes()
        if key not in best or best[key].score < score:
            best[key] = Hypothesis(named.copy(), rotation, translation, score)
    return sorted(best.values(), key=lambda each: -each.score)
