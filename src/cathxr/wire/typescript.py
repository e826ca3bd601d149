"""TypeScript for the messages: what the web client imports. Pure: models in, text out."""

import types
from collections.abc import Iterator, Mapping
from enum import IntEnum
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from cathxr.wire import (
    calibration_messages,
    diag_messages,
    heart_messages,
    messages,
    setup_messages,
    training_messages,
    view_messages,
)
from cathxr.wire.message import Matrix4, Message, Quaternion, Vector2, Vector3

_HEADER = """\
// Generated from src/cathxr/wire/messages.py by `python -m cathxr.wire.generate`. Do not edit.
"""

_SCALARS: Mapping[Any, str] = types.MappingProxyType(
    {str: "string", int: "number", float: "number", bool: "boolean", type(None): "null", Any: "unknown"}
)


def models_of(annotation: Any) -> tuple[type[BaseModel], ...]:
    """Return the members of a union of models, such as `messages.ServerMessage`, in order."""
    union = get_args(annotation)[0]
    return tuple(get_args(union))


def all_models() -> Iterator[type[Message]]:
    """Yield every message and part of a message, in the order of the modules."""
    for module in (
        calibration_messages,
        heart_messages,
        view_messages,
        training_messages,
        setup_messages,
        diag_messages,
        messages,
    ):
        for value in vars(module).values():
            if isinstance(value, type) and issubclass(value, Message) and value.__module__ == module.__name__:
                yield value


def typescript() -> str:
    """Return the whole of messages.ts."""
    aliases = {"Vector2": Vector2, "Vector3": Vector3, "Quaternion": Quaternion, "Matrix4": Matrix4}
    sent = models_of(messages.ClientMessage)
    received = models_of(messages.ServerMessage)
    blocks = [
        _HEADER,
        f"/** The protocol version that these types describe. */\nexport const PROTOCOL = {messages.PROTOCOL};\n",
        "/** Tracks in flight, at most, to a client that acknowledges. */\n"
        f"export const ACK_WINDOW = {messages.ACK_WINDOW};\n",
        _constants("CLOSE_CODE", messages.CloseCode),
        "\n".join(f"export type {name} = {_tuple_text(get_args(alias), {})};" for name, alias in aliases.items())
        + "\n",
    ]
    blocks += [_interface(model, aliases, optional=model in sent) for model in all_models()]
    blocks.append(_union("ServerMessage", "What the server sends.", received))
    blocks.append(_union("ClientMessage", "What a client sends.", sent))
    return "\n".join(blocks)


def _interface(model: type[BaseModel], aliases: Mapping[str, Any], *, optional: bool) -> str:
    lines = [_comment(model.__doc__ or "", indent=""), f"export interface {model.__name__} {{"]
    for name, field in model.model_fields.items():
        if field.description:
            lines.append(_comment(field.description, indent="  "))
        mark = "?" if optional and name != "type" and not field.is_required() else ""
        lines.append(f"  {field.alias or name}{mark}: {_type_text(field.annotation, aliases)};")
    lines.append("}\n")
    return "\n".join(lines)


def _type_text(annotation: Any, aliases: Mapping[str, Any]) -> str:
    """Return the TypeScript of one annotation.

    Raises:
        TypeError: the generator knows no such type.
    """
    for name, alias in aliases.items():
        if annotation == alias:
            return name
    if annotation in _SCALARS:
        return _SCALARS[annotation]
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type_text(arguments[0], aliases)
    if origin is Literal:
        return " | ".join(f'"{each}"' for each in arguments)
    if origin in (Union, types.UnionType):
        return " | ".join(_type_text(each, aliases) for each in arguments)
    if origin is tuple:
        return _tuple_text(arguments, aliases)
    if origin is list:
        inner = _type_text(arguments[0], aliases)
        return f"({inner})[]" if "|" in inner else f"{inner}[]"
    if origin is dict:
        return f"Record<string, {_type_text(arguments[1], aliases)}>"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation.__name__
    raise TypeError(f"messages.py: the generator has no TypeScript for {annotation!r}; extend wire/typescript.py")


def _tuple_text(arguments: tuple[Any, ...], aliases: Mapping[str, Any]) -> str:
    return "[" + ", ".join(_type_text(each, aliases) for each in arguments) + "]"


def _union(name: str, text: str, models: tuple[type[BaseModel], ...]) -> str:
    members = "".join(f"\n  | {model.__name__}" for model in models)
    return f"/** {text} */\nexport type {name} ={members};\n"


def _constants(name: str, values: type[IntEnum]) -> str:
    rows = "".join(f"  {each.name}: {each.value},\n" for each in values)
    return f"{_comment(values.__doc__ or '', indent='')}\nexport const {name} = {{\n{rows}}} as const;\n"


def _comment(text: str, *, indent: str) -> str:
    # The end mark of a block comment must not come up inside one.
    lines = [line.strip() for line in text.replace("*/", "* /").strip().splitlines()]
    if len(lines) == 1:
        return f"{indent}/** {lines[0]} */"
    body = "\n".join(f"{indent} * {line}".rstrip() for line in lines)
    return f"{indent}/**\n{body}\n{indent} */"
