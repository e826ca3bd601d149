"""Named spots measured to the last: all fiducials are of one size, balls or discs, and each lies where it was named."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cathxr.calibration.marker_blobs import Spot, Spots
from cathxr.calibration.marker_naming import Naming
from cathxr.calibration.marker_outline import disc_centre
from cathxr.calibration.marker_refine import refined
from cathxr.calibration.marker_search import Hypothesis, Scene
from cathxr.core import FloatArray, PixelArray, Pose
from cathxr.geometry import CameraModel

_ALIKE, _OFF_SIZE, _WHOLE = 0.04, 0.03, 0.8
"""Fiducials are alike where their true sizes agree to the first; one that is off by the second, or shows less than the
third of its rim, is measured again as such."""
_REACH_SIGMAS = 3.0
_DISC_GAIN = 0.8
_DISC_FROM_PX = 6.0


def measured(
    pixels: PixelArray, spots: Spots, naming: Naming, scene: Scene, index: NDArray[np.int64]
) -> tuple[Spots, Naming]:
    """Return the spots, the named ones measured to the last, and the names without those that cannot be measured.

    index (B,): which of the spots the scene's are. Each is measured by itself first, then, where it is not whole,
    knowing that all are of one size.
    """
    if naming.hypothesis is None:
        return spots, naming
    named = {int(index[b]): m for m, b in enumerate(naming.named) if b >= 0}
    places = scene.points @ naming.hypothesis.rotation.T + naming.hypothesis.translation
    far = np.linalg.norm(places, axis=1)
    reach = _REACH_SIGMAS * scene.tolerances

    def measure(i: int, half_angle_rad: float | None = None) -> Spot | None:
        m, spot = named[i], spots.spots[i]
        near = float(reach[naming.named[m]])
        place = naming.places[m]
        return refined(scene.model, pixels, spot, place_px=place, reach_px=near, half_angle_rad=half_angle_rad)

    result = {i: spot for i in named if (spot := measure(i)) is not None}
    whole = [i for i, spot in result.items() if spot.rim.share > _WHOLE]
    sizes = np.array([far[named[i]] * np.sin(result[i].rim.half_angle_rad) for i in whole])
    if len(sizes) > 2 and np.median(np.abs(sizes / np.median(sizes) - 1.0)) < _ALIKE:
        size = float(np.median(sizes))
        odd = {i for i, each in zip(whole, sizes, strict=True) if abs(each / size - 1.0) > _OFF_SIZE}
        for i in odd | (set(named) - set(whole)):
            again = measure(i, float(np.arcsin(size / far[named[i]])))
            if again is not None:
                result[i] = again
    kept, every = naming.named.copy(), list(spots.spots)
    for i, m in named.items():
        if i in result:
            every[i] = result[i]
        else:
            every[i], kept[m] = replace(every[i], why="too much of its rim is hidden"), -1
    return replace(spots, spots=tuple(every)), replace(naming, named=kept)


def centres(
    scene: Scene, cross: NDArray[np.bool_], named: dict[int, Spot], hypothesis: Hypothesis
) -> dict[int, FloatArray]:
    """Return where each named marker of a cross projects, (2,) px: as a ball, or as a disc where that suits all better.

    cross (M,): which markers are its; named: the spot of each marker that has one.
    """
    as_balls = {m: spot.centre_px for m, spot in named.items()}
    if len(named) < 3 or min(spot.radius_px for spot in named.values()) < _DISC_FROM_PX:
        return as_balls
    places = scene.points[cross]
    normal = np.linalg.svd(places - places.mean(axis=0))[2][2]
    pose = Pose.from_matrix(hypothesis.rotation, hypothesis.translation)
    model = CameraModel(scene.model.intrinsics, pose, scene.model.size_px)
    as_discs, error = dict[int, FloatArray](), 0.0
    for m, spot in named.items():
        disc = disc_centre(model, spot.rim, scene.points[m], normal)
        if disc is None:
            return as_balls
        as_discs[m], error = disc[0], error + disc[1] ** 2
    return as_discs if error < _DISC_GAIN * sum(spot.rim.rms_px**2 for spot in named.values()) else as_balls
