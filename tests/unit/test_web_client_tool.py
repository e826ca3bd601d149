"""tools/web_client.py on a tiny web/ and a made-up npm that only copies."""

import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="the made-up npm is a shell script")

_NPM = """#!/bin/sh
echo "$*" >> "$PWD/../calls"
case "$*" in
  ci*) [ -f package-lock.json ] && mkdir -p node_modules ;;
  "run build") [ ! -f broken ] || { echo "src/main.ts: it is broken"; exit 3; }
    out=../src/cathxr/web_client
    mkdir -p $out && cp main.ts $out/index.html && cp main.ts $out/calibrate.html && cp main.ts $out/heart.html \
      && cp main.ts $out/diag.html && cp main.ts $out/setup.html ;;
esac
"""


@pytest.fixture
def tool(repo_root: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("web_client_tool", repo_root / "tools" / "web_client.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with a web/ of three files, and PATH with an npm that notes how it was called."""
    programs, web = tmp_path / "bin", tmp_path / "web"
    for folder in (programs, web, tmp_path / "src" / "cathxr"):
        folder.mkdir(parents=True)
    for name, script in (("npm", _NPM), ("node", "#!/bin/sh\necho v22.12.0\n")):
        (programs / name).write_text(script)
        (programs / name).chmod(0o755)
    for name in ("package.json", "package-lock.json", "main.ts"):
        (web / name).write_text("{}")
    monkeypatch.setenv("PATH", f"{programs}:/usr/bin:/bin")
    return tmp_path


def _calls(root: Path) -> list[str]:
    return (root / "calls").read_text().splitlines()


def test_builds_once_and_again_only_after_a_change(tool: ModuleType, root: Path) -> None:
    assert not tool.is_fresh(root)
    assert tool.build(root)
    assert tool.is_fresh(root)
    assert not tool.build(root)
    assert _calls(root) == ["ci --no-audit --no-fund", "run build"]
    (root / "web" / "main.ts").write_text("changed")
    assert not tool.is_fresh(root)
    assert tool.build(root)
    assert _calls(root)[2:] == ["run build"]  # the packages are still those of the lock


def test_packages_are_installed_again_when_the_lock_changes(tool: ModuleType, root: Path) -> None:
    tool.build(root)
    (root / "web" / "package-lock.json").write_text('{"other": 1}')
    tool.build(root)
    assert _calls(root)[2:] == ["ci --no-audit --no-fund", "run build"]


def test_what_is_no_source_does_not_count(tool: ModuleType, root: Path) -> None:
    tool.build(root)
    for folder in ("node_modules", "tests", "dist"):
        (root / "web" / folder).mkdir(exist_ok=True)
        (root / "web" / folder / "new.ts").write_text("x")
    assert tool.is_fresh(root)


def test_a_renamed_source_counts(tool: ModuleType, root: Path) -> None:
    before = tool.sources_hash(root)
    (root / "web" / "main.ts").rename(root / "web" / "other.ts")
    assert tool.sources_hash(root) != before


def test_a_failed_build_says_so_and_leaves_nothing_that_looks_fresh(tool: ModuleType, root: Path) -> None:
    tool.build(root)
    (root / "web" / "broken").touch()
    with pytest.raises(tool.WebClientError, match=r"npm run build.*exit 3[\s\S]*main.ts: it is broken"):
        tool.build(root)
    (root / "web" / "broken").unlink()
    assert not tool.is_fresh(root)  # though the sources are again those of the first build


@pytest.mark.parametrize("script", ["#!/bin/sh\necho v18.19.0\n", "#!/bin/sh\nexit 1\n"])
def test_an_old_or_dead_node_is_no_node(
    tool: ModuleType, root: Path, monkeypatch: pytest.MonkeyPatch, script: str
) -> None:
    (root / "bin" / "node").write_text(script)
    monkeypatch.setattr(tool.importlib.util, "find_spec", lambda _name: None)
    assert tool.find_node() is None
    with pytest.raises(tool.WebClientError, match=r"needs Node.js 20.19 or newer"):
        tool.build(root)


def test_missing_sources_are_named(tool: ModuleType, root: Path) -> None:
    (root / "web" / "package.json").unlink()
    with pytest.raises(tool.WebClientError, match="sources are missing"):
        tool.build(root)
