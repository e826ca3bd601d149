"""Command: writes what is made from messages.py, namely the TypeScript types and the schemas in docs/wire.md.

python -m cathxr.wire.generate            write both files of this checkout
python -m cathxr.wire.generate --check    write nothing; exit 1 and name the file when one is stale
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import BaseModel

from cathxr.core import ConfigError
from cathxr.wire import messages
from cathxr.wire.diag_messages import DiagReport
from cathxr.wire.training_messages import RunPath
from cathxr.wire.typescript import models_of, typescript

TYPESCRIPT_PATH = Path("web/src/generated/messages.ts")
DOCS_PATH = Path("docs/wire.md")
BEGIN = "<!-- begin: made by `python -m cathxr.wire.generate` -->"
END = "<!-- end: made by `python -m cathxr.wire.generate` -->"
_DOCS_WIDTH = 116
_KINDS: Mapping[type[BaseModel], str] = MappingProxyType(
    {messages.SceneDescription: "scene", DiagReport: "diag", RunPath: "run"}
)
"""What is no message of the link, by the name that the docs give it."""


def schema_text() -> str:
    """Return the generated part of docs/wire.md: every message with its JSON schema."""
    parts = ["### Server to client\n"]
    parts += [_section(model, sent_by_server=True) for model in models_of(messages.ServerMessage)]
    parts.append("### Client to server\n")
    parts += [_section(model, sent_by_server=False) for model in models_of(messages.ClientMessage)]
    parts.append("### `GET /scene/scene.json`\n")
    parts.append(_section(messages.SceneDescription, sent_by_server=True))
    parts.append("### `GET /training/runs/ID.json`\n")
    parts.append(_section(RunPath, sent_by_server=True))
    parts.append("### `POST /diag`\n")
    parts.append(_section(DiagReport, sent_by_server=False))
    return "\n".join(parts)


def _section(model: type[BaseModel], *, sent_by_server: bool) -> str:
    schema = model.model_json_schema(mode="serialization" if sent_by_server else "validation")
    if sent_by_server:
        _require_all(schema)
    elif "type" in schema["properties"]:
        schema["required"] = ["type", *schema.get("required", [])]
    kind = model.model_fields["type"].default if "type" in model.model_fields else _KINDS[model]
    doc = "\n".join(line.strip() for line in (model.__doc__ or "").strip().splitlines())
    return f"#### `{kind}`\n\n{doc}\n\n```json\n{_compact(_bare(schema))}\n```\n"


def _require_all(schema: dict[str, Any]) -> None:
    """Mark every key as required, also those that have a default: what the server sends always has them all."""
    for each in (schema, *schema.get("$defs", {}).values()):
        if "properties" in each:
            each["required"] = list(each["properties"])


def _bare(node: Any, *, names: bool = False) -> Any:
    """Return a schema without the titles that only repeat names. `names`: the keys are field names, not keywords."""
    if isinstance(node, dict):
        return {
            key: _bare(value, names=key in ("properties", "$defs") and not names)
            for key, value in node.items()
            if names or not (key == "title" and isinstance(value, str))
        }
    if isinstance(node, list):
        return [_bare(each) for each in node]
    return node


def _compact(node: Any, indent: str = "") -> str:
    """Return JSON text in which whatever fits on a line is on one line."""
    flat = json.dumps(node, ensure_ascii=False)
    if len(indent) + len(flat) <= _DOCS_WIDTH or not isinstance(node, dict | list) or not node:
        return flat
    deeper = indent + "  "
    if isinstance(node, dict):
        rows = [f"{json.dumps(key)}: {_compact(value, deeper)}" for key, value in node.items()]
    else:
        rows = [_compact(value, deeper) for value in node]
    opening, closing = "{}" if isinstance(node, dict) else "[]"
    return f"{opening}\n{deeper}" + f",\n{deeper}".join(rows) + f"\n{indent}{closing}"


def with_schemas(document: str) -> str:
    """Return the text of docs/wire.md with its generated part made anew.

    Raises:
        ConfigError: the two markers are not there.
    """
    before, found_begin, rest = document.partition(BEGIN)
    _, found_end, after = rest.partition(END)
    if not (found_begin and found_end):
        raise ConfigError(f"{DOCS_PATH}: the markers around the generated part are gone; put back {BEGIN} and {END}.")
    return f"{before}{BEGIN}\n\n{schema_text()}\n{END}{after}"


def generated(root: Path) -> dict[Path, str]:
    """Return the text that each generated file of the checkout at `root` must hold.

    Raises:
        ConfigError: docs/wire.md is missing or has lost its markers.
    """
    docs = root / DOCS_PATH
    if not docs.is_file():
        raise ConfigError(f"{docs} is not there; run this in a checkout of the project, or give --root.")
    return {
        root / TYPESCRIPT_PATH: typescript(),
        docs: with_schemas(docs.read_text(encoding="utf-8")),
    }


def stale(root: Path) -> list[Path]:
    """Return the generated files that differ from what messages.py says."""
    return [
        path for path, text in generated(root).items() if not path.is_file() or path.read_text(encoding="utf-8") != text
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the exit code of the command."""
    parser = argparse.ArgumentParser(prog="python -m cathxr.wire.generate", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 when a file is stale")
    parser.add_argument("--root", type=Path, default=Path(), help="the checkout (default: the current folder)")
    options = parser.parse_args(arguments)
    try:
        if options.check:
            old = stale(options.root)
            for path in old:
                print(f"{path} is stale: run `python -m cathxr.wire.generate`.", file=sys.stderr)
            return 1 if old else 0
        for path, text in generated(options.root).items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")
            print(path)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
