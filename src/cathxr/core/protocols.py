"""The verbs: what every driver, tracker and output does."""

from types import TracebackType
from typing import Protocol, Self, TypeVar, runtime_checkable

from cathxr.core.signals import Detection, Image, Observation
from cathxr.core.track import Track

Item_co = TypeVar("Item_co", covariant=True)
Item_contra = TypeVar("Item_contra", contravariant=True)


class Source(Protocol[Item_co]):
    """Something that yields values. A context manager: entering opens it, leaving closes it."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def read(self, timeout_s: float) -> Item_co | None:
        """Return the next value, or None when none came in `timeout_s`.

        Raises:
            DeviceError: the device failed; EndOfStream: there is no more.
        """
        ...


@runtime_checkable
class Zeroed(Protocol):
    """An encoder whose count belongs to a zero that a person vouches for. Any thread may call."""

    def confirm(self) -> None:
        """Take a person's word that roll is right, after a restart that kept the count.

        Raises:
            DeviceError: it is closed, or the zero must be set.
        """
        ...

    def set_zero(self, count: int) -> None:
        """Have the present position be `count`: a person holds the handle in the jig.

        It holds from a later reading on: until then readings say that they are not valid.

        Raises:
            DeviceError: it is closed.
        """
        ...


class Sink(Protocol[Item_contra]):
    """Something that takes values. `write` never blocks its caller."""

    def write(self, item: Item_contra) -> None: ...


class Clock(Protocol):
    """Where time comes from: the host's monotonic clock, or a made-up one offline."""

    def now_ns(self) -> int: ...

    def wait_until_ns(self, t_ns: int) -> None:
        """Return at `t_ns`, or at once when that has passed."""
        ...


class Detector(Protocol):
    """Turns one camera's pictures into Detections. Made for one camera of one rig; may keep state between pictures."""

    def detect(self, image: Image, predicted_box: Track | None = None) -> Detection:
        """Return what is seen in `image`; `predicted_box` is the last Track while tracking.

        Never raises for bad pixels.
        """
        ...

    def reset(self) -> None: ...


class Tracker(Protocol):
    """Turns Observations into Tracks.

    A pure state machine: the same Observations after `reset` give the same Tracks. An Observation that was read near
    the prediction and makes no tracked Track leaves it as it was: the pair is to be read whole, and given again.
    """

    def update(self, observation: Observation) -> Track: ...

    def reset(self) -> None: ...
