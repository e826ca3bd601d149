"""What the running devices say about the set-up: pictures that come, an encoder that turns, a rig that was measured."""

import math
from collections import deque
from collections.abc import Iterator, Sequence

from cathxr.core import Health, Reading, Rig
from cathxr.runtime.setup_nouns import SetupCheck
from cathxr.runtime.setup_pictures import CAMERAS

_SLOW = 0.8
_OLD_S = 2.0
_TURNED_RAD = math.radians(5.0)
_LOSSY, _BROKEN = 0.01, 0.1
_WINDOW_NS = 5_000_000_000


class TurnWatch:
    """Takes encoder readings in the encoder's thread; says how far the handle was turned, and what went wrong."""

    def __init__(self) -> None:
        self._first: Reading | None = None
        self._last: Reading | None = None
        self._least = self._most = 0
        self._windows: deque[tuple[Reading, int]] = deque(maxlen=2)

    def take(self, reading: Reading) -> None:
        """Take a reading. A count that a restart of the board set back begins anew."""
        if self._first is None or self._last is None or reading.seq < self._last.seq:
            self._first, self._least, self._most = reading, reading.count, reading.count
            self._windows.clear()
        self._last = reading
        if not self._windows or reading.t_ns - self._windows[-1][0].t_ns > _WINDOW_NS:
            self._windows.append((reading, 0))
        self._windows[-1] = (self._windows[-1][0], self._windows[-1][1] + 1)
        self._least, self._most = min(self._least, reading.count), max(self._most, reading.count)

    def check(self, rig: Rig, sources: Sequence[Health]) -> SetupCheck:
        """Return whether the encoder turns, from the readings and from its source's Health."""
        health = next((each for each in sources if each.source == "encoder"), None)
        if rig.roll is None:
            return _encoder("unknown", "the rig has no [roll]", "add it, as hardware export writes it, for roll")
        if health is None:
            return _encoder("unknown", "none is set up", 'add driver = "serial" under [encoder] in config.toml')
        windows = tuple(self._windows)
        if not health.running or self._first is None or self._last is None or not windows:
            then = "cathxr doctor encoder says what is on each port"
            return _encoder("wrong", health.last_error or "no reports come", then)
        of = self._last.seq - windows[0][0].seq + 1
        lost = max(0, of - sum(count for _, count in windows))
        illegal = (self._last.illegal - self._first.illegal) % (1 << 16)
        turned = abs(rig.roll.angle_rad(self._most) - rig.roll.angle_rad(self._least))
        told = f"turned through {math.degrees(turned):.0f} degrees, {health.rate_hz:.0f} reports a second"
        if illegal:
            then = "look at the wires of A and B, and their pull-ups (docs/build/wiring.md)"
            return _encoder("wrong", f"{told}, {illegal} impossible transitions", then)
        if lost > _LOSSY * of:
            then = "another USB cable or port; a computer that is less busy"
            return _encoder("wrong" if lost > _BROKEN * of else "warn", f"{told}, {lost} of the last {of} lost", then)
        if turned < _TURNED_RAD:
            return _encoder("unknown", told, "turn the handle to and fro, by a quarter turn or so")
        return _encoder("good", told)


def camera_checks(rig: Rig, sources: Sequence[Health]) -> Iterator[SetupCheck]:
    """Yield for each camera whether its pictures come, and as fast as the rig says."""
    known = {each.source: each for each in sources}
    for name in CAMERAS:
        health, camera = known.get(name), rig.cameras[name]
        what = f"camera, {name}"
        if health is None or not health.running or health.age_s is None or health.age_s > _OLD_S:
            told = (None if health is None else health.last_error) or "no pictures come"
            then = (
                "another cable or port; is its device in config.toml the right one? cathxr calibrate cameras shows all"
            )
            yield SetupCheck("cameras", what, "wrong", told, then, name)
            continue
        told = (
            f"{health.rate_hz:.1f} of {camera.rate_hz:g} pictures a second, {camera.size_px[0]} x {camera.size_px[1]}"
        )
        if health.rate_hz < _SLOW * camera.rate_hz:
            then = (
                "a USB controller of its own, MJPG in config.toml, a shorter exposure, or a computer that is less busy"
            )
            yield SetupCheck("cameras", what, "warn", told, then, name)
        else:
            yield SetupCheck("cameras", what, "good", told, camera=name)


def rig_check(rig: Rig) -> SetupCheck:
    """Return which parts of a rig were measured, and when: without a date a part is as drawn."""
    dates: dict[str, str | None] = {}
    for name, camera in rig.cameras.items():
        dates[f"lens {name}"] = camera.intrinsics.provenance.date
        dates[f"pose {name}"] = camera.pose_provenance.date
    if rig.roll is not None:
        dates["roll"] = rig.roll.provenance.date
    dates["timing"] = rig.timing.provenance.date
    found = ", ".join(f"{name} {date or 'not measured'}" for name, date in dates.items())
    first = next((name for name, date in dates.items() if date is None), None)
    if first is None:
        return SetupCheck("rig", "rig", "good", found)
    return SetupCheck("rig", "rig", "warn", found, f"cathxr calibrate --help names the command for {first}")


def _encoder(verdict: str, found: str, then: str = "") -> SetupCheck:
    return SetupCheck("encoder", "encoder", verdict, found, then)  # type: ignore[arg-type]  # one of the four words
