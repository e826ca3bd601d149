"""Compiles the hot loops before the first real picture: once for an installation, from the cache on disk later."""

from cathxr.core import Image, Rig
from cathxr.core.signals import Observation
from cathxr.tracking import make_tracker
from cathxr.twin import CameraRenderer, TwinWorld, scene
from cathxr.vision import make_detector

_INSTANTS_NS = (1_000_000_000, 1_040_000_000)


def warm_up(rig: Rig, *, method: str) -> None:
    """Render two picture pairs of this rig on the twin and track them, so that everything is compiled and loaded."""
    world = TwinWorld(rig, settings=scene("smooth"))
    renderers = {name: CameraRenderer(world, name) for name in ("top", "front")}
    detectors = {name: make_detector(method, rig, name) for name in renderers}
    tracker = make_tracker(method, rig)
    for seq, t_ns in enumerate(_INSTANTS_NS):
        pictures = {name: Image(name, seq, t_ns, renderer.picture(t_ns)) for name, renderer in renderers.items()}
        found = tuple(detectors[name].detect(pictures[name]) for name in renderers)
        tracker.update(Observation(seq, t_ns, found))
