"""Measurements of devices, posted to a real server: kept as files, or refused with a sentence."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest

from cathxr.app.diag_folder import DiagFolder
from cathxr.core import DataError
from cathxr.devices.clock import MonotonicClock
from cathxr.wire.diag_pages import MAX_BYTES, PER_MINUTE, make_diag_router
from cathxr.wire.server import LiveServer

Start = Callable[..., LiveServer]
_SPREAD = {"count": 600, "median": 16.7, "p95": 17.0, "p99": 18.0, "longest": 40.0, "over": 3}


def _report(**change: Any) -> dict[str, Any]:
    return {
        "schema": "cathxr-diag/1",
        "software": "cathxr 1",
        "seconds": 10.0,
        "device": {
            "user_agent": "Ein Browser für α", "secure": True, "webxr": True, "vr": True, "ar": False,
            "screen_px": [1, 2], "pixel_ratio": 1.5, "cores": 8, "memory_gb": None, "touch_points": 0,
        },
        "graphics": {
            "webgl2": True, "vendor": "", "renderer": "A GPU", "version": "", "max_texture": 1, "max_texture_3d": 1,
            "max_samples": 4, "max_uniform_vectors": 4, "extensions": ["EXT_x"],
        },
        "frames_ms": _SPREAD,
        "draw_ms": None,
        "link": {
            "connected": True, "round_trip_ms": _SPREAD, "track_age_ms": None, "track_interval_ms": _SPREAD,
            "skipped": 0,
        },
        "headset": None,
    } | change  # fmt: skip


@pytest.fixture
def client(start: Start, tmp_path: Path, kit: SimpleNamespace) -> Iterator[httpx.Client]:
    router = make_diag_router(DiagFolder(tmp_path / "recordings").save, clock=MonotonicClock())
    server = start(routers=(router,))
    with httpx.Client(base_url=server.url, timeout=kit.WAIT_S, trust_env=False) as client:
        yield client


def test_a_measurement_is_kept_under_the_name_that_is_told(client: httpx.Client, tmp_path: Path) -> None:
    names = {client.post("/diag", json=_report()).json()["file"] for _ in range(3)}
    assert len(names) == 3
    folder = tmp_path / "recordings" / "diag"
    assert {each.name for each in folder.iterdir()} == names
    for name in names:
        assert json.loads((folder / name).read_text(encoding="utf-8")) == _report()
        assert "headset" in name


def test_nothing_but_measurements_is_kept(client: httpx.Client, tmp_path: Path) -> None:
    wrong: list[tuple[int, dict[str, Any]]] = [
        (422, {"json": {}}),
        (422, {"json": _report(name="Somebody")}),
        (422, {"json": _report(seconds="ten")}),
        (422, {"json": _report(software="a\nb")}),
        (422, {"json": _report(software="x" * 400)}),
        (422, {"content": b'{"seconds": NaN}', "headers": {"content-type": "application/json"}}),
        (422, {"content": b"\xff\xfe", "headers": {"content-type": "application/json"}}),
        (413, {"content": b" " * (MAX_BYTES + 1), "headers": {"content-type": "application/json"}}),
        (415, {"content": json.dumps(_report()).encode(), "headers": {"content-type": "text/plain"}}),
    ]
    for status, request in wrong:
        answer = client.post("/diag", **request)
        assert answer.status_code == status, answer.text
        assert answer.json()["error"].endswith(".")
    foreign = client.post("/diag", json=_report(), headers={"origin": "http://example.org"})
    assert foreign.status_code == 403
    assert not (tmp_path / "recordings").exists()


def test_not_too_many_in_a_minute(client: httpx.Client) -> None:
    answers = [client.post("/diag", json=_report()).status_code for _ in range(PER_MINUTE + 1)]
    assert answers == [201] * PER_MINUTE + [429]


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DataError, match="cannot be used"):
        DiagFolder(tmp_path / "file").save("desktop", "{}")
