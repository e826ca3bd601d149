"""Every command that a text names exists, and every command explains itself with an example."""

import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

_SPANS = re.compile(r"^```.*?^```|`[^`\n]+`", re.MULTILINE | re.DOTALL)
_TEXTS = ("README.md", "ARCHITECTURE.md", "CONVENTIONS.md")


def _code(path: Path) -> str:
    """Return what stands as code in a Markdown text."""
    return "\n".join(match[0].strip("`") for match in _SPANS.finditer(path.read_text(encoding="utf-8")))


def _root_command() -> click.Group:
    module = import_module("cathxr.app.cli")
    for name in ("main", "cli"):
        if isinstance(command := getattr(module, name, None), click.Group):
            return command
    raise AssertionError("cathxr.app.cli: expected a click group named `main` or `cli`")


def _walk(command: click.Command, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    yield path, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from _walk(found, (*path, name))


@pytest.mark.parametrize("text", _TEXTS)
def test_make_targets_in_texts_exist(repo_root: Path, text: str) -> None:
    targets = set(re.findall(r"^([a-z][a-z-]*):", (repo_root / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert {"demo", "test", "bench", "prove", "lint", "lock", "clean", "help"} <= targets
    named = set(re.findall(r"^(?:\$ )?make ([a-z][a-z-]*)", _code(repo_root / text), re.MULTILINE))
    assert named <= targets, f"{text} names make targets that do not exist"


def test_readme_names_the_main_targets(repo_root: Path) -> None:
    assert {"make demo", "make test"} <= set(re.findall(r"make [a-z]+", _code(repo_root / "README.md")))


def test_commands_in_the_readme_exist(repo_root: Path) -> None:
    known = set(_root_command().commands) | set(_root_command().list_commands(click.Context(_root_command())))
    named = set(re.findall(r"^(?:\$ )?cathxr ([a-z]+)\b", _code(repo_root / "README.md"), re.MULTILINE))
    assert named <= known, "README.md names commands that do not exist"


def test_every_command_has_an_example() -> None:
    root = _root_command()
    without = []
    for path, command in _walk(root, ("cathxr",)):
        shown = CliRunner().invoke(root, [*path[1:], "--help"], prog_name="cathxr")
        assert shown.exit_code == 0, f"{' '.join(path)} --help: {shown.output}"
        if command is not root and not isinstance(command, click.Group) and "Example" not in shown.output:
            without.append(" ".join(path))
    assert not without, f"no Example in the help of {without}"
