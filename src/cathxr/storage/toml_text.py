"""Writes TOML as a person would: one line for a value, inline tables where asked, numbers to the last bit."""

import json
import math
import re
from collections.abc import Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+\Z")
_WIDE = 100


def value_text(value: Any) -> str:
    """Return a number, truth value, text, list or mapping (inline) as TOML on one line.

    Raises:
        ValueError: TOML has no such value (None, NaN, a lone surrogate).
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        value.encode("utf-8")
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError("expected a finite number, got NaN or infinity")
        return repr(float(value))
    if isinstance(value, list | tuple):
        return f"[{', '.join(value_text(each) for each in value)}]"
    if isinstance(value, Mapping):
        inside = ", ".join(f"{key_text(key)} = {value_text(each)}" for key, each in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    raise ValueError(f"expected a number, text, list or table, got {type(value).__name__}")


def key_text(key: str) -> str:
    """Return a TOML key, quoted where it must be."""
    return key if _BARE.match(key) else value_text(key)


def table_text(path: tuple[str, ...], values: Mapping[str, Any]) -> str:
    """Return the lines of one table: its header (none for an empty path) and its keys. Wide matrices go row by row."""
    lines = [f"[{'.'.join(key_text(each) for each in path)}]"] if path else []
    for key, value in values.items():
        text = value_text(value)
        if len(text) > _WIDE and isinstance(value, list) and value and isinstance(value[0], list):
            text = "[\n" + "".join(f"    {value_text(row)},\n" for row in value) + "]"
        lines.append(f"{key_text(key)} = {text}")
    return "\n".join(lines) + "\n"
