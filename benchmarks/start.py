"""Measures a start: from the process's beginning to the first tracked Track in a client's hands, on the twin.

python benchmarks/start.py [--starts 5]

Machines differ and shared ones are noisy: beside the seconds it gives the ratio to what a process takes that imports
the libraries alone (NumPy, SciPy's optimiser, OpenCV, Numba), measured in turn with the starts. The very first start,
which may compile, is left out.
"""

import argparse
import asyncio
import json
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

LONGEST_S = 120.0
LIBRARIES = "import numpy, scipy.optimize, cv2, numba"


async def _first_tracked(url: str) -> None:
    """Return when a tracked Track has come from a server that may not be there yet."""
    while True:
        try:
            async with connect(url, max_size=None) as link:
                async for message in link:
                    if isinstance(message, str):
                        told = json.loads(message)
                        if told["type"] == "track" and told["status"] == "tracked":
                            return
        except (OSError, ConnectionClosed):
            await asyncio.sleep(0.02)


def start_s() -> float:
    """Return how long one `cathxr run` takes until it tracks, s."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "cathxr", "run", "--source", "twin", "--port", str(port)]
    with tempfile.TemporaryDirectory() as folder:
        begun = time.perf_counter()
        with subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as run:
            try:
                asyncio.run(asyncio.wait_for(_first_tracked(f"ws://127.0.0.1:{port}/ws"), LONGEST_S))
                return time.perf_counter() - begun
            except TimeoutError:
                run.kill()
                raise SystemExit(f"nothing was tracked within {LONGEST_S:.0f} s: {run.communicate()[1]}") from None
            finally:
                run.send_signal(signal.SIGINT)
                run.communicate(timeout=LONGEST_S)


def imports_s() -> float:
    """Return how long a process takes that only imports the libraries, s."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, "-c", LIBRARIES], check=True)
    return time.perf_counter() - begun


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--starts", type=int, default=5)
    wanted = max(1, parser.parse_args().starts)
    measured: dict[Callable[[], float], list[float]] = {start_s: [], imports_s: []}
    start_s()
    for _ in range(wanted):
        for what, results in measured.items():
            results.append(what())
    starts, imports = measured.values()
    middle, other = statistics.median(starts), statistics.median(imports)
    print(
        f"start to the first tracked Track: {middle:.2f} s (median of {wanted}; {min(starts):.2f} to {max(starts):.2f})"
    )
    print(f"importing the libraries alone: {other:.2f} s; ratio {middle / other:.1f}")


if __name__ == "__main__":
    main()
