"""Clients for the live benchmark, in a process of their own: `python -m cathxr.app.bench_client PORT SECONDS CLIENTS`.

Prints one JSON line: latencies from mid-exposure to the message in the first client's hands, and what arrived.
"""

import asyncio
import json
import sys
import time
from collections import Counter
from typing import Any

from websockets.asyncio.client import connect

_PATIENCE_S = 10.0


async def _client(
    url: str, until_s: float, latencies_ms: list[float], statuses: Counter[str], tips: dict[int, Any]
) -> None:
    truths: dict[int, Any] = {}
    async with connect(url, compression=None) as link:
        while (left_s := until_s - time.monotonic()) > 0:
            try:
                text = await asyncio.wait_for(link.recv(), min(left_s, _PATIENCE_S))
            except TimeoutError:
                return
            message = json.loads(text)
            if message["type"] == "event" and message["kind"] == "truth":
                truths[message["payload"]["seq"]] = message["payload"]["tip"]
                tips.setdefault(message["payload"]["seq"], [None, None])[1] = message["payload"]["tip"]
            if message["type"] != "track":
                continue
            # Server and client share the machine's monotonic clock, so that the difference is the true latency.
            latencies_ms.append((time.monotonic() - message["t"]) * 1e3)
            statuses[message["status"]] += 1
            if message["tip"] is not None:
                tips.setdefault(message["seq"], [None, None])[0] = message["tip"]["position"]
            await link.send(json.dumps({"type": "ack", "seq": message["seq"]}))


async def _all(port: int, seconds: float, clients: int) -> dict[str, Any]:
    url = f"ws://127.0.0.1:{port}/ws?protocol=1"
    until_s = time.monotonic() + seconds
    latencies: list[list[float]] = [[] for _ in range(clients)]
    statuses: Counter[str] = Counter()
    tips: dict[int, Any] = {}
    await asyncio.gather(
        *(
            _client(url, until_s, latencies[i], statuses if i == 0 else Counter(), tips if i == 0 else {})
            for i in range(clients)
        )
    )
    first = sorted(latencies[0])
    count = len(first)
    errors = [
        sum((a - b) ** 2 for a, b in zip(made, true, strict=True)) ** 0.5
        for made, true in tips.values()
        if made is not None and true is not None
    ]
    return {
        "clients": clients,
        "rate_hz": count / seconds,
        "p50_ms": first[count // 2] if count else None,
        "p99_ms": first[min(count - 1, int(count * 0.99))] if count else None,
        "max_ms": first[-1] if count else None,
        "statuses": dict(statuses),
        "tip_mm": sum(errors) / len(errors) if errors else None,
        "tip_max_mm": max(errors) if errors else None,
    }


if __name__ == "__main__":
    print(json.dumps(asyncio.run(_all(int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])))))
