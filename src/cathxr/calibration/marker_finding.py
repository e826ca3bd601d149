"""Find the colour-coded fiducials in one camera's picture: by colour and geometry, each to a fraction of a pixel."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cathxr.calibration.marker_blobs import Spots, find_spots, hues
from cathxr.calibration.marker_colours import check_colours, log_scores, nearest_colour
from cathxr.calibration.marker_measuring import centres, measured
from cathxr.calibration.marker_naming import Naming, naming_of
from cathxr.calibration.marker_problem import problem_of
from cathxr.calibration.marker_search import Scene, all_hypotheses, near_hypotheses
from cathxr.calibration.sighting import Blob, FoundMarker, Sighting
from cathxr.core import CalibrationError, Marker, PixelArray, Rig
from cathxr.geometry import CameraModel

_GREY_DN = 3.0
"""Fiducials are alike where their true sizes agree to this; one that is off by more is measured again as such."""


def find_markers(rig: Rig, camera: str, pixels: PixelArray, *, near: bool = True) -> Sighting:
    """Return which fiducials a picture (H, W, 3) BGR uint8 of `camera` shows, and where.

    Both crosses are looked for; which of them are in is found out. near: the camera stands within about 40 mm and 15
    degrees of the rig's pose, which is tried first; else, and where that fails, anywhere, turned pictures included.
    What is not sure is not named: `Sighting.problem` then says what to do.

    Raises:
        CalibrationError: no such camera, no markers, colours that cannot be told apart, or another size than the rig's.
        ValueError: not a picture.
    """
    markers, own = markers_of(rig, camera)
    check_colours(markers)
    checked_picture(rig, camera, pixels)
    size = rig.cameras[camera].size_px
    if pixels.ndim == 2 or not _has_colour(pixels):
        sentence = (
            "The picture has no colour, and the fiducials are told apart by colour: take it with a colour camera, "
            "lit from the front and not over-exposed, or place the markers by hand with --click."
        )
        return Sighting(camera, size, missing=tuple(m.name for m in markers[: int(own.sum())]), problem=sentence)
    model = CameraModel.of(rig.cameras[camera])
    spots = find_spots(model, pixels)
    naming, scene, index = _best_naming(model, markers, own, spots, near=near)
    spots, naming = measured(pixels, spots, naming, scene, index)
    return _sighting(rig, camera, markers, own, spots, naming, scene, index)


def markers_of(rig: Rig, camera: str) -> tuple[tuple[Marker, ...], NDArray[np.bool_]]:
    """Return all the rig's markers, the camera's own cross first, and which (M,) are its own.

    Raises:
        CalibrationError: no such camera, or a rig without markers.
    """
    if camera not in rig.cameras:
        raise CalibrationError(f"The rig {rig.name!r} has no camera {camera!r}; it has {', '.join(rig.cameras)}.")
    mine = rig.markers.get(camera, ())
    others = tuple(marker for name, cross in rig.markers.items() if name != camera for marker in cross)
    if not mine and not others:
        raise CalibrationError(f"The rig {rig.name!r} has no [markers]: write down where its fiducials are first.")
    return mine + others, np.arange(len(mine) + len(others)) < len(mine)


def checked_picture(rig: Rig, camera: str, pixels: PixelArray) -> None:
    """Return nothing; refuse what is not a picture of the camera's size.

    Raises:
        ValueError: not a picture; CalibrationError: another size than the rig's.
    """
    if not isinstance(pixels, np.ndarray) or pixels.dtype != np.uint8 or pixels.ndim not in (2, 3):
        raise ValueError("pixels: expected a picture, uint8, of shape (H, W, 3) BGR or (H, W)")
    if pixels.ndim == 3 and pixels.shape[2] != 3:
        raise ValueError(f"pixels: expected three channels, BGR, got {pixels.shape[2]}")
    width, height = rig.cameras[camera].size_px
    if pixels.shape[:2] != (height, width):
        raise CalibrationError(
            f"The picture of the {camera} camera is {pixels.shape[1]}x{pixels.shape[0]}, "
            f"the rig's camera takes {width}x{height}: give a picture of that camera, as it comes from it."
        )


def _has_colour(pixels: PixelArray) -> bool:
    few = pixels[::3, ::3]
    return bool((few.max(axis=2) - few.min(axis=2)).max() > _GREY_DN)


def _best_naming(
    model: CameraModel, markers: tuple[Marker, ...], own: NDArray[np.bool_], spots: Spots, *, near: bool
) -> tuple[Naming, Scene, NDArray[np.int64]]:
    """Return the best naming of the round spots, its scene, and which spots (B,) are in it."""
    index = np.array([i for i, spot in enumerate(spots.spots) if not spot.why], dtype=np.int64)
    round_spots = [spots.spots[i] for i in index]
    whites = [spots.white]
    if np.abs(spots.white - 1.0).max() > 0.06:
        whites.append(np.ones(3))
    scenes = []
    for white in whites:
        fits = log_scores(hues(spots, white=white)[index], [marker.colour for marker in markers])
        scenes.append(
            Scene(
                model,
                np.stack([marker.position_mm for marker in markers]),
                own,
                np.array([spot.centre_px for spot in round_spots]).reshape(-1, 2),
                np.array([spot.radius_px for spot in round_spots]),
                np.array([spot.sigma_px for spot in round_spots]),
                np.ascontiguousarray(fits),
            )
        )
    chosen: tuple[Naming, Scene] | None = None
    for search in (near_hypotheses, all_hypotheses) if near else (all_hypotheses,):
        for scene in scenes:
            naming = naming_of(scene, search(scene) if len(index) > 2 else [])
            if chosen is None or _better(naming, chosen[0]):
                chosen = naming, scene
        if chosen is not None and not chosen[0].why:
            break
    assert chosen is not None
    return chosen[0], chosen[1], index


def _better(naming: Naming, other: Naming) -> bool:
    """Return whether one naming is to be preferred to an earlier one."""
    first, second = int((naming.named >= 0).sum()), int((other.named >= 0).sum())
    if first != second:
        return first > second
    if naming.hypothesis is None or other.hypothesis is None:
        return naming.hypothesis is not None
    return bool(first) and naming.hypothesis.score > other.hypothesis.score


def _sighting(
    rig: Rig,
    camera: str,
    markers: tuple[Marker, ...],
    own: NDArray[np.bool_],
    spots: Spots,
    naming: Naming,
    scene: Scene,
    index: NDArray[np.int64],
) -> Sighting:
    """Return what was found, in words and numbers."""
    size = rig.cameras[camera].size_px
    crosses = [own, ~own]
    is_in = [bool((naming.named[cross] >= 0).any()) for cross in crosses]
    if not any(is_in):
        is_in = [bool(own.any()), not own.any()]
    there = crosses[0] * is_in[0] + crosses[1] * is_in[1]
    missing = tuple(
        marker.name
        for m, marker in enumerate(markers)
        if there[m] and naming.named[m] < 0 and m not in naming.doubtful and m not in naming.unsure
    )
    ambiguous = tuple(markers[m].name for m in naming.doubtful)
    found = []
    for cross in crosses:
        named = {m: spots.spots[index[naming.named[m]]] for m in np.flatnonzero(cross & (naming.named >= 0)).tolist()}
        places = {} if naming.hypothesis is None else centres(scene, cross, named, naming.hypothesis)
        for m, place in places.items():
            marker = markers[m]
            found.append(FoundMarker(marker.name, marker.colour, place, named[m].sigma_px, named[m].radius_px))
    blobs = _blobs(markers, spots, naming, index, missing)
    sighting = Sighting(camera, size, tuple(found), blobs, missing, ambiguous)
    return replace(sighting, problem=problem_of(sighting, markers, naming, round_spots=len(index)))


def _blobs(
    markers: tuple[Marker, ...], spots: Spots, naming: Naming, index: NDArray[np.int64], missing: tuple[str, ...]
) -> tuple[Blob, ...]:
    """Return everything that was considered, and where missing markers were expected."""
    taken = {int(index[b]): markers[m].name for m, b in enumerate(naming.named) if b >= 0}
    likely = {} if naming.hypothesis is None else {int(index[naming.hypothesis.named[m]]): m for m in naming.unsure}
    colours = sorted({marker.colour for marker in markers})
    shades = hues(spots, white=spots.white)
    blobs = []
    for i, spot in enumerate(spots.spots):
        why = "" if i in taken else spot.why or "not a marker's place"
        if i in likely:
            marker = markers[likely[i]]
            blobs.append(Blob(marker.colour, spot.centre_px, spot.radius_px, marker.name, "likely, not sure"))
            continue
        colour = nearest_colour(float(shades[i]), colours)
        blobs.append(Blob(colour, spot.centre_px, spot.radius_px, taken.get(i, ""), why))
    if naming.hypothesis is not None:
        radius = float(np.median([spots.spots[i].radius_px for i in [*taken, *likely]])) if taken or likely else 8.0
        for m, marker in enumerate(markers):
            if marker.name in missing and np.isfinite(naming.places[m]).all():
                blobs.append(Blob(marker.colour, naming.places[m], radius, marker.name, "not found"))
    return tuple(blobs)
