"""The twin's cameras and encoder as drivers: what `cathxr.cameras` and `cathxr.encoders` find under the name "twin"."""

import dataclasses
import zlib
from collections.abc import Mapping
from types import TracebackType
from typing import Any, Self

import numpy as np

from cathxr.core import Clock, ConfigError, Image, Reading, Rig
from cathxr.twin.gears import Gears
from cathxr.twin.placement import true_rig
from cathxr.twin.render import CameraRenderer
from cathxr.twin.scenes import scene
from cathxr.twin.settings import TwinSettings
from cathxr.twin.timed import NS, Timed
from cathxr.twin.world import TwinWorld

USUAL_RATE_HZ = 30.0
"""Of the cameras at most, unless a rate is asked for: rendering more would take a core of its own."""
_KNOWN = ("world", "seed", "scene", "settings", "rate_hz", "off_nominal", "start_ns", "stamp_error_s")


class _TwinDevice:
    """What both kinds of driver have: a world, a clock, and instants that come and may be missed."""

    world: TwinWorld
    _clock: Clock
    _timed: Timed

    @property
    def losses(self) -> int:
        """Pictures or reports that were dropped or came too late to be read, so far."""
        return self._timed.losses

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._timed.stop()


class TwinCamera(_TwinDevice):
    """A Source[Image]: one camera of the simulated box.

    options: `world`, a shared TwinWorld; or, for a world of its own, `seed` (0), `scene` (a name), `settings`
    (TwinSettings, or a mapping of fields to change), `off_nominal` (move the rig's cameras by seed: see `true_rig`),
    `start_ns` (0). `rate_hz`: the rig's, at most 30, unless given. `stamp_error_s`: how late the device's own stamps
    are; from them the driver subtracts what the rig's [timing] says of this camera, as any driver does, so that a rig
    that has not been measured gives wrong stamps. Unless given, the rig is right and pictures are stamped mid-exposure.
    They come when exposure and read-out are over. `seq` counts instants, so that a lost picture leaves a gap.
    """

    def __init__(self, rig: Rig, camera: str, *, clock: Clock, options: Mapping[str, Any]) -> None:
        if camera not in rig.cameras:
            raise ConfigError(f"The rig {rig.name!r} has no camera {camera!r}; it has {', '.join(rig.cameras)}.")
        self.world = world_of(rig, options)
        self.camera = camera
        self._clock = clock
        self._renderer: CameraRenderer | None = None
        settings = self.world.settings
        rate_hz = rate_of(options, default=min(rig.cameras[camera].rate_hz, USUAL_RATE_HZ))
        timing = rig.timing
        known_s = timing.top_latency_s if camera == "top" else timing.front_latency_s + timing.front_offset_s
        self._stamp_off_ns = _stamp_off_ns(options, known_s=known_s)
        skew_ns = round(settings.front_skew_ms * 1e6) if camera == "front" else 0
        ready_ns = round(0.5e6 * (settings.exposure_ms + settings.readout_ms))
        self._timed = Timed(clock, origin_ns=self.world.start_ns + skew_ns, rate_hz=rate_hz, ready_ns=ready_ns)

    def get_ready(self) -> None:
        """Draw what never moves: half a second's work, which opening does where it is not done yet."""
        if self._renderer is None:
            self._renderer = CameraRenderer(self.world, self.camera)
            # The first picture compiles or loads the kernels: better now than late.
            self._renderer.picture(self.world.start_ns)

    def __enter__(self) -> Self:
        self.get_ready()
        self._timed.start()
        return self

    def read(self, timeout_s: float) -> Image | None:
        """Return the next picture, or None when none came in time.

        Raises:
            DeviceError: the camera is not open.
        """
        deadline_ns = self._clock.now_ns() + round(timeout_s * NS)
        while (due := self._timed.due(deadline_ns)) is not None:
            seq, t_ns = due
            if self._dropped(t_ns):
                self._timed.losses += 1
                continue
            assert self._renderer is not None, "an open camera has a renderer"
            return Image(self.camera, seq, t_ns + self._stamp_off_ns, self._renderer.picture(t_ns))
        return None

    def _dropped(self, t_ns: int) -> bool:
        share = self.world.settings.drop_share
        if share <= 0.0:
            return False
        entropy = [self.world.seed, zlib.crc32(self.camera.encode()), t_ns % (1 << 63), 0xD209]
        return bool(np.random.default_rng(entropy).uniform() < share)


