"""Ten minutes of the live system (`make prove`): memory stays small and flat, nothing dies. Writes docs/soak.md."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from cathxr.app.bench_live import live_process, resident_mb

MINUTES = 10.0
WARM_UP_S = 60.0
EVERY_S = 5.0
MOST_MB = 600.0  # the limit
FLAT_MB = 15.0  # a leak of one 1280x720 picture a minute would show twice over


@pytest.mark.proof
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory is read from /proc, which only Linux has")
def test_memory_is_small_and_flat_over_ten_minutes(repo_root: Path) -> None:
    with live_process() as (process, port):
        time.sleep(3.0)
        seconds = MINUTES * 60.0
        client = subprocess.Popen(
            [sys.executable, "-m", "cathxr.app.bench_client", str(port), str(seconds), "1"],
            stdout=subprocess.PIPE,
            text=True,
        )
        begun_s = time.monotonic()
        samples = []
        while time.monotonic() - begun_s < seconds:
            time.sleep(EVERY_S)
            assert process.poll() is None
            memory = resident_mb(process.pid)
            assert memory is not None
            samples.append((time.monotonic() - begun_s, memory))
        said, _ = client.communicate(timeout=60.0)
    assert '"tracked"' in said
    table = np.array(samples)
    warm = table[table[:, 0] > WARM_UP_S]
    third = len(warm) // 3
    growth = float(warm[-third:, 1].mean() - warm[:third, 1].mean())
    most = float(table[:, 1].max())
    _write(repo_root / "docs" / "soak.md", table, growth)
    assert most < MOST_MB
    assert growth < FLAT_MB


def _write(path: Path, table: np.ndarray[tuple[int, int], np.dtype[np.float64]], growth: float) -> None:
    rows = [f"| {minute} | {np.interp(60.0 * minute, table[:, 0], table[:, 1]):.0f} |" for minute in range(1, 11)]
    text = "\n".join(
        [
            "# Ten minutes live",
            "",
            "Made by `make prove` (tests/e2e/test_soak.py): `cathxr run` on the twin, 2 x 1280x720, one client, Linux.",
            "",
            "| minute | memory, MB |",
            "|---|---|",
            *rows,
            "",
            f"Most: {table[:, 1].max():.0f} MB. Last third against first third after a minute: {growth:+.1f} MB.",
            "",
        ]
    )
    path.write_text(text, encoding="utf-8", newline="\n")
