"""tools/set_up.py: when it installs, when it does not, and what it says when it cannot."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture
def tool(repo_root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The tool on a made-up project; `tool.done` lists what it installed."""
    spec = importlib.util.spec_from_file_location("set_up_tool", repo_root / "tools" / "set_up.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name in ("requirements.lock", "requirements-dev.lock", "pyproject.toml", "hatch_build.py"):
        (tmp_path / name).write_text("a==1\n")
    (tmp_path / "src" / "cathxr").mkdir(parents=True)
    (tmp_path / "src" / "cathxr" / "__init__.py").touch()
    done: list[str] = []

    def make_venv() -> None:
        (tmp_path / ".venv").mkdir(exist_ok=True)
        done.append("venv")

    settings = {
        "ROOT": tmp_path,
        "VENV": tmp_path / ".venv",
        "STAMP": tmp_path / ".venv" / "stamp.json",
        "PYTHON": Path(sys.executable),
        "done": done,
        "fresh": True,
        "make_venv": make_venv,
        "install": done.append,
        "install_project": lambda: done.append("project"),
        "succeeds": lambda _command: module.__dict__["fresh"],
    }
    monkeypatch.delenv("CATHXR_SKIP_WEB", raising=False)
    for name, value in settings.items():
        monkeypatch.setattr(module, name, value, raising=False)
    return module


def test_a_second_run_does_nothing(tool: ModuleType) -> None:
    tool.set_up("runtime")
    assert tool.done == ["venv", "runtime"]
    tool.set_up("runtime")
    assert tool.done == ["venv", "runtime"]


def test_dev_holds_runtime_but_not_the_reverse(tool: ModuleType) -> None:
    tool.set_up("runtime")
    tool.set_up("dev")
    tool.set_up("runtime")
    assert tool.done == ["venv", "runtime", "venv", "dev"]


@pytest.mark.parametrize("name", ["requirements.lock", "pyproject.toml", "hatch_build.py", "src/cathxr/__init__.py"])
def test_a_change_installs_again(tool: ModuleType, name: str) -> None:
    tool.set_up("runtime")
    (tool.ROOT / name).write_text("b==2\n")
    tool.set_up("runtime")
    assert tool.done == ["venv", "runtime"] * 2


def test_a_changed_web_page_is_built_again(tool: ModuleType) -> None:
    tool.set_up("runtime")
    tool.fresh = False
    tool.set_up("runtime")
    assert tool.done == ["venv", "runtime", "project"]


def test_a_broken_off_install_is_taken_up_again(tool: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    tool.set_up("runtime")

    def fail(_level: str) -> None:
        raise tool.SetUpError("no network")

    with monkeypatch.context() as patched:
        patched.setattr(tool, "install", fail)
        with pytest.raises(tool.SetUpError):
            tool.set_up("dev")
    tool.set_up("runtime")
    assert tool.done[-1] == "runtime"


def test_a_missing_venv_module_is_named(tool: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tool.shutil, "which", lambda _name: None)
    with pytest.raises(tool.SetUpError, match=r"without its venv module: install it .*python3-venv"):
        tool.install_venv_module()
