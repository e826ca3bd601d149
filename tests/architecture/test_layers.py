"""Imports keep to the architecture, and only the outer packages touch sockets, threads, serial ports and clocks."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

_IMPURE_PACKAGES = {"devices", "storage", "wire", "runtime", "app"}
_FORBIDDEN = {
    *("time", "sched", "signal"),
    *("socket", "socketserver", "select", "selectors", "ssl", "asyncio", "http", "urllib"),
    *("threading", "_thread", "queue", "concurrent", "multiprocessing", "subprocess"),
    *("serial", "usb"),
    *("anyio", "fastapi", "httpx", "starlette", "uvicorn", "websockets"),
}
_CLOCK_CALLS = {"now", "utcnow", "today"}


def _impurities(source: str) -> set[str]:
    """Return the forbidden modules that a source imports, and the clocks of `datetime` that it reads."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names} & _FORBIDDEN
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found |= {node.module.split(".")[0]} & _FORBIDDEN
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in _CLOCK_CALLS:
            owner = ast.unparse(node.func.value)
            if owner.split(".")[-1] in ("datetime", "date"):
                found.add(f"{owner}.{node.func.attr}")
    return found


def test_pure_packages_touch_no_clock_socket_or_thread(repo_root: Path) -> None:
    package = repo_root / "src" / "cathxr"
    pure = [path for path in package.glob("*/**/*.py") if path.relative_to(package).parts[0] not in _IMPURE_PACKAGES]
    assert pure
    wrong = {str(path.relative_to(package)): found for path in pure if (found := _impurities(path.read_text("utf-8")))}
    assert not wrong, "only devices, storage, wire, runtime and app may use these; elsewhere time comes as data"


@pytest.mark.parametrize(
    "source",
    [
        "import time",
        "def f():\n    from threading import Thread",
        "import urllib.request",
        "import datetime\ndatetime.datetime.now()",
    ],
)
def test_impure_sources_are_recognised(source: str) -> None:
    assert _impurities(source)


def test_pure_sources_are_not() -> None:
    assert not _impurities("import numpy\nfrom datetime import date\nfrom . import time\nclock.now()")


def test_every_package_has_its_layer(repo_root: Path) -> None:
    settings = tomllib.loads((repo_root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    layers = next(each for each in settings["contracts"] if each["type"] == "layers")
    assert layers["exhaustive"]
    order = [[name.strip(" ()") for name in layer.split("|")] for layer in layers["layers"]]
    assert [row for row in order if len(row) == 1] == [["__main__"], ["app"], ["runtime"], ["geometry"], ["core"]]
    packages = {path.parent.name for path in (repo_root / "src" / "cathxr").glob("*/__init__.py")}
    assert packages <= {name for row in order for name in row}


def test_imports_keep_the_layers(repo_root: Path) -> None:
    program = Path(sys.executable).with_name("lint-imports.exe" if sys.platform == "win32" else "lint-imports")
    done = subprocess.run([str(program), "--no-cache"], cwd=repo_root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 kept, 0 broken" in done.stdout
