"""The live system measured from outside: `cathxr run` in one process, its clients in another."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cathxr.core import DeviceError

_START_S = 180.0
_SETTLE_S = 3.0


@dataclass(frozen=True)
class LiveResult:
    """One run with a number of clients. cpu_share: of one core, for the whole server process; None where unknown."""

    clients: int
    rate_hz: float
    p50_ms: float
    p99_ms: float
    max_ms: float
    cpu_share: float | None
    memory_mb: float | None
    tip_mm: float | None
    tracked_share: float


@contextmanager
def live_process(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Give a running `cathxr run` process and its port.

    Raises:
        DeviceError: it did not come up.
    """
    command = [sys.executable, "-m", "cathxr", "run", "--port", "0", "--no-browser", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1)
    try:
        yield process, _port(process)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM if sys.platform == "win32" else signal.SIGINT)
            try:
                process.wait(5.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if process.stdout is not None:
            process.stdout.close()


def _port(process: subprocess.Popen[str]) -> int:
    """Return the port that the process says it serves."""
    said: list[str] = []
    deadline_s = time.monotonic() + _START_S
    assert process.stdout is not None
    while time.monotonic() < deadline_s:
        line = process.stdout.readline()
        if not line:
            break
        said.append(line.strip())
        found = re.search(r"http://127\.0\.0\.1:(\d+)", line)
        if found:
            return int(found.group(1))
    raise DeviceError(f"`cathxr run` did not start: {' / '.join(said) or 'it said nothing'}")


def measure(clients: int, *, seconds: float) -> LiveResult:
    """Return what `clients` clients in one other process see of the twin running live."""
    with live_process("--publish-truth") as (process, port):
        time.sleep(_SETTLE_S)
        before_s, begun_s = cpu_seconds(process.pid), time.monotonic()
        arguments = [sys.executable, "-m", "cathxr.app.bench_client", str(port), str(seconds), str(clients)]
        done = subprocess.run(arguments, capture_output=True, text=True, timeout=seconds + 60.0, check=False)
        after_s, ended_s = cpu_seconds(process.pid), time.monotonic()
        memory = resident_mb(process.pid)
    if done.returncode != 0 or not done.stdout.strip():
        raise DeviceError(f"The benchmark's clients failed: {done.stderr.strip()[-300:]}")
    result: dict[str, Any] = json.loads(done.stdout)
    if result["p50_ms"] is None:
        raise DeviceError("The benchmark's clients got no Track: the live system does not run.")
    total = sum(result["statuses"].values())
    cpu = None if before_s is None or after_s is None else (after_s - before_s) / (ended_s - begun_s)
    return LiveResult(
        clients, result["rate_hz"], result["p50_ms"], result["p99_ms"], result["max_ms"], cpu, memory,
        result["tip_mm"], result["statuses"].get("tracked", 0) / total,
    )  # fmt: skip


def cpu_seconds(pid: int) -> float | None:
    """Return the processor time a process has used, None where the system does not tell it this way."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_mb(pid: int) -> float | None:
    """Return the memory a process holds, MB, None where the system does not tell it this way."""
    try:
        text = Path(f"/proc/{pid}/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return None
    found = re.search(r"VmRSS:\s+(\d+) kB", text)
    return int(found.group(1)) / 1024.0 if found else None
