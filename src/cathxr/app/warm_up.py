"""Compiles the hot loops before the first real picture: once for an installation, from the cache on disk later."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from cathxr.core import Detector, Image, Observation, Rig, Status, Track
from cathxr.storage.rig_file import example_rig
from cathxr.tracking import make_tracker, read_and_track
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig, with_readout
from cathxr.vision import make_detector

_WIDTH_PX = 480
"""Of the pictures: small, because memory that was used once stays with the process, and wide enough to be tracked."""
_INSTANTS_NS = (1_000_000_000, 1_033_000_000, 1_066_000_000, 1_099_000_000)
_SKEW_NS = 1_000_000
"""By how much the front pictures of the later pairs are taken later: views of two instants are treated apart."""


def scenes_for(rig: Rig, *, backgrounds: bool) -> tuple[str, ...]:
    """Return the scenes whose pairs use all that a box needs. backgrounds: there are pictures of the empty box."""
    rolling = rig.timing.top_readout_s > 0.0 or rig.timing.front_readout_s > 0.0
    return ("smooth", *(("white",) if backgrounds else ()), *(("rolling_shutter",) if rolling else ()))


def warm_up(*, method: str, scene_name: str = "smooth") -> Track:
    """Return the last Track of a few small picture pairs of the example box: all that tracking calls is loaded then.

    The first pair is read whole, the others near the prediction too, where the method predicts. What is compiled
    depends on no rig, so that the box is always one that is known to be tracked.
    """
    settings = scene(scene_name)
    rig = with_readout(_reduced(true_rig(example_rig(), 0)), settings.readout_ms)
    world = TwinWorld(rig, settings=settings)
    renderers = {name: CameraRenderer(world, name) for name in ("top", "front")}
    detectors = {
        name: make_detector(method, rig, name, background=each.empty_picture() if scene_name == "white" else None)
        for name, each in renderers.items()
    }
    tracker = make_tracker(method, rig)
    last: Track | None = None
    for seq, t_ns in enumerate(_INSTANTS_NS):
        skew_ns = {"top": 0, "front": _SKEW_NS if seq > 1 else 0}
        pictures = [
            Image(name, seq, t_ns + skew_ns[name], renderer.picture(t_ns + skew_ns[name]))
            for name, renderer in renderers.items()
        ]
        _, track = read_and_track(partial(_seen, pictures, detectors), tracker, last)
        last = None if track.status is Status.LOST else track
    return track


def _seen(pictures: Sequence[Image], detectors: Mapping[str, Detector], last: Track | None) -> Observation:
    """Return what a pair shows, read near what `last` predicts, or whole without it."""
    found = tuple(detectors[each.camera].detect(each, last) for each in pictures)
    return Observation(pictures[0].seq, pictures[0].t_ns, found, pictures[1].t_ns - pictures[0].t_ns)


def _reduced(rig: Rig) -> Rig:
    """Return the rig with pictures of the small width, seeing the same."""
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
