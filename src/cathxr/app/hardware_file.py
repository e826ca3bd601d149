"""params.toml: the parameters of a rig to build, read with checks and written with what each means."""

import dataclasses
from pathlib import Path
from typing import Any

from cathxr.core import ConfigError
from cathxr.hardware.layout import Layout
from cathxr.hardware.parameters import Parameters
from cathxr.hardware.rules import Figures, check
from cathxr.storage.toml_table import Table, parsed, read_text
from cathxr.storage.toml_text import value_text

SCHEMA = "cathxr-hardware/1"
_LONGEST_MM = 5000.0
_MAY_BE_ZERO = {"thinning_mm", "centre_error_mm", "kerf_mm", "play_mm", "rod_play_mm"}
_LONGEST_NAME = 60
_SHARES = {"least_share"}
_HEAD = "# A rig to build. Every key may be left out: what stands here is the default. docs/build explains it.\n"


def read_parameters(path: Path | None) -> Parameters:
    """Return the parameters of a params.toml; the defaults where there is no path.

    Raises:
        ConfigError: one sentence with the file, the key, what was expected, and what to do.
    """
    if path is None:
        return Parameters()
    return parameters_from_text(read_text(path, what="the rig's parameters (params.toml)"), name=str(path))


def read_checked(path: Path | None) -> tuple[Layout, Figures]:
    """Return the layout of a params.toml and what it is worth.

    Raises:
        ConfigError: as `read_parameters`; or such a rig cannot be built, with the reason.
    """
    parameters = read_parameters(path)
    try:
        return Layout(parameters), check(parameters)
    except ConfigError as error:
        raise ConfigError(f"{'the default parameters' if path is None else path}: {error}") from error


def parameters_from_text(text: str, *, name: str) -> Parameters:
    """Return the parameters in the text of params.toml; `name` is the file's name in the sentences.

    Raises:
        ConfigError: see `read_parameters`.
    """
    root = Table(parsed(text, name=name), file=name)
    schema = root.asked("schema", example=f'schema = "{SCHEMA}"')
    if schema != SCHEMA:
        raise root.error("schema", f'expected "{SCHEMA}", got {schema!r}; write schema = "{SCHEMA}".')
    default = Parameters()
    found: dict[str, Any] = {}
    for group in dataclasses.fields(Parameters):
        root.know(group.name)
        if group.name not in root:
            continue
        if group.name == "name":
            found["name"] = _name(root, "name", 'name = "our box"')
        else:
            found[group.name] = _group(root.table(group.name), getattr(default, group.name))
    root.finish()
    return dataclasses.replace(default, **found)


def parameters_to_text(parameters: Parameters) -> str:
    """Return the parameters as params.toml, which `parameters_from_text` gives back."""
    lines = [_HEAD + f'schema = "{SCHEMA}"', f"name = {value_text(parameters.name)}"]
    for group in dataclasses.fields(Parameters):
        if group.name == "name":
            continue
        values = getattr(parameters, group.name)
        lines += ["", f"[{group.name}]"]
        lines += [
            f"{each.name} = {value_text(getattr(values, each.name))}" for each in dataclasses.fields(type(values))
        ]
    return "\n".join(lines) + "\n"


def _group(table: Table, default: Any) -> Any:
    found: dict[str, Any] = {}
    for each in dataclasses.fields(default):
        table.know(each.name)
        if each.name in table:
            found[each.name] = _value(table, each.name, getattr(default, each.name))
    table.finish()
    return dataclasses.replace(default, **found)


def _name(table: Table, key: str, example: str) -> str:
    """Return a name that can stand in a heading, a table and the files of a CAD program."""
    text = table.text(key, example=example)
    if len(text) > _LONGEST_NAME or not text.isprintable() or not text.strip() or set(text) & set("|<>`"):
        raise table.error(
            key,
            f"expected a name of one line, at most {_LONGEST_NAME} letters, without | < > `, got {text[:80]!r}; "
            f"write for example {example}.",
        )
    return text


def _value(table: Table, key: str, default: Any) -> Any:
    example = f"{key} = {value_text(default)}"
    if isinstance(default, str):
        return _name(table, key, example)
    if isinstance(default, int):
        return table.integer(key, example=example, minimum=1, maximum=100_000)
    if isinstance(default, tuple):
        values = table.vector(key, len(default), example=example)
        if (values <= 0).any() or (values > _LONGEST_MM).any():
            raise table.error(key, f"expected positive lengths, got {values.tolist()}; write for example {example}.")
        return tuple(float(each) for each in values)
    if key in _SHARES:
        return table.number(key, example=example, minimum=0.0, maximum=1.0)
    if key in _MAY_BE_ZERO:
        return table.number(key, example=example, minimum=0.0, maximum=_LONGEST_MM)
    return table.number(key, example=example, above=0.0, maximum=_LONGEST_MM)
