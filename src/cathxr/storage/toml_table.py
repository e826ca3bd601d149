"""Reads TOML with checks: every wrong, missing or unknown key becomes one sentence that names the file and the key."""

import math
import tomllib
from collections.abc import Mapping
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

import numpy as np

from cathxr.core import ConfigError, FloatArray
from cathxr.storage.atomic import os_reason

_LARGEST = 4_000_000


def read_text(path: Path, *, what: str) -> str:
    """Return the text of a UTF-8 file (a byte order mark is dropped). `what` names its kind in the sentences.

    Raises:
        ConfigError: missing, a folder, unreadable, empty, far too large, or not UTF-8.
    """
    if path.is_dir():
        raise ConfigError(f"{path}: expected {what}, got a folder; give the path of the file itself.")
    try:
        if path.stat().st_size > _LARGEST:
            raise ConfigError(f"{path}: expected {what}, got a file of over 4 MB; check that it is the right file.")
        raw = path.read_bytes()
    except FileNotFoundError as error:
        raise ConfigError(f"{path}: no such file; check the path of {what}.") from error
    except (OSError, ValueError) as error:
        reason = os_reason(error) if isinstance(error, OSError) else str(error)
        raise ConfigError(f"{path}: cannot read {what} ({reason}); check the path and its permissions.") from error
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"{path}: expected {what} in UTF-8 text, got other bytes at position {error.start}; save it as UTF-8."
        ) from error
    if not text.strip():
        raise ConfigError(f"{path}: expected {what}, got an empty file; docs/formats.md shows what it holds.")
    return text


def parsed(text: str, *, name: str) -> dict[str, Any]:
    """Return the TOML document `text` as a dictionary; `name` is the file's name in the sentence.

    Raises:
        ConfigError: it is not TOML.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{name}: expected TOML, got a mistake in it: {error}; correct that place.") from error


def described(value: Any) -> str:
    """Return what a TOML value is, in a few words for a sentence."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"the text {value[:40]!r}"
    if isinstance(value, list):
        wrong = next((each for each in value if isinstance(each, bool) or not isinstance(each, int | float)), None)
        return f"a list of {len(value)}" + ("" if wrong is None else f" holding {described(wrong)}")
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, date | datetime | time):
        return f"the date {value.isoformat()}"
    return str(value)[:40]


class Table:
    """One table of a TOML document. Ask for each key, then call `finish`: what nobody asked for is an error."""

    def __init__(self, values: Mapping[str, Any], *, file: str, path: str = "") -> None:
        self.values = values
        self.file = file
        self.path = path
        self._asked: set[str] = set()

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def error(self, key: str, sentence: str) -> ConfigError:
        """Return the error to raise about `key`."""
        return ConfigError(f"{self.file}: {self._path_of(key)}: {sentence}")

    def asked(self, key: str, *, example: str) -> Any:
        """Return the raw value of a key that must be there; `example` is what a person could write.

        Raises:
            ConfigError: the key is missing.
        """
        self._asked.add(key)
        if key not in self.values:
            raise self.error(key, f"expected this key, got none; add it, for example {example}.")
        return self.values[key]

    def table(self, key: str, *, example: str = "") -> "Table":
        """Return the sub-table `key`."""
        value = self.asked(key, example=example or f"the table [{self._path_of(key)}]")
        if not isinstance(value, dict):
            raise self.error(key, f"expected a table, got {described(value)}; write it as [{self._path_of(key)}].")
        return Table(value, file=self.file, path=self._path_of(key))

    def text(self, key: str, *, example: str, may_be_empty: bool = False) -> str:
        """Return the text of `key`."""
        value = self.asked(key, example=example)
        if not isinstance(value, str) or not (value or may_be_empty):
            got = "an empty text" if value == "" else described(value)
            raise self.error(key, f"expected text, got {got}; write for example {example}.")
        return value

    def number(
        self, key: str, *, example: str, minimum: float = -math.inf, above: float = -math.inf, maximum: float = math.inf
    ) -> float:
        """Return the finite number `key`, at least `minimum`, greater than `above`, at most `maximum`."""
        value = _finite(self.asked(key, example=example))
        if value is None or not (minimum <= value <= maximum and value > above):
            limits = _limits(minimum, above, maximum)
            got = described(self.values[key])
            raise self.error(key, f"expected a number{limits}, got {got}; write for example {example}.")
        return value

    def integer(self, key: str, *, example: str, minimum: int, maximum: int) -> int:
        """Return the whole number `key` within its limits, both included."""
        value = self.asked(key, example=example)
        if isinstance(value, bool) or not isinstance(value, int) or not minimum <= value <= maximum:
            raise self.error(
                key,
                f"expected a whole number from {minimum} to {maximum}, got {described(value)}; "
                f"write for example {example}.",
            )
        return value

    def vector(self, key: str, length: int, *, example: str) -> FloatArray:
        """Return the list of `length` finite numbers (length,)."""
        value = self.asked(key, example=example)
        numbers = [_finite(each) for each in value] if isinstance(value, list) else []
        exact = [each for each in numbers if each is not None]
        if len(numbers) != length or len(exact) != length:
            raise self.error(
                key, f"expected {length} finite numbers, got {described(value)}; write for example {example}."
            )
        return np.array(exact)

    def matrix(self, key: str, rows: int, columns: int) -> FloatArray:
        """Return the list of `rows` lists of `columns` finite numbers (rows, columns)."""
        value = self.asked(key, example=f"{rows} rows of {columns} numbers")
        lists = value if isinstance(value, list) else []
        cells = [[_finite(each) for each in row] if isinstance(row, list) else [] for row in lists]
        exact = [[each for each in row if each is not None] for row in cells]
        if len(exact) != rows or any(len(row) != columns for row in exact) or any(len(row) != columns for row in cells):
            raise self.error(
                key,
                f"expected {rows} rows of {columns} finite numbers, got {described(value)}; "
                "write one list for each row, or leave the key out.",
            )
        return np.array(exact)

    def finish(self) -> None:
        """Return when every key was asked for.

        Raises:
            ConfigError: there is a key that nobody knows.
        """
        unknown = [key for key in self.values if key not in self._asked]
        if unknown:
            known = ", ".join(sorted(self._asked)) or "none"
            raise self.error(
                unknown[0], f"expected one of the known keys ({known}), got an unknown one; correct or remove it."
            )

    def know(self, *keys: str) -> None:
        """Mark keys as known although they may be absent."""
        self._asked.update(keys)

    def _path_of(self, key: str) -> str:
        return f"{self.path}.{key}" if self.path else key


def _finite(value: Any) -> float | None:
    """Return a TOML number as a float; None for anything else, NaN, infinity, and what a float cannot hold."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _limits(minimum: float, above: float, maximum: float) -> str:
    parts = []
    if above > -math.inf:
        parts.append(f"greater than {above:g}")
    if minimum > -math.inf:
        parts.append(f"of at least {minimum:g}")
    if maximum < math.inf:
        parts.append(f"at most {maximum:g}")
    return " " + " and ".join(parts) if parts else ""
