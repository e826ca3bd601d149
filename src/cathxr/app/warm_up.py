"""Compiles the hot loops before the first real picture: once for an installation, from the cache on disk later."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from cathxr.core import Detector, Image, Observation, Rig, Status, Track
from cathxr.tracking import make_tracker, read_and_track
from cathxr.twin import CameraRenderer, TwinWorld, scene
from cathxr.vision import make_detector

_WIDTH_PX = 320
_INSTANTS_NS = (1_000_000_000, 1_033_000_000, 1_066_000_000)


def warm_up(rig: Rig, *, method: str) -> None:
    """Render a few small picture pairs on the twin and track them, so that everything is compiled and loaded.

    The first is read whole, the others near the prediction too.

    Small, because memory that was used once stays with the process.
    """
    rig = _reduced(rig)
    world = TwinWorld(rig, settings=scene("smooth"))
    renderers = {name: CameraRenderer(world, name) for name in ("top", "front")}
    detectors = {name: make_detector(method, rig, name) for name in renderers}
    tracker = make_tracker(method, rig)
    last: Track | None = None
    for seq, t_ns in enumerate(_INSTANTS_NS):
        pictures = [Image(name, seq, t_ns, renderer.picture(t_ns)) for name, renderer in renderers.items()]
        _, track = read_and_track(partial(_seen, pictures, detectors), tracker, last)
        last = None if track.status is Status.LOST else track


def _seen(pictures: Sequence[Image], detectors: Mapping[str, Detector], last: Track | None) -> Observation:
    """Return what a pair shows, read near what `last` predicts, or whole without it."""
    found = tuple(detectors[each.camera].detect(each, last) for each in pictures)
    return Observation(pictures[0].seq, pictures[0].t_ns, found)


def _reduced(rig: Rig) -> Rig:
    """Return the rig with pictures of about 320 pixels' width, seeing the same."""
    cameras = {}
    for name, camera in rig.cameras.items():
        shrink = max(1.0, camera.size_px[0] / _WIDTH_PX)
        intrinsics = replace(
            camera.intrinsics,
            focal_px=camera.intrinsics.focal_px / shrink,
            centre_px=camera.intrinsics.centre_px / shrink,
        )
        size = (max(16, round(camera.size_px[0] / shrink)), max(16, round(camera.size_px[1] / shrink)))
        cameras[name] = replace(camera, intrinsics=intrinsics, size_px=size)
    return replace(rig, cameras=cameras)
