"""The commands that hold settings of the scene fast for every client: what a training session needs."""

from collections.abc import Mapping
from typing import Any, Protocol

from cathxr.core import ConfigError
from cathxr.runtime.commands import Command, only

MAX_SENTENCE = 200


class Lockable(Protocol):
    """Who tells the clients: the wire's Hub."""

    def publish_lock(self, values: Mapping[str, Any], sentence: str) -> None: ...


def view_commands(hub: Lockable) -> dict[str, Command]:
    """Return the commands lock_view {values, sentence} and unlock_view."""

    def lock(args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("lock_view", args, ("values", "sentence"))
        values, sentence = args.get("values"), args.get("sentence")
        if not isinstance(values, Mapping) or not values:
            raise ConfigError("lock_view: values must be an object with at least one of the scene's settings.")
        if not isinstance(sentence, str) or not 0 < len(sentence) <= MAX_SENTENCE:
            raise ConfigError(f"lock_view: sentence must say why, in 1 to {MAX_SENTENCE} characters.")
        hub.publish_lock(values, sentence)
        return {}

    def unlock(args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("unlock_view", args, ())
        hub.publish_lock({}, "")
        return {}

    return {"lock_view": lock, "unlock_view": unlock}
