"""The process that makes the heart's walls goes with the live system, also where that is killed."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

SCRIPT = """
import os, time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from cathxr.app.wall_process import _calm

if __name__ == "__main__":
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_calm) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        time.sleep(300)
"""


def _lives(pid: int) -> bool:
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_it_ends_with_a_live_system_that_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "live.py"
    script.write_text(SCRIPT)
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as live:
        assert live.stdout is not None
        child = int(live.stdout.readline())
        assert _lives(child)
        live.send_signal(signal.SIGKILL)
    until = time.monotonic() + 30.0
    while _lives(child) and time.monotonic() < until:
        time.sleep(0.05)
    assert not _lives(child)
