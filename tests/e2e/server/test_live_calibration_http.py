"""What a calibration's page gets over HTTP: pictures of results, and cameras that the scene does not name."""

from collections.abc import Callable
from types import SimpleNamespace

import httpx
import pytest

from cathxr.wire.hub import Hub
from cathxr.wire.server import LiveServer

Start = Callable[..., LiveServer]
PNG = b"\x89PNG the first"


def test_pictures_of_results_change_under_their_name(hub: Hub, start: Start, kit: SimpleNamespace) -> None:
    path = hub.publish_result("expected_error", PNG)
    assert path == "/calibration/expected_error.png"
    with httpx.Client(base_url=start().url, timeout=kit.WAIT_S) as client:
        answer = client.get(f"{path}?v=3")
        assert (answer.content, answer.headers["content-type"]) == (PNG, "image/png")
        held = {"If-None-Match": answer.headers["etag"]}
        assert client.get(path, headers=held).status_code == 304
        hub.publish_result("expected_error", PNG + b" and the second")
        assert client.get(path, headers=held).content == PNG + b" and the second"


def test_a_result_that_is_not_there_is_said(start: Start, kit: SimpleNamespace) -> None:
    answer = httpx.get(f"{start().url}/calibration/none.png", timeout=kit.WAIT_S)
    assert answer.status_code == 404
    assert "no picture of a result named 'none'" in answer.json()["error"]


@pytest.mark.parametrize("name", ["", "../x", "A", "a.b", "a/b", "x" * 65])
def test_names_of_results_are_plain(hub: Hub, name: str) -> None:
    with pytest.raises(ValueError, match="lower-case letters"):
        hub.publish_result(name, PNG)


def test_devices_that_are_no_cameras_of_the_rig_have_pictures(hub: Hub, start: Start, kit: SimpleNamespace) -> None:
    hub.publish_picture(kit.picture("device-0", 1, 90), seq=4)
    with httpx.Client(base_url=start(cameras=("device-0",)).url, timeout=kit.WAIT_S) as client:
        assert client.get("/cameras/device-0.jpg").headers["x-cathxr-seq"] == "4"
        answer = client.get("/cameras/device-1.jpg")
        assert answer.status_code == 404
        assert "there are device-0, front, top" in answer.json()["error"]
