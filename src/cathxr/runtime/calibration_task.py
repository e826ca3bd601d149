"""What every calibration with a page has in common: what a task is, its jobs, its end. No threads here."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from cathxr.core import ConfigError, Health, Image, Reading
from cathxr.wire.calibration_messages import CalibrationState

Value = TypeVar("Value")
Found = TypeVar("Found")

Keep = Callable[[str, bytes], str]
"""Keeps a PNG by a name and returns its path on the server: the Hub's publish_result."""


@dataclass(frozen=True)
class Ending:
    """How a calibration ended. sentence: for a person; paths: what was written."""

    sentence: str
    saved: bool = False
    paths: tuple[str, ...] = ()

    @property
    def result(self) -> dict[str, Any]:
        """What the command that ended it is answered with."""
        return {"saved": self.saved, "sentence": self.sentence, "paths": list(self.paths)}


CANCELLED = Ending("Cancelled: nothing was written.")


@dataclass(frozen=True, eq=False)
class Job(Generic[Value]):
    """Long work. `work` runs in a thread of its own and touches no state; then `done` takes what it returns.

    failed: takes the sentence of what `work` raised. Both are called as every other method of the task is.
    """

    work: Callable[[], Value]
    done: Callable[[Value], None]
    failed: Callable[[str], None]


class Steps(Protocol):
    """One calibration: commands in, states out. All methods are called by one thread at a time, and return soon."""

    ending: Ending | None

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Carry out a command and return its result.

        Raises:
            CathxrError: it cannot be done; the sentence says why.
        """
        ...

    def take_job(self) -> Job[Any] | None:
        """Return what is to be worked out now, once; None for nothing. A newer job makes a waiting one void."""
        ...

    def note_health(self, sources: Mapping[str, Health]) -> None:
        """Take the state of the devices."""
        ...

    def state(self) -> CalibrationState:
        """Return what the page shows."""
        ...


class Task(Steps, Protocol[Found]):
    """A calibration with pictures. `examine` may be called from any thread at any time, all else as in Steps."""

    def examine(self, image: Image) -> Found:
        """Return what is in a picture: the slow part."""
        ...

    def look(self, image: Image, found: Found) -> None:
        """Take a picture and what was found in it."""
        ...


class ReadingsTask(Steps, Protocol):
    """A calibration with the encoder."""

    def take(self, readings: Sequence[Reading]) -> None:
        """Take the encoder's readings since the last time, in order; none when it is silent."""
        ...


Handler = Callable[[Mapping[str, Any]], Mapping[str, Any]]


class CommandTable:
    """A task's commands with the arguments that each takes; a name that ends in ? may be left out."""

    def __init__(self, commands: Mapping[str, tuple[tuple[str, ...], Handler]]) -> None:
        self._commands = dict(commands)

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the result of a command.

        Raises:
            ConfigError: there is no such command here, or its arguments are not those it takes.
        """
        if name not in self._commands:
            raise ConfigError(f"There is no command {name!r} here: there are {', '.join(sorted(self._commands))}.")
        takes, handler = self._commands[name]
        needed = {each for each in takes if not each.endswith("?")}
        if not needed <= set(args) <= {each.rstrip("?") for each in takes}:
            wanted = f"takes {', '.join(takes)}" if takes else "takes no arguments"
            given = ", ".join(sorted(args)) or "nothing"
            raise ConfigError(f"The command {name} {wanted}; {given} was given.")
        return handler(args)


def text_of(args: Mapping[str, Any], key: str) -> str:
    """Return a text argument.

    Raises:
        ConfigError: it is no text.
    """
    value = args[key]
    if not isinstance(value, str):
        raise ConfigError(f"{key} must be a text, {value!r} was given.")
    return value
