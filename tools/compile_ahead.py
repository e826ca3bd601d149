"""Compiles the hot loops once, so that tests that run side by side load them instead of each compiling its own.

python tools/compile_ahead.py      about two minutes the first time, seconds later
"""

from cathxr.app.warm_up import warm_up
from cathxr.calibration.marker_finding import find_markers
from cathxr.storage.rig_file import example_rig
from cathxr.twin import CameraRenderer, TwinWorld, scene


def main() -> None:
    """Use each part once."""
    rig = example_rig()
    for method in ("model", "paper"):
        warm_up(method=method)
    for name in ("white", "rolling_shutter", "curl"):
        warm_up(method="model", scene_name=name)
    for name in ("debris", "rolling_shutter", "pillars"):
        world = TwinWorld(rig, settings=scene(name))
        picture = CameraRenderer(world, "top").picture(0)
    find_markers(rig, "top", picture)


if __name__ == "__main__":
    main()
