"""What the runtime hands on: one instant with everything that belongs to it, and the state of the system."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from cathxr.core import Health, Image, Observation, RollStatus, Source, Track
from cathxr.runtime.fanout import Fanout


@dataclass(frozen=True, eq=False)
class Moment:
    """One Track and what it was made from: the Observation and the pictures (by camera) where there are any."""

    track: Track
    observation: Observation | None = None
    images: Mapping[str, Image] = field(default_factory=dict)


@dataclass(frozen=True)
class HealthReport:
    """Every source's Health at one instant. skew_ns: front picture's instant minus the top's, latest complete pair."""

    t_ns: int
    sources: tuple[Health, ...]
    skew_ns: int | None = None


@dataclass(frozen=True)
class RecordingState:
    """Whether a recording runs, its folder's name, and how long it is so far, seconds."""

    recording: bool
    name: str | None = None
    seconds: float = 0.0


@dataclass(frozen=True)
class RollReport:
    """The roll's validity. predicted: whether a Track since the last report had a predicted roll."""

    status: RollStatus
    predicted: bool = False


@runtime_checkable
class RollSource(Protocol):
    """A source that has an encoder of its own, or could have. Any thread may call."""

    def roll_status(self, now_ns: int) -> RollStatus:
        """Return whether the roll is valid, and what to do where it is not."""
        ...

    def confirm_roll(self) -> None:
        """Take a person's word that roll is right. Raises CathxrError where that cannot be or is not enough."""
        ...

    def zero_roll(self) -> None:
        """Have the present position be roll zero: the handle is in the jig. Raises CathxrError where it cannot be."""
        ...


@runtime_checkable
class MomentSource(Source[Track], Protocol):
    """A source of Tracks that also has what they were made from: the cameras with a tracker, or a replay."""

    def read_moment(self, timeout_s: float) -> Moment | None:
        """Return the next Moment, None when none came in time. Raises as `read`."""
        ...

    def request_reset(self) -> None:
        """Have detectors and tracker reset before the next Observation. From any thread."""
        ...

    def health(self, now_ns: int) -> tuple[Health, ...]:
        """Return the Health of everything inside."""
        ...

    @property
    def resets(self) -> Fanout[int]:
        """Takes those who want to know of each reset: they get the seq of the Observation it comes before."""
        ...

    @property
    def skew_ns(self) -> int | None:
        """The latest complete pair's skew."""
        ...
