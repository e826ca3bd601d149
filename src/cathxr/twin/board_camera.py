"""The twin's camera for a live calibration of intrinsics: a person holds a printed board before it and moves it."""

from collections.abc import Mapping
from dataclasses import replace
from types import TracebackType
from typing import Any, Self

import numpy as np

from cathxr.core import Clock, ConfigError, Image, PixelArray, Rig
from cathxr.twin.board_motion import BoardMotion
from cathxr.twin.board_pictures import BoardRenderer
from cathxr.twin.drivers import changed_settings, rate_of
from cathxr.twin.scenes import scene
from cathxr.twin.settings import TwinSettings
from cathxr.twin.timed import NS, Timed, not_open

_USUAL_RATE_HZ = 15.0
_EXPOSURE_MS = 6.0
_KNOWN = ("texture", "px_per_mm", "offset_mm", "seed", "settings", "rate_hz", "start_ns")


class TwinBoardCamera:
    """A Source[Image]: the named camera of a simulated box, which looks at a board that somebody moves.

    rig: the box as it truly is; only this camera's intrinsics and size matter. options: `texture` (h, w) uint8 grey
    picture of the print with its margin, and `px_per_mm` (both must be given); `offset_mm` (0, 0): from the picture's
    corner to the board's origin; `seed` (0); `settings` (TwinSettings, or a mapping of fields to change); `rate_hz`
    (the rig's, at most 15); `start_ns`: when the first travel begins (as the camera is first opened).
    """

    def __init__(self, rig: Rig, camera: str, *, clock: Clock, options: Mapping[str, Any]) -> None:
        if camera not in rig.cameras:
            raise ConfigError(f"The rig {rig.name!r} has no camera {camera!r}; it has {', '.join(rig.cameras)}.")
        unknown = sorted(set(options) - set(_KNOWN))
        if unknown:
            raise ConfigError(f"The twin's board has no option {', '.join(unknown)}; it has {', '.join(_KNOWN)}.")
        texture = options.get("texture")
        if not isinstance(texture, np.ndarray) or "px_per_mm" not in options:
            raise ConfigError("The twin's board camera needs the options texture, a grey picture, and px_per_mm.")
        settings = options.get("settings")
        if not isinstance(settings, TwinSettings):
            base = replace(scene("empty_wall"), exposure_ms=_EXPOSURE_MS)
            settings = changed_settings(base, settings or {})
        self.camera, self.settings = camera, settings
        self._rig_camera, self._clock = rig.cameras[camera], clock
        self._print: PixelArray = texture
        self._px_per_mm = float(options["px_per_mm"])
        self._offset_mm: tuple[float, float] = tuple(float(each) for each in options.get("offset_mm", (0.0, 0.0)))  # type: ignore[assignment]
        self._seed = int(options.get("seed", 0))
        size_mm = np.array(texture.shape[1::-1]) / self._px_per_mm
        self.motion = BoardMotion(self._rig_camera, size_mm, np.array(self._offset_mm), seed=self._seed)
        self._rate_hz = rate_of(options, default=min(self._rig_camera.rate_hz, _USUAL_RATE_HZ))
        self._start_ns: int | None = options.get("start_ns")
        self._renderer: BoardRenderer | None = None
        self._timed: Timed | None = None

    @property
    def losses(self) -> int:
        """Pictures that came too late to be read, so far."""
        return 0 if self._timed is None else self._timed.losses

    def __enter__(self) -> Self:
        if self._renderer is None:
            self._renderer = BoardRenderer(
                self._rig_camera,
                self._print,
                px_per_mm=self._px_per_mm,
                offset_mm=self._offset_mm,
                settings=self.settings,
                seed=self._seed,
            )
            self._renderer.picture(self.motion.pose(0.0))
        if self._start_ns is None:
            self._start_ns = self._clock.now_ns()
        if self._timed is None:
            ready_ns = round(0.5e6 * self.settings.exposure_ms)
            self._timed = Timed(self._clock, origin_ns=self._start_ns, rate_hz=self._rate_hz, ready_ns=ready_ns)
        self._timed.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._timed is not None:
            self._timed.stop()

    def read(self, timeout_s: float) -> Image | None:
        """Return the next picture, or None when none came in time.

        Raises:
            DeviceError: the camera is not open.
        """
        if self._timed is None or self._renderer is None or self._start_ns is None:
            raise not_open()
        due = self._timed.due(self._clock.now_ns() + round(timeout_s * NS))
        if due is None:
            return None
        seq, t_ns = due
        t_s = (t_ns - self._start_ns) * 1e-9
        twist = self.motion.twist(t_s, self.settings.exposure_ms * 1e-3)
        return Image(self.camera, seq, t_ns, self._renderer.picture(self.motion.pose(t_s), number=t_ns, twist=twist))
