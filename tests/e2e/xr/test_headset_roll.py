"""The roll's validity as the wearer of a headset meets it: the reason on the menu, and the press that puts it right."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from websockets.sync.client import connect

from cathxr.app.bench_live import live_process

from ..test_roll_live import Client
from .headset import CHEAP, Headset


@pytest.fixture
def live_port(built_client: Path) -> Iterator[int]:
    assert built_client.is_file()
    with live_process("--publish-truth") as (_, port):
        yield port


def test_the_wearer_confirms_the_roll(live_port: int, open_headset: Callable[..., Headset]) -> None:
    with connect(f"ws://127.0.0.1:{live_port}/ws?protocol=1", compression=None) as link:
        client = Client(link)
        headset = open_headset(f"http://127.0.0.1:{live_port}/", query=f"{CHEAP}&heart=0")
        headset.enter("vr")
        headset.press("right", "b-button")
        headset.tab("Ultrasound")
        client.until(client.is_valid)
        assert client.ask("encoder_fault", kind="reset") == "done"
        client.until(lambda: client.needs("confirm"))
        headset.until("window.__cathxr.xr.row('Roll', 0)")
        headset.until("window.__cathxr.xr.report().hud.includes('roll not valid')")
        headset.row("Roll", 0)
        client.until(client.is_valid)
        headset.until("window.__cathxr.xr.row('Roll', 0) === null")
        headset.until("!window.__cathxr.xr.report().hud.includes('not valid')")
