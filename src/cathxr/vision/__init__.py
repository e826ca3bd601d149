"""From one camera's pictures to Detections. No clock, no files, no threads."""

from cathxr.core import ConfigError, Detector, PixelArray, Rig
from cathxr.vision.model import ModelDetector
from cathxr.vision.paper import PaperDetector

METHODS = ("model", "paper")


def make_detector(method: str, rig: Rig, camera: str, *, background: PixelArray | None = None) -> Detector:
    """Return a detector for one camera of a rig. `background`: a picture of the empty box, uint8 (H, W[, 3]).

    Raises:
        ConfigError: no such method, or the background's size is not the camera's.
    """
    if background is not None and (background.shape[1], background.shape[0]) != rig.cameras[camera].size_px:
        width, height = rig.cameras[camera].size_px
        raise ConfigError(
            f"The background picture of the {camera} camera is {background.shape[1]}x{background.shape[0]} pixels, "
            f"but the rig says {width}x{height}; take it with the same camera and settings."
        )
    if method == "model":
        return ModelDetector(rig, camera, background=background)
    if method == "paper":
        return PaperDetector(rig, camera)
    raise ConfigError(f"There is no method '{method}'; choose one of {', '.join(METHODS)}.")


__all__ = ["METHODS", "make_detector"]
