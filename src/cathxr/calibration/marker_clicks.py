"""Markers that a person placed, and several pictures of one camera as one."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cathxr.calibration.marker_blobs import Spot, find_spots
from cathxr.calibration.marker_finding import checked_picture, markers_of
from cathxr.calibration.marker_problem import pose_problem
from cathxr.calibration.marker_refine import refined
from cathxr.calibration.sighting import Blob, FoundMarker, Sighting
from cathxr.core import CalibrationError, FloatArray, PixelArray, Rig
from cathxr.geometry import CameraModel

_CLICK_SIGMA_PX = 1.5
_CLICK_REACH = 1.3
_REFINE_REACH = 0.5
"""Of a spot's radius: a click within the first takes it; its corrected centre stays within the second of its rim's."""
_APART_SIGMAS, _APART_PX = 5.0, 0.5


def sighting_from_points(rig: Rig, camera: str, pixels: PixelArray, points: Mapping[str, FloatArray]) -> Sighting:
    """Return the markers that a person placed: points maps names to (2,) raw px in a picture (H, W, 3) or (H, W).

    Each is moved to the centre of the round coloured spot under it, where there is one; else the click counts as it is,
    to 1.5 px.

    Raises:
        CalibrationError: no such camera or marker, a point outside the picture, two points on one spot, or another size
            of picture than the rig's.
        ValueError: not a picture.
    """
    markers, _ = markers_of(rig, camera)
    checked_picture(rig, camera, pixels)
    by_name = {marker.name: marker for marker in markers}
    for name in points:
        if name not in by_name:
            raise CalibrationError(f"There is no marker {name!r} in the rig; it has {', '.join(by_name)}.")
    model = CameraModel.of(rig.cameras[camera])
    colour = pixels if pixels.ndim == 3 else np.repeat(pixels[..., None], 3, axis=2)
    spots = find_spots(model, np.ascontiguousarray(colour)).spots
    found, taken = [], dict[int, str]()
    for name, point in points.items():
        place = np.asarray(point, dtype=np.float64).reshape(2)
        if not np.isfinite(place).all() or not model.inside(place):
            raise CalibrationError(f"Marker {name} was placed outside the {camera} picture: place it again.")
        which = _under(spots, place)
        if which is None:
            found.append(FoundMarker(name, by_name[name].colour, place, _CLICK_SIGMA_PX, 0.0, placed=True))
            continue
        if which in taken:
            raise CalibrationError(f"{taken[which]} and {name} were placed on the same spot: move one of them.")
        taken[which] = name
        rough = spots[which]
        reach = _REFINE_REACH * rough.radius_px
        exact = refined(model, colour, rough, place_px=rough.centre_px, reach_px=reach)
        spot = exact or replace(rough, sigma_px=_CLICK_SIGMA_PX)
        found.append(
            FoundMarker(name, by_name[name].colour, spot.centre_px, spot.sigma_px, spot.radius_px, placed=True)
        )
    blobs = tuple(Blob(each.colour, each.centre_px, each.radius_px, each.name) for each in found)
    size = rig.cameras[camera].size_px
    return Sighting(camera, size, tuple(found), blobs, (), (), pose_problem(camera, found, size))


def merged(sightings: Sequence[Sighting]) -> Sighting:
    """Return what several pictures of one camera show together: each marker once, the mean where several show it.

    A marker that lies elsewhere in two pictures (the camera or the cross was moved) is left out as ambiguous.

    Raises:
        ValueError: no sightings, or of several cameras or sizes.
    """
    if not sightings or len({(each.camera, each.size_px) for each in sightings}) != 1:
        raise ValueError("sightings: expected at least one, all of one camera and one size of picture")
    first = sightings[0]
    if len(sightings) == 1:
        return first
    by_name: dict[str, list[FoundMarker]] = {}
    for sighting in sightings:
        for marker in sighting.markers:
            by_name.setdefault(marker.name, []).append(marker)
    found, moved = [], []
    for name, several in by_name.items():
        if _apart(several):
            moved.append(name)
        else:
            found.append(_mean(several))
    unclear = {name for each in sightings for name in each.ambiguous} - set(by_name)
    gone = {name for each in sightings for name in each.missing} - set(by_name) - unclear
    problem = pose_problem(first.camera, found, first.size_px)
    if moved:
        problem = (
            f"{', '.join(sorted(moved))} lie elsewhere in another picture of the {first.camera} camera: "
            "the camera or the cross was moved between them. Take the pictures again without touching the box."
        )
    blobs = tuple(blob for each in sightings for blob in each.blobs if blob.name not in gone or not blob.why)
    ambiguous = tuple(sorted(unclear | set(moved)))
    return Sighting(first.camera, first.size_px, tuple(found), blobs, tuple(sorted(gone)), ambiguous, problem)


def _under(spots: Sequence[Spot], place: FloatArray) -> int | None:
    """Return the round spot that a click is on, None where there is none."""
    ratios = [
        float(np.hypot(*(spot.centre_px - place))) / spot.radius_px if spot.outline is not None else np.inf
        for spot in spots
    ]
    best = int(np.argmin(ratios)) if ratios else -1
    return best if best >= 0 and ratios[best] < _CLICK_REACH else None


def _apart(several: Sequence[FoundMarker]) -> bool:
    """Return whether sightings of one marker disagree by more than their errors."""
    middle = _mean(several).centre_px
    return any(
        float(np.hypot(*(each.centre_px - middle))) > _APART_PX + _APART_SIGMAS * each.sigma_px for each in several
    )


def _mean(several: Sequence[FoundMarker]) -> FoundMarker:
    """Return one marker for several sightings of it; errors of light and shape are common to all of them."""
    weight = np.array([each.sigma_px**-2 for each in several])
    centre = np.average([each.centre_px for each in several], axis=0, weights=weight)
    sigma = max(float(weight.sum() ** -0.5), 0.5 * min(each.sigma_px for each in several))
    radius = float(np.average([each.radius_px for each in several], weights=weight))
    return replace(several[0], centre_px=centre, sigma_px=sigma, radius_px=radius)
