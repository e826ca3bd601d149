"""What an operator may ask of the live system: each command's arguments checked, each refusal a sentence."""

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from cathxr.core import Clock, ConfigError

Command = Callable[[Mapping[str, Any]], Mapping[str, Any]]


class Steerable(Protocol):
    """A world that can be steered: the twin's."""

    @property
    def manoeuvres(self) -> tuple[str, ...]: ...

    @property
    def control_ranges(self) -> Mapping[str, tuple[float, float]]: ...

    def steer(
        self,
        t_ns: int,
        *,
        insertion_mm: float | None = None,
        roll_deg: float | None = None,
        anterior_deg: float | None = None,
        left_deg: float | None = None,
    ) -> object: ...

    def manoeuvre(self, t_ns: int, name: str) -> None: ...


class Commands:
    """The commands by name. What a part of the system cannot do here is refused with the reason."""

    def __init__(self) -> None:
        self._commands: dict[str, Command] = {}

    def add(self, name: str, command: Command) -> None:
        """Carry out `command` when asked for `name`."""
        self._commands[name] = command

    def wrap(self, name: str, by: Callable[[str, Command], Command]) -> None:
        """Put what `by` makes of a command that is there into its place."""
        if name in self._commands:
            self._commands[name] = by(name, self._commands[name])

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the answer to a command, JSON-able.

        Raises:
            ConfigError: there is no such command, or its arguments are not what it takes.
            CathxrError: it cannot be done now; the sentence says why.
        """
        command = self._commands.get(name)
        if command is None:
            raise ConfigError(f"There is no command {name!r}: there are {', '.join(sorted(self._commands))}.")
        return command(args)


def steer_command(world: Steerable | None, clock: Clock) -> Command:
    """Return the command that sets the twin's controls: a number for each of those to be changed."""

    def steer(args: Mapping[str, Any]) -> Mapping[str, Any]:
        here = _required(world, "steer")
        only("steer", args, tuple(here.control_ranges))
        if not args:
            raise ConfigError(f"The command steer expects at least one of {', '.join(here.control_ranges)}.")
        values = {key: _number("steer", key, value) for key, value in args.items()}
        for key, (low, high) in ((key, here.control_ranges[key]) for key in values):
            if not low <= values[key] <= high:
                raise ConfigError(f"steer: {key} goes from {low:g} to {high:g}, {values[key]:g} was asked for.")
        here.steer(clock.now_ns(), **values)
        return values

    return steer


def manoeuvre_command(world: Steerable | None, clock: Clock) -> Command:
    """Return the command that starts one of the twin's scripted manoeuvres: {name}."""

    def manoeuvre(args: Mapping[str, Any]) -> Mapping[str, Any]:
        here = _required(world, "run a manoeuvre")
        only("manoeuvre", args, ("name",))
        name = args.get("name")
        if name not in here.manoeuvres:
            raise ConfigError(f"There is no manoeuvre {name!r}: there are {', '.join(here.manoeuvres)}.")
        here.manoeuvre(clock.now_ns(), str(name))
        return {"name": name}

    return manoeuvre


def roll_command(name: str, act: Callable[[], None] | None, done: Callable[[], None]) -> Command:
    """Return a command without arguments that has `act` done to the encoder and then calls `done`."""

    def command(args: Mapping[str, Any]) -> Mapping[str, Any]:
        only(name, args, ())
        if act is None:
            raise ConfigError("This source has no roll encoder of its own: there is nothing to confirm or set.")
        act()
        done()
        return {}

    return command


def only(command: str, args: Mapping[str, Any], known: tuple[str, ...]) -> None:
    """Raise ConfigError where `args` holds a key that the command does not take."""
    unknown = sorted(set(args) - set(known))
    if unknown:
        takes = f"takes {', '.join(known)}" if known else "takes no arguments"
        raise ConfigError(f"The command {command} does not know {', '.join(map(repr, unknown))}: it {takes}.")


def _required(world: Steerable | None, what: str) -> Steerable:
    if world is None:
        raise ConfigError(f"Only the digital twin can {what}: start with --source twin.")
    return world


def _number(command: str, key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ConfigError(f"{command}: {key} must be a number, {value!r} was given.")
    return float(value)
