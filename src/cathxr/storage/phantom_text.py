"""A Phantom as the text of phantom.toml."""

from typing import Any

from cathxr.core.phantom import Phantom
from cathxr.storage.phantom_file import SCHEMA, phantom_from_text
from cathxr.storage.toml_text import table_text


def phantom_to_text(phantom: Phantom) -> str:
    """Return a phantom as the text of phantom.toml; `phantom_from_text` gives it back.

    Raises:
        ConfigError: it holds what the file must not say, such as two holes too near to each other.
    """
    head: dict[str, Any] = {"schema": SCHEMA, "name": phantom.name}
    if phantom.catheter_diameter_mm is not None:
        head["catheter_diameter_mm"] = float(phantom.catheter_diameter_mm)
    head["position_std_mm"] = float(phantom.position_std_mm)
    text = table_text((), head)
    for hole in phantom.holes:
        values: dict[str, Any] = {"name": hole.name, "position_mm": hole.position_mm.tolist()}
        if hole.region:
            values["region"] = hole.region
        text += "\n[[holes]]\n" + table_text((), values)
    phantom_from_text(text, name=f"phantom {phantom.name!r}")
    return text
