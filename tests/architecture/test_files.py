"""Every file is short, is plain text with line feeds, and names no machine and no package registry."""

import json
import re
from pathlib import Path

import pytest

_LONGEST = 400
# Put together here, so that this file itself does not hold what it looks for.
_REGISTRIES = re.compile(
    "|".join(("pypi" + r"\.org", "python" + r"hosted\.", "registry" + r"\.npmjs", "deb" + r"\.debian"))
)
_MACHINE_PATHS = re.compile(r"(?<![\w.~-])/" + r"(?:wo" + "rk|ro" + "ot|opt/py" + r"pi|tmp/ba" + r"sh_jobs)(?:/|\b)")


def _offending(files: tuple[Path, ...], pattern: re.Pattern[str]) -> list[str]:
    found = []
    for path in files:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if match := pattern.search(line):
                found.append(f"{path.name}:{number}: {match[0]}")
    return found


def test_source_files_are_short(repo_files: tuple[Path, ...]) -> None:
    # The generated types grow with the wire's messages, and nobody reads them as a file.
    written = [path for path in repo_files if "generated" not in path.parts]
    sources = [path for path in written if path.suffix in (".py", ".ts")]
    long = {str(path): count for path in sources if (count := path.read_bytes().count(b"\n")) > _LONGEST}
    assert not long, f"longer than {_LONGEST} lines: {long}"


def test_text_is_utf8_with_line_feeds(text_files: tuple[Path, ...]) -> None:
    for path in text_files:
        content = path.read_bytes()
        content.decode("utf-8")
        assert b"\r" not in content, f"{path} holds carriage returns"
        assert b"\0" not in content, (
            f"{path} is binary: name its suffix in .gitattributes and in this folder's conftest.py"
        )


def test_no_machine_path_is_named(text_files: tuple[Path, ...]) -> None:
    assert _offending(text_files, _MACHINE_PATHS) == []


def test_no_package_registry_is_named(text_files: tuple[Path, ...]) -> None:
    assert _offending(text_files, _REGISTRIES) == []


@pytest.mark.parametrize("text", ["cd /wo" + "rk/x", "'/ro" + "ot/.cache'", "see /wo" + "rk"])
def test_machine_paths_are_recognised(text: str) -> None:
    assert _MACHINE_PATHS.search(text)


@pytest.mark.parametrize(
    "text", ["../shared/data", "a net/wo" + "rk/x", "the wo" + "rk/life balance", "/wo" + "rkspace"]
)
def test_other_paths_are_not(text: str) -> None:
    assert not _MACHINE_PATHS.search(text)


def test_python_locks_hold_names_and_versions_only(repo_root: Path) -> None:
    for name in ("requirements.lock", "requirements-dev.lock"):
        lines = (repo_root / name).read_text(encoding="utf-8").splitlines()
        assert len(lines) > 20, f"{name} is all but empty"
        wrong = [line for line in lines if not re.fullmatch(r"[a-z0-9._-]+==[a-z0-9.!+-]+( ; [\w .'<>=!()]+)?", line)]
        assert not wrong, f"{name}: expected name==version, maybe with a marker; make it again with `make lock`"


def test_web_lock_holds_no_addresses(repo_root: Path) -> None:
    lock = json.loads((repo_root / "web" / "package-lock.json").read_text(encoding="utf-8"))
    assert lock["packages"], "web/package-lock.json lists no packages"
    with_address = [name for name, entry in lock["packages"].items() if "resolved" in entry]
    assert with_address == [], "add omit-lockfile-registry-resolved=true to web/.npmrc and lock again"
    npmrc = (repo_root / "web" / ".npmrc").read_text(encoding="utf-8")
    assert "omit-lockfile-registry-resolved=true" in npmrc.split()


def test_web_scripts_start_no_second_npm(repo_root: Path) -> None:
    # The npm that pip's Node.js package brings is started by its script's path: by name it is not found.
    scripts = json.loads((repo_root / "web" / "package.json").read_text(encoding="utf-8"))["scripts"]
    assert "build" in scripts
    calling = {name for name, command in scripts.items() if re.search(r"\b(npm|npx)\b", command)}
    assert not calling, f"these scripts of web/package.json call npm or npx: {calling}; chain the programs themselves"
