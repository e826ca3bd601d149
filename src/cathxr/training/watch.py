"""A trial's stopwatch: active time in stretches, and how much of it the tip was not seen."""

from collections.abc import Sequence

from cathxr.core import Track
from cathxr.core.track import Status

GAP_NS = 250_000_000
"""A longer time between two Tracks is a gap: nothing is known of what lies in it, and nothing is bridged."""


class Watch:
    """Active time, in ns. Between two Tracks the tip counts as seen when both are tracked and no gap lies between."""

    def __init__(self) -> None:
        self.closed: list[tuple[int, int]] = []
        self.started_ns: int | None = None
        self.unseen_ns = 0
        self._mark_ns = 0
        self._seen = True
        self._before_ns = 0

    def carry(self, closed: Sequence[tuple[int, int]], *, active_ns: int, unseen_ns: int) -> None:
        """Take over what another watch has counted, before the first stretch."""
        self.closed, self._before_ns, self.unseen_ns = list(closed), active_ns, unseen_ns

    def start(self, t_ns: int) -> None:
        """Begin a stretch."""
        self.started_ns = self._mark_ns = t_ns
        self._seen = True

    def stop(self, t_ns: int) -> None:
        """End the stretch."""
        assert self.started_ns is not None
        self._account(t_ns, seen=self._seen)
        self.closed.append((self.started_ns, t_ns))
        self._before_ns += t_ns - self.started_ns
        self.started_ns = None

    def take(self, track: Track) -> bool:
        """Count the time up to a Track; return whether the tip was seen all the way since the Track before."""
        tracked = track.status is Status.TRACKED
        seen = self._account(track.t_ns, seen=tracked and self._seen)
        self._seen = tracked
        return seen

    def active_ns(self, t_ns: int) -> int:
        """Return the active time at an instant of this stretch, or of all stretches when stopped."""
        return self._before_ns + (0 if self.started_ns is None else t_ns - self.started_ns)

    def instant_ns(self, active_ns: int) -> int:
        """Return when the active time will be, or was, `active_ns`, by the running stretch."""
        assert self.started_ns is not None
        return self.started_ns + active_ns - self._before_ns

    def unseen_share(self, t_ns: int) -> float:
        """Return the share of the active time, up to the last Track or the end, in which the tip was not seen."""
        whole = self.active_ns(t_ns)
        return self.unseen_ns / whole if whole > 0 else 0.0

    def _account(self, t_ns: int, *, seen: bool) -> bool:
        passed = t_ns - self._mark_ns
        self._mark_ns = t_ns
        if seen and passed <= GAP_NS:
            return True
        self.unseen_ns += passed
        return False
