"""What both cameras' pictures say about the set-up: light, focus, fiducials, and which camera is which."""

from collections.abc import Iterator, Mapping
from typing import Literal

from cathxr.calibration import picture_checks as limits
from cathxr.calibration.marker_finding import find_markers
from cathxr.calibration.sighting import Sighting
from cathxr.core import PixelArray, Rig
from cathxr.runtime.calibration_roles import suggested_role
from cathxr.runtime.setup_nouns import SetupCheck

Camera = Literal["top", "front"]
Said = Literal["", "right", "swapped"]
CAMERAS: tuple[Camera, ...] = ("top", "front")
_ASK = "put both crosses in with the front light on; or hold a hand before the upper camera and say what you see"
_SWAP = "exchange the two devices in config.toml, or let cathxr calibrate cameras choose them, and start again"
_CROSSES = "put both crosses in, front light on, and check again"


def light_checks(rig: Rig, camera: Camera, pixels: PixelArray, *, t_ns: int | None = None) -> Iterator[SetupCheck]:
    """Yield exposure, back light and focus of a picture (H, W, 3) BGR uint8 of the box without crosses, back light on.

    The mean of several pictures is better than one: noise looks like sharp edges.
    """
    found = limits.light_and_focus(pixels, rig.cameras[camera], rig.roi)
    low, high = limits.LEVELS
    told = f"brightest part {100 * found.level:.0f} %, {100 * found.saturated:.2f} % saturated"
    what = f"exposure, {camera}"
    if found.saturated > limits.MOST_SATURATED or found.level > high:
        then = "shorten the exposure or dim the back light"
        yield SetupCheck("light", what, "wrong", told, then, camera, t_ns)
    elif found.level < low:
        then = "is the back light on? lengthen the exposure or turn it up"
        yield SetupCheck("light", what, "wrong", told, then, camera, t_ns)
    else:
        yield SetupCheck("light", what, "good", told, camera=camera, t_ns=t_ns)
    what, told = f"back light, {camera}", f"darkest over brightest part of the ROI: {found.evenness:.2f}"
    if found.evenness < limits.LEAST_EVENNESS:
        then = "look for LED rows that are out, and at the camera's distance and tilt"
        yield SetupCheck("light", what, "wrong", told, then, camera, t_ns)
    else:
        yield SetupCheck("light", what, "good", told, camera=camera, t_ns=t_ns)
    what = f"focus, {camera}"
    if found.blur_px is None:
        then = "put the inlet in; its edge is what is looked at"
        yield SetupCheck("focus", what, "unknown", "no edge to tell by", then, camera, t_ns)
    elif found.blur_px > limits.MOST_BLUR_PX:
        told = f"edges {found.blur_px:.1f} px wide"
        then = "turn the lens until the inlet is sharpest, then lock its ring"
        yield SetupCheck("focus", what, "wrong", told, then, camera, t_ns)
    else:
        yield SetupCheck("focus", what, "good", f"edges {found.blur_px:.1f} px wide", camera=camera, t_ns=t_ns)


def sightings(rig: Rig, pictures: Mapping[Camera, PixelArray]) -> dict[Camera, Sighting]:
    """Return which fiducials each camera's picture shows; nothing for a rig without fiducials."""
    return {name: find_markers(rig, name, pixels) for name, pixels in pictures.items()} if rig.markers else {}


def crosses_are_in(seen: Mapping[Camera, Sighting]) -> bool:
    """Return whether a cross is in the box: a fiducial was named, or would be if another were seen."""
    return any(each.markers or each.ambiguous for each in seen.values())


def marker_check(rig: Rig, seen: Sighting, *, t_ns: int | None = None) -> SetupCheck:
    """Return how many of the rig's fiducials a camera sees, both crosses in and lit from the front."""
    camera: Camera = "top" if seen.camera == "top" else "front"
    own = [each.name for each in rig.markers.get(camera, ())]
    found = [each.name for each in seen.markers]
    told = f"{len(found)} of {sum(len(each) for each in rig.markers.values())}: {', '.join(found) or 'none'}"
    what = f"fiducials, {camera}"
    if seen.problem is not None:
        return SetupCheck("markers", what, "wrong", told, seen.problem, camera, t_ns)
    if missing := [each for each in seen.missing if each in own]:
        then = f"not seen: {', '.join(missing)}; light them, clean them, move the finger"
        return SetupCheck("markers", what, "warn", told, then, camera, t_ns)
    return SetupCheck("markers", what, "good", told, camera=camera, t_ns=t_ns)


def which_check(rig: Rig, pictures: Mapping[Camera, PixelArray], *, t_ns: int | None = None) -> SetupCheck:
    """Return whether each picture is of the camera whose name it bears, by both crosses' fiducials in it."""
    says = {name: suggested_role(rig, pixels) for name, pixels in pictures.items()}
    told = ", ".join(f"{name} looks like {role or 'neither'}" for name, role in says.items())
    what = "which camera is which"
    if any(role not in ("", name) for name, role in says.items()):
        return SetupCheck("which", what, "wrong", told, _SWAP, t_ns=t_ns)
    if says and all(role == name for name, role in says.items()):
        return SetupCheck("which", what, "good", told, t_ns=t_ns)
    return SetupCheck("which", what, "unknown", told, _ASK, t_ns=t_ns)


def which_said(said: Said, *, t_ns: int | None = None) -> SetupCheck:
    """Return what a person says of which camera is which, who held a hand before the upper one."""
    if said == "right":
        return SetupCheck("which", "which camera is which", "good", "you saw it", t_ns=t_ns)
    if said == "swapped":
        return SetupCheck("which", "which camera is which", "wrong", "they are exchanged, you say", _SWAP, t_ns=t_ns)
    return SetupCheck("which", "which camera is which", "unknown", "not looked at yet", _ASK)


def not_yet(
    subject: Literal["light", "focus", "markers"], camera: Camera, *, crosses: bool | None
) -> Iterator[SetupCheck]:
    """Yield the checks of a subject that were not measured yet. crosses: whether they are in; None: nobody looked."""
    if subject == "markers":
        found = "not looked at yet" if crosses is None else "no cross is in the box"
        yield SetupCheck("markers", f"fiducials, {camera}", "unknown", found, _CROSSES, camera)
        return
    found = "not looked at yet" if crosses is None else "the crosses are in the box"
    then = "take the crosses out, back light on, and check again"
    for what in ("exposure", "back light") if subject == "light" else ("focus",):
        yield SetupCheck(subject, f"{what}, {camera}", "unknown", found, then, camera)
