"""Measures the server: publish-to-receive latency and CPU with 1, 10 and 50 clients, on loopback only.

python benchmarks/server_load.py [--seconds 5] [--rate 60] [--json]

The server runs in this process, as in `cathxr run`; the clients run in another one. Both share the machine, and their
own work (Python's JSON above all) is in the latency; CPU is the server process's alone, in per cent of one core.
"""

import argparse
import asyncio
import json
import subprocess
import sys
import time

import numpy as np
from websockets.asyncio.client import connect

from cathxr.core import Clock, Pose, Status, Track
from cathxr.wire.hub import Hub
from cathxr.wire.messages import SceneDescription
from cathxr.wire.server import LiveServer

POINTS = 50
WARM_UP_S = 0.5


class _MonotonicClock:
    def now_ns(self) -> int:
        return time.monotonic_ns()

    def wait_until_ns(self, t_ns: int) -> None:
        time.sleep(max(0, t_ns - self.now_ns()) * 1e-9)


def measure(clients: int, *, rate_hz: float, seconds: float) -> dict[str, float]:
    """Return the figures of one run: latency in ms, messages received and skipped per client, CPU in per cent."""
    clock: Clock = _MonotonicClock()
    hub = Hub()
    with LiveServer(hub, _scene(), commands=lambda command: {}, clock=clock, port=0) as server:
        arguments = [sys.executable, __file__, "--receive", str(server.port), "--clients", str(clients)]
        with subprocess.Popen([*arguments, "--seconds", str(seconds)], stdout=subprocess.PIPE, text=True) as receiver:
            while hub.clients < clients and receiver.poll() is None:
                time.sleep(0.02)
            time.sleep(WARM_UP_S)
            cpu_before, wall_before = time.process_time(), time.monotonic()
            published, due_ns = 0, clock.now_ns()
            while time.monotonic() - wall_before < seconds and receiver.poll() is None:
                due_ns += round(1e9 / rate_hz)
                clock.wait_until_ns(due_ns)
                hub.publish_track(_track(published, clock.now_ns()))
                published += 1
            cpu_s, wall_s = time.process_time() - cpu_before, time.monotonic() - wall_before
            hub.publish_track(_track(-1, clock.now_ns()))
            report: dict[str, float] = json.loads(receiver.communicate(timeout=60)[0])
    return {"clients": clients, "published": published, **report, "cpu_percent": round(100 * cpu_s / wall_s, 1)}


async def _receive(port: int, clients: int) -> None:
    """Print the latencies of `clients` links that acknowledge every Track, until the one with seq -1 has come."""
    latencies_ms: list[float] = []

    async def one() -> None:
        async with connect(f"ws://127.0.0.1:{port}/ws?protocol=1", compression=None) as link:
            async for text in link:
                now_s = time.monotonic()
                message = json.loads(text)
                if message["type"] != "track":
                    continue
                if message["seq"] < 0:
                    return
                latencies_ms.append(1e3 * (now_s - message["t"]))
                await link.send(f'{{"type":"ack","seq":{message["seq"]}}}')

    await asyncio.gather(*(one() for _ in range(clients)))
    p50, p99 = np.percentile(latencies_ms, [50, 99])
    report = {"received": len(latencies_ms) / clients, "p50_ms": round(p50, 2), "p99_ms": round(p99, 2)}
    print(json.dumps(report))


def _track(seq: int, t_ns: int) -> Track:
    bend = np.linspace(0.0, 1.5, POINTS)
    shape = np.stack([100 - 60 * bend, 30 * np.sin(bend + seq * 0.01), 20 * np.cos(bend)], axis=1)
    pose = Pose(np.array([0.5, 0.5, 0.5, 0.5]), shape[0])
    return Track(seq, t_ns, Status.TRACKED, "", shape, pose, seq * 0.01, 0.123, 8_000_000)


def _scene() -> SceneDescription:
    return SceneDescription(
        protocol=1,
        source="twin",
        frames={},
        roi_min_mm=(0, -60, -60),
        roi_max_mm=(120, 60, 60),
        catheter_name="",
        catheter_diameter_mm=3,
        sector_deg=None,
        cameras=[],
        heart=None,
        targets=[],
        twin=None,
    )


def main() -> None:
    """Print a table, or one JSON list with --json."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0, help="length of each run")
    parser.add_argument("--rate", type=float, default=60.0, help="Tracks a second")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--receive", type=int, metavar="PORT", help=argparse.SUPPRESS)
    parser.add_argument("--clients", type=int, default=0, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.receive is not None:
        asyncio.run(asyncio.wait_for(_receive(options.receive, options.clients), options.seconds + 30))
        return
    runs = [measure(clients, rate_hz=options.rate, seconds=options.seconds) for clients in (1, 10, 50)]
    if options.json:
        print(json.dumps(runs))
        return
    print("| clients | p50 ms | p99 ms | received of published | server CPU, % of a core |")
    print("|---:|---:|---:|---:|---:|")
    for run in runs:
        share = f"{run['received']:.0f} of {run['published']:.0f}"
        print(f"| {run['clients']} | {run['p50_ms']} | {run['p99_ms']} | {share} | {run['cpu_percent']} |")


if __name__ == "__main__":
    main()
