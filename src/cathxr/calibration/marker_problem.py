"""What to tell a person whose picture shows too few fiducials, or some that cannot be told apart."""

from collections.abc import Sequence

import numpy as np

from cathxr.calibration.marker_naming import LEAST_MARKERS, Naming
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import Marker

_LEAST_WIDE, _LEAST_LONG = 0.12, 0.04
"""Least spread of the markers across their longest direction, relative to along it, and that to the picture's width."""


def spread_enough(markers: Sequence[FoundMarker], size_px: tuple[int, int]) -> bool:
    """Return whether markers lie wide enough apart, and not on one line, for a camera's pose."""
    if len(markers) < LEAST_MARKERS:
        return False
    places = np.stack([marker.centre_px for marker in markers])
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False) / np.sqrt(len(places))
    return bool(spread[1] > _LEAST_WIDE * spread[0] and spread[0] > _LEAST_LONG * size_px[0])


def pose_problem(camera: str, markers: Sequence[FoundMarker], size_px: tuple[int, int]) -> str | None:
    """Return None where these markers suffice for the camera's pose, else a sentence."""
    if len(markers) < LEAST_MARKERS:
        names = ", ".join(marker.name for marker in markers) or "none"
        return (
            f"A pose needs at least {LEAST_MARKERS} markers, and the {camera} camera's pictures have {len(markers)} "
            f"({names}): light all of them evenly, uncover them and try again, or place the others with --click."
        )
    if not spread_enough(markers, size_px):
        return (
            f"The markers that the {camera} camera sees lie nearly on one line, which leaves its pose open: "
            f"put the {camera} cross in too, or add a picture with it."
        )
    return None


def problem_of(sighting: Sighting, markers: Sequence[Marker], naming: Naming, *, round_spots: int) -> str | None:
    """Return None where what was found suffices for a pose, else which markers are missing and what to do."""
    by_name = {marker.name: marker for marker in markers}
    camera = sighting.camera
    if round_spots < LEAST_MARKERS and not sighting.markers and not naming.unsure:
        seen = "No round coloured spot was" if not round_spots else f"Only {round_spots} round coloured spots were"
        return (
            f"{seen} found in the {camera} picture: is the cross in, is it lit from the front (before the back-light "
            "alone it looks black), and is the picture sharp and not over-exposed?"
        )
    if naming.why == "few" and naming.unsure and sighting.missing and not sighting.ambiguous:
        gone = _named([by_name[name] for name in sighting.missing])
        verb, pronoun = ("was", "is it") if len(sighting.missing) == 1 else ("were", "are they")
        likely = _named([markers[m] for m in naming.unsure])
        return (
            f"{gone} {verb} not found in the {camera} picture: {pronoun} hidden, in shadow or in glare? What is left "
            f"({likely}) is too little to prove which spots are markers: uncover all of them, light them evenly and "
            "try again, or place them by hand (--click)."
        )
    if naming.why in ("none", "few") and not sighting.ambiguous:
        expected = _named([by_name[name] for name in sighting.missing])
        return (
            f"The coloured spots in the {camera} picture do not form the rig's crosses ({expected} expected): is this "
            f"the {camera} camera's picture, not mirrored, and do [markers] say where each colour is? Are markers "
            "hidden or in shadow? The picture shows what was seen; --click lets you place them."
        )
    if naming.why == "apart":
        return (
            f"The spots found in the {camera} picture miss the rig's [markers] by {naming.rms_px:.1f} px: "
            "check the markers' positions and the camera's intrinsics."
        )
    if naming.why == "chance":
        return (
            f"There are too many coloured spots in the {camera} picture to be sure which are the markers: cover or "
            "remove the others, or put both crosses in."
        )
    parts = []
    if sighting.ambiguous:
        several = _named([by_name[name] for name in sighting.ambiguous])
        parts.append(f"More than one spot would do for {several}: cover or remove what has the same colour")
    if sighting.missing:
        gone = _named([by_name[name] for name in sighting.missing])
        verb = "was" if len(sighting.missing) == 1 else "were"
        parts.append(f"{gone} {verb} not found: hidden, in shadow, in glare, or outside the picture?")
    general = pose_problem(camera, sighting.markers, sighting.size_px)
    if general is None:
        return None
    return ". ".join([*(part.rstrip(".") if part.endswith(".") else part for part in parts), general]).replace(
        "?.", "?"
    )


def _named(markers: Sequence[Marker]) -> str:
    """Return "mT1 (red), mT2 (green) and mT3 (blue)"."""
    each = [f"{marker.name} ({marker.colour})" for marker in markers]
    return each[0] if len(each) == 1 else ", ".join(each[:-1]) + " and " + each[-1] if each else "none"
