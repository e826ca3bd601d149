"""Which of the rig's cameras took a picture, by the fiducials in it."""

from typing import Literal

from cathxr.calibration.marker_finding import find_markers
from cathxr.calibration.poses import calibrate_poses
from cathxr.core import CathxrError, PixelArray, Rig

_BETTER = 3.0
_FLOOR_PX = 0.2
_DATE = "1970-01-01"  # of a result that is thrown away


def suggested_role(rig: Rig, pixels: PixelArray) -> Literal["", "top", "front"]:
    """Return which camera the fiducials in a picture say it is of, "" where they do not say.

    The two crosses are made alike, so that one of them alone looks the same from its own camera, whichever that is.
    With both in the box, each camera sees its own from the face and the other's edge-on, which only one role explains.
    """
    fits: dict[Literal["top", "front"], tuple[int, float]] = {}
    for role in ("top", "front"):
        fit = _fit(rig, role, pixels)
        if fit is not None:
            fits[role] = fit
    if len(fits) == 1:
        ((role, (count, _)),) = fits.items()
        return role if count > 4 else ""
    if len(fits) < 2:
        return ""
    (count_top, rms_top), (count_front, rms_front) = fits["top"], fits["front"]
    if count_top != count_front:
        return "top" if count_top > count_front else "front"
    if max(rms_top, rms_front) < _BETTER * max(min(rms_top, rms_front), _FLOOR_PX):
        return ""
    return "top" if rms_top < rms_front else "front"


def _fit(rig: Rig, role: Literal["top", "front"], pixels: PixelArray) -> tuple[int, float] | None:
    """Return how many fiducials a role explains and how well, px; None where it explains no pose."""
    camera = rig.cameras[role]
    if camera.size_px != (pixels.shape[1], pixels.shape[0]):
        return None
    try:
        sighting = find_markers(rig, role, pixels)
        if sighting.problem is not None:
            return None
        result = calibrate_poses(rig, (sighting,), date=_DATE)
    except CathxrError:
        return None
    return sum(each.used for each in result.residuals), result.rms_px[role]
