"""Reads TOML texts of the study package against a model: every fault is one sentence with the file and the key."""

import tomllib
from typing import Annotated, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from cathxr.core import ConfigError
from cathxr.core.plain_text import plain_text_fault


class Strict(BaseModel):
    """A table of TOML without unknown keys, in which a text is no number, and numbers are finite."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def _shown(text: str) -> str:
    fault = plain_text_fault(text, lines=True)
    if fault is not None:
        raise ValueError(fault)
    return text


def _shown_if_any(text: str) -> str:
    return _shown(text) if text else text


OptionalText = Annotated[str, AfterValidator(_shown_if_any)]
"""A text that may be empty."""
Text = Annotated[str, AfterValidator(_shown)]
"""A text that people read: not blank, at most 2000 characters, no control characters but ends of lines and tabs."""


M = TypeVar("M", bound=BaseModel)


def read_toml(text: str, model: type[M], *, name: str, schema: str, guide: str) -> M:
    """Return the TOML document `text` as a `model`.

    name: the file's name in the sentences; schema: what its key `schema` must say; guide: the page that describes it.

    Raises:
        ConfigError: it is not TOML, of another schema, or a key is missing, unknown or has a value it cannot have.
    """
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{name}: expected TOML, got a mistake in it: {error}; correct that place.") from error
    if document.get("schema") != schema:
        found = repr(document["schema"])[:60] if "schema" in document else "none"
        raise ConfigError(f'{name}: schema: expected "{schema}", got {found}; write schema = "{schema}".')
    try:
        return model.model_validate(document)
    except ValidationError as error:
        raise ConfigError(f"{name}: {_first_fault(error)}. {guide} describes the file.") from error


def _first_fault(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in first["loc"]) or "the document"
    if first["type"] == "missing":
        return f"{where}: expected this key, got none; add it"
    if first["type"] == "extra_forbidden":
        return f"{where}: not a key of this file; correct or remove it"
    if first["type"] == "value_error":
        return f"{where}: {first['ctx']['error']}"
    told = first["msg"][:1].lower() + first["msg"][1:]
    return f"{where}: {told}, got {first['input']!r:.60}"
