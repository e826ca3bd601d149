"""Which cameras this computer has."""

import platform
from dataclasses import dataclass
from pathlib import Path

import cv2

_SYSFS = Path("/sys/class/video4linux")
_LINKS = Path("/dev/v4l")
_PROBED = 6


@dataclass(frozen=True)
class CameraDevice:
    """One camera. `device` is what the option `device` takes: a path on Linux, an index elsewhere."""

    device: str | int
    name: str

    def __str__(self) -> str:
        return f"{self.device} ({self.name})"


def list_cameras(*, sysfs: Path = _SYSFS) -> tuple[CameraDevice, ...]:
    """Return the cameras present. On Linux nothing is opened; elsewhere the first six indices are tried, which blinks.

    A UVC camera has a second node for metadata; only the first of each camera (index 0 in sysfs) is listed.
    """
    if platform.system() == "Linux":
        return _linux(sysfs)
    return _probed()


def stable_name(device: str | int, *, links: Path = _LINKS) -> str | int:
    """Return a name of the device that stays when the computer starts again; `device` itself where there is none.

    Linux numbers cameras in the order in which they answer. by-path names the socket that the cable is in, which also
    tells two cameras of one model apart; by-id names the camera, but only one of two without serial numbers.
    """
    if isinstance(device, int):
        return device
    for folder in ("by-path", "by-id"):
        try:
            found = sorted(each for each in (links / folder).iterdir() if each.resolve() == Path(device).resolve())
        except OSError:
            continue
        if found:
            return str(found[0])
    return device


def listing_sentence(cameras: tuple[CameraDevice, ...]) -> str:
    """Return the cameras as the end of an error's sentence."""
    if not cameras:
        return "No camera is connected: check the cables and, on Linux, that you may read /dev/video*."
    return f"Cameras found: {', '.join(str(each) for each in cameras)}."


def backend() -> int:
    """Return OpenCV's camera interface for this system: V4L2, DirectShow, or AVFoundation."""
    if platform.system() == "Linux":
        return int(cv2.CAP_V4L2)
    if platform.system() == "Windows":
        return int(cv2.CAP_DSHOW)  # opens at once and takes exposure settings; Media Foundation can need ten seconds
    return int(cv2.CAP_AVFOUNDATION)


def _linux(sysfs: Path) -> tuple[CameraDevice, ...]:
    found: list[tuple[int, CameraDevice]] = []
    for folder in sysfs.glob("video*"):
        number = folder.name.removeprefix("video")
        if not number.isdigit() or _text(folder / "index") not in ("", "0"):
            continue
        found.append((int(number), CameraDevice(f"/dev/{folder.name}", _text(folder / "name") or "unnamed")))
    return tuple(device for _, device in sorted(found, key=lambda each: each[0]))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""


def _probed() -> tuple[CameraDevice, ...]:
    found = []
    for index in range(_PROBED):
        capture = cv2.VideoCapture(index, backend())
        try:
            if capture.isOpened():
                found.append(CameraDevice(index, f"camera {index}"))
        finally:
            capture.release()
    return tuple(found)
