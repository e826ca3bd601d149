"""Prints the tip while `cathxr run` runs: python examples/print_tip.py [ws://127.0.0.1:8765]"""

import asyncio
import json
import sys

from websockets.asyncio.client import connect


async def _print_tips(address: str) -> None:
    async with connect(f"{address}/ws?protocol=1") as link:
        async for text in link:
            message = json.loads(text)
            if message["type"] == "track":
                await link.send(json.dumps({"type": "ack", "seq": message["seq"]}))
                where = message["tip"]["position"] if message["tip"] else message["reason"]
                print(message["seq"], message["status"], where, flush=True)


asyncio.run(_print_tips(sys.argv[1] if len(sys.argv) > 1 else "ws://127.0.0.1:8765"))
