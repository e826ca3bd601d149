"""Hands one item to many takers; a taker that fails is named in Health and harms nobody else."""

import logging
from collections.abc import Callable
from threading import Lock
from typing import Generic, TypeVar

from cathxr.core import Health

Item = TypeVar("Item")
_log = logging.getLogger(__name__)


class Fanout(Generic[Item]):
    """A Sink that writes to every taker in turn, in the caller's thread. Takers never block; their errors are kept."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._takers: dict[str, Callable[[Item], object]] = {}
        self._failures: dict[str, tuple[int, str]] = {}

    def add(self, name: str, taker: Callable[[Item], object]) -> None:
        """Give every later item to `taker`; an earlier one of that name is replaced."""
        with self._lock:
            self._takers = {**self._takers, name: taker}
            self._failures.pop(name, None)

    def remove(self, name: str) -> None:
        """Give nothing more to the taker of that name."""
        with self._lock:
            self._takers = {key: each for key, each in self._takers.items() if key != name}
            self._failures.pop(name, None)

    @property
    def has_takers(self) -> bool:
        """Whether anyone takes what is written: what nobody takes need not be made."""
        return bool(self._takers)

    def write(self, item: Item) -> None:
        """Give `item` to every taker."""
        for name, taker in self._takers.items():
            try:
                taker(item)
            except Exception as error:  # stored and shown: one bad output must not stop the tracking
                self._store(name, error)

    def health(self, now_ns: int) -> tuple[Health, ...]:
        """Return one Health for each taker that has failed: losses counts the items it failed on."""
        with self._lock:
            failures = dict(self._failures)
        return tuple(Health(now_ns, name, True, None, 0.0, count, text) for name, (count, text) in failures.items())

    def _store(self, name: str, error: Exception) -> None:
        with self._lock:
            count = self._failures.get(name, (0, ""))[0] + 1
            self._failures[name] = (count, sentence(error))
        if count == 1:
            _log.error("output %s failed", name, exc_info=error)


def sentence(error: BaseException) -> str:
    """Return what an error says, with its kind where it is not one of ours or says nothing."""
    text = str(error).strip()
    kind = type(error).__name__
    return text if type(error).__module__.startswith("cathxr.") and text else f"{kind}: {text}" if text else kind
