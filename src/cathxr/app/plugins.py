"""Finds drivers by name: this package's own and any other's, through Python's entry points."""

from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any, cast

from cathxr.core import Clock, ConfigError, Image, Reading, Rig, Source

CAMERAS = "cathxr.cameras"
ENCODERS = "cathxr.encoders"
_WORDS = {CAMERAS: "camera driver", ENCODERS: "encoder driver"}


def available(group: str) -> dict[str, EntryPoint]:
    """Return what is installed in a group such as "cathxr.cameras", by name.

    Two packages that declare one name: this package's own wins, then the first found.
    """
    found: dict[str, EntryPoint] = {}
    for each in sorted(entry_points(group=group), key=lambda point: not point.value.startswith("cathxr.")):
        found.setdefault(each.name, each)
    return dict(sorted(found.items()))


def load(group: str, name: str) -> Any:
    """Return what a package declares under `name` in `group`.

    Raises:
        ConfigError: nothing has that name, or it cannot be imported.
    """
    what = _WORDS.get(group, f"plug-in of the group {group}")
    found = available(group)
    if name not in found:
        there = f"there are {', '.join(found)}" if found else "none is installed: install cathxr with pip"
        raise ConfigError(f"There is no {what} named {name!r}: {there}.")
    point = found[name]
    try:
        return point.load()
    except Exception as error:  # whatever a foreign package raises while it is imported
        package = point.dist.name if point.dist is not None else "its package"
        raise ConfigError(
            f"The {what} {name!r} of {package} cannot be loaded ({type(error).__name__}: {error}): "
            "update that package, or choose another driver."
        ) from error


def make_camera(name: str, rig: Rig, camera: str, *, clock: Clock, options: Mapping[str, Any]) -> Source[Image]:
    """Return the named driver for the rig's `camera` ("top" or "front"), closed.

    Raises:
        ConfigError: no such driver, or options that it does not take.
    """
    return cast(Source[Image], load(CAMERAS, name)(rig, camera, clock=clock, options=options))


def make_encoder(name: str, rig: Rig, *, clock: Clock, options: Mapping[str, Any]) -> Source[Reading]:
    """Return the named encoder driver, closed. Raises as `make_camera`."""
    return cast(Source[Reading], load(ENCODERS, name)(rig, clock=clock, options=options))