class TwinEncoder(_TwinDevice):
    """A Source[Reading]: the roll encoder of the simulated box, counts after x4 decoding, through gears with some play.

    options as for `TwinCamera`; `rate_hz` unless given is the settings' encoder_rate_hz (200).
    """

    def __init__(self, rig: Rig, *, clock: Clock, options: Mapping[str, Any]) -> None:
        if rig.roll is None:
            raise ConfigError(f"The rig {rig.name!r} has no [roll] and so no encoder to simulate: add [roll] to it.")
        self.world = world_of(rig, options)
        self._clock = clock
        settings = self.world.settings
        rate_hz = rate_of(options, default=settings.encoder_rate_hz)
        self._stamp_off_ns = _stamp_off_ns(options, known_s=rig.timing.encoder_latency_s)
        self._timed = Timed(clock, origin_ns=self.world.start_ns, rate_hz=rate_hz, ready_ns=0)
        self._gears = Gears(self.world, rig.roll)

    def __enter__(self) -> Self:
        self._gears.reset()
        self._timed.start()
        return self

    def read(self, timeout_s: float) -> Reading | None:
        """Return the next report, or None when none came in time.

        Raises:
            DeviceError: the encoder is not open.
        """
        due = self._timed.due(self._clock.now_ns() + round(timeout_s * NS))
        if due is None:
            return None
        seq, t_ns = due
        return Reading(seq, t_ns + self._stamp_off_ns, self._gears.count(t_ns))


def world_of(rig: Rig, options: Mapping[str, Any]) -> TwinWorld:
    """Return the world that a driver's options mean.

    Raises:
        ConfigError: an unknown option or scene, or a setting that cannot be.
    """
    unknown = sorted(set(options) - set(_KNOWN))
    if unknown:
        raise ConfigError(f"The twin has no option {', '.join(unknown)}; it has {', '.join(_KNOWN)}.")
    world = options.get("world")
    if world is not None:
        if not isinstance(world, TwinWorld):
            raise ConfigError(f"The twin's option world must be a TwinWorld, not {type(world).__name__}.")
        return world
    settings = options.get("settings")
    if not isinstance(settings, TwinSettings):
        settings = changed_settings(scene(options.get("scene", "smooth")), settings or {})
    seed = int(options.get("seed", 0))
    rig_true = true_rig(rig, seed) if options.get("off_nominal", False) else rig
    try:
        return TwinWorld(rig_true, seed=seed, settings=settings, start_ns=int(options.get("start_ns", 0)))
    except ValueError as error:
        raise ConfigError(f"The twin cannot be set up like that: {error}.") from error


def changed_settings(settings: TwinSettings, changes: Mapping[str, Any]) -> TwinSettings:
    """Return the settings with some fields changed.

    Raises:
        ConfigError: a field that there is not, or a value that cannot be.
    """
    known = {each.name for each in dataclasses.fields(TwinSettings)}
    unknown = sorted(set(changes) - known)
    if unknown:
        raise ConfigError(f"The twin has no setting {', '.join(unknown)}; it has {', '.join(sorted(known))}.")
    try:
        return dataclasses.replace(settings, **changes)
    except (ValueError, TypeError) as error:
        raise ConfigError(f"The twin's settings cannot be used: {error}.") from error


def rate_of(options: Mapping[str, Any], *, default: float) -> float:
    """Return the option rate_hz, else the default.

    Raises:
        ConfigError: it is not a positive number.
    """
    rate_hz = float(options.get("rate_hz", default))
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise ConfigError(f"The twin's option rate_hz must be a positive number, not {rate_hz}.")
    return rate_hz


def _stamp_off_ns(options: Mapping[str, Any], *, known_s: float) -> int:
    """Return by how much stamps are off: the device's own error less the latency that the rig states for it."""
    error_s = options.get("stamp_error_s")
    if error_s is None:
        return 0
    if not (isinstance(error_s, int | float) and np.isfinite(error_s) and abs(error_s) <= 10.0):
        raise ConfigError(f"The twin's option stamp_error_s must be a number of at most 10 seconds, not {error_s!r}.")
    return round((error_s - known_s) * NS)
