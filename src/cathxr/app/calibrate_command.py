"""`cathxr calibrate`: from pictures to a trustworthy rig, with its errors."""

import click

from cathxr.app.lazy_group import LazyGroup

_COMMANDS = {
    "board": ("calibrate_board", "board", "Print a calibration board to a true-scale PDF."),
    "cameras": ("calibrate_cameras", "cameras", "Say which device is top and which is front; lock their settings."),
    "intrinsics": ("calibrate_intrinsics", "intrinsics", "Measure one camera's lens with pictures of a board."),
    "markers": ("calibrate_markers", "markers", "Measure where the cameras are, with the box's fiducials."),
    "roll": ("calibrate_roll", "roll", "Measure roll's zero, the gears' backlash and ratio, with the jig."),
    "timing": ("calibrate_timing", "timing", "Measure the delays between the cameras and the encoder."),
    "check": ("calibrate_check", "check", "Check a calibrated rig: agreement, drift, accuracy on a phantom."),
}


@click.group("calibrate", cls=LazyGroup, commands_of=_COMMANDS)
def calibrate() -> None:
    """Measure the rig, in this order: board, cameras, intrinsics (each camera), markers, roll,
    timing, check.

    Every command writes what it measured into the rig, with its error and date, and keeps the earlier file beside it.
    A run that fails leaves the rig untouched.

    \b
    Examples:
      cathxr calibrate board --out board.pdf
      cathxr calibrate intrinsics --rig rig.toml --camera top --board charuco:10x10:6.0:4.0:DICT_4X4_50 top_*.png
      cathxr calibrate markers --rig rig.toml --top top.png --front front.png
    """
