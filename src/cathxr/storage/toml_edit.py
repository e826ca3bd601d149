"""Changes values in a TOML text and leaves all the rest of it, comments included, as a person wrote it."""

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from cathxr.core import ConfigError
from cathxr.storage.toml_text import key_text, table_text, value_text

_HEADER = re.compile(r"\s*\[(?!\[)\s*([^\[\]]+?)\s*\]\s*(#.*)?$")
_ANY_HEADER = re.compile(r"\s*\[")


def with_table(text: str, path: tuple[str, ...], values: Mapping[str, Any]) -> str:
    """Return TOML `text` in which the table at `path` has exactly `values`; every other table and comment stays.

    Lines of keys that stay keep their place and their comment. A table that is not there is appended.

    Raises:
        ConfigError: the text is not TOML, or writes that table in a way that lines cannot be changed in (inline or with
        dotted keys); a value is none that TOML has.
    """
    try:
        before = tomllib.loads(text)
        lines = text.splitlines()
        first, end = _region(lines, path)
        if first is None:
            result = _appended(text, path, values)
        else:
            result = "\n".join([*lines[:first], *_changed(lines[first:end], values), *lines[end:]]) + "\n"
        after = tomllib.loads(result)
    except (tomllib.TOMLDecodeError, ValueError) as error:
        raise ConfigError(f"[{'.'.join(path)}] cannot be changed: {error}.") from error
    if after != _merged(before, path, values):
        raise ConfigError(
            f"[{'.'.join(path)}] cannot be changed line by line: write it as a table of its own, one key a line."
        )
    return result


def _region(lines: list[str], path: tuple[str, ...]) -> tuple[int | None, int]:
    """Return the lines of a table's body: the first after its header, and the one after its last."""
    for number, line in enumerate(lines):
        match = _HEADER.match(line)
        if match and _parts(match[1]) == path:
            end = next((i for i in range(number + 1, len(lines)) if _ANY_HEADER.match(lines[i])), len(lines))
            return number + 1, end
    return None, len(lines)


def _parts(header: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in header.split("."))


def _changed(body: list[str], values: Mapping[str, Any]) -> list[str]:
    """Return a table's lines with the values in them; what is new goes after the last that is not blank."""
    left = dict(values)
    result = []
    for line in body:
        key = line.partition("=")[0].strip().strip("\"'")
        if line.lstrip().startswith("#") or "=" not in line:
            result.append(line)
        elif key in left:
            result.append(f"{key_text(key)} = {value_text(left.pop(key))}{_comment(line)}")
        # a key that is not among the values goes
    # Comments at the end of a table usually belong to the next one.
    place = max(
        (i + 1 for i, line in enumerate(result) if line.strip() and not line.lstrip().startswith("#")), default=0
    )
    return [
        *result[:place],
        *(f"{key_text(key)} = {value_text(value)}" for key, value in left.items()),
        *result[place:],
    ]


def _comment(line: str) -> str:
    """Return the comment behind a value, with the room before it."""
    for match in re.finditer(r"\s*#", line):
        try:
            tomllib.loads(line[: match.start()])
        except tomllib.TOMLDecodeError:
            continue
        return line[match.start() :]
    return ""


def _appended(text: str, path: tuple[str, ...], values: Mapping[str, Any]) -> str:
    gap = "" if not text or text.endswith("\n\n") else "\n" if text.endswith("\n") else "\n\n"
    return text + gap + table_text(path, values)


def _merged(document: Mapping[str, Any], path: tuple[str, ...], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document with the table in it."""
    result = dict(document)
    if len(path) == 1:
        result[path[0]] = dict(values)
        return result
    inner = result.get(path[0], {})
    if not isinstance(inner, Mapping):
        raise ConfigError(f"{path[0]} is expected to be a table, not {inner!r}: correct it.")
    result[path[0]] = _merged(inner, path[1:], values)
    return result
