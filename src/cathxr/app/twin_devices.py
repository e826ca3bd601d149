"""The twin's two cameras as devices that nobody has named yet: for trying `calibrate cameras` without hardware."""

from types import TracebackType
from typing import Self

import numpy as np

from cathxr.core import Clock, Image, Rig
from cathxr.devices.camera_lock import LockedSettings
from cathxr.runtime.calibration_cameras import Candidate
from cathxr.twin import TwinWorld, scene, true_rig
from cathxr.twin.drivers import TwinCamera

_RATE_HZ = 10.0
_PER_MS = 10.0  # V4L2 counts exposure in 100 us


class TwinDevice:
    """One camera of the twin under another name. Its exposure is what the scene says and never changes."""

    def __init__(self, world: TwinWorld, rig: Rig, camera: str, key: str, *, clock: Clock) -> None:
        self._key = key
        self._settings = world.settings
        self._camera = TwinCamera(rig, camera, clock=clock, options={"world": world, "rate_hz": _RATE_HZ})
        self._brightness = 0.0

    def __enter__(self) -> Self:
        self._camera.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._camera.__exit__(kind, error, trace)

    def read(self, timeout_s: float) -> Image | None:
        """Return the next picture under this device's name."""
        image = self._camera.read(timeout_s)
        if image is None:
            return None
        self._brightness = float(image.pixels[::8, ::8].mean())
        return Image(self._key, image.seq, image.t_ns, image.pixels)

    @property
    def settings(self) -> dict[str, float]:
        """The scene's exposure, in 100 us, and gain."""
        return {"exposure": self._settings.exposure_ms * _PER_MS, "gain": self._settings.gain}

    def automatic(self) -> None:
        """Do nothing: a simulated camera is always locked."""

    def lock(self, timeout_s: float) -> LockedSettings:
        """Return the scene's settings."""
        settings = self.settings
        return LockedSettings(
            exposure=settings["exposure"],
            gain=settings["gain"],
            brightness_before=self._brightness,
            brightness_after=self._brightness,
        )


def twin_candidates(rig: Rig, *, seed: int, clock: Clock) -> tuple[Candidate, ...]:
    """Return the twin's two cameras in an order that the seed shuffles, with both crosses in the box."""
    true = true_rig(rig, seed)
    world = TwinWorld(true, seed=seed, settings=scene("pillars"), start_ns=clock.now_ns())
    names = [str(each) for each in np.random.default_rng([seed, 0xCA3]).permutation(sorted(rig.cameras))]
    return tuple(
        Candidate(
            f"device-{i}",
            f"twin:{name}",
            f"Simulated camera {i}",
            TwinDevice(world, true, name, f"device-{i}", clock=clock),
        )
        for i, name in enumerate(names)
    )
