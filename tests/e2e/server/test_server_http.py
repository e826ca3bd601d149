"""The HTTP side of a real server: page, scene, pictures, guard, headers, and how it starts and stops."""

import json
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from cathxr.wire import pages, pictures
from cathxr.wire.hub import Hub
from cathxr.wire.messages import CloseCode, SceneDescription
from cathxr.wire.server import LiveServer


def _get(server: LiveServer, path: str, **options: Any) -> httpx.Response:
    return httpx.get(f"{server.url}{path}", timeout=10, verify=False, trust_env=False, **options)


# --- page and scene ---------------------------------------------------------------------------------------------------


@pytest.fixture
def page(tmp_path: Path) -> Path:
    folder = tmp_path / "page"
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text("<!doctype html><title>page</title>", encoding="utf-8")
    (folder / "assets" / "main-1234.js").write_text("export {};", encoding="utf-8")
    (folder / ".hidden").write_text("secret", encoding="utf-8")
    (tmp_path / "outside.txt").write_text("secret", encoding="utf-8")
    with suppress(OSError):  # Windows lets few users make links
        (folder / "link.txt").symlink_to(tmp_path / "outside.txt")
    return folder


def test_serves_the_page_with_types_that_browsers_take(start: Any, page: Path) -> None:
    server = start(page=page)
    index = _get(server, "/")
    assert index.status_code == 200
    assert index.headers["content-type"] == "text/html; charset=utf-8"
    assert index.headers["cache-control"] == "no-cache"
    script = _get(server, "/assets/main-1234.js")
    assert script.headers["content-type"] == "text/javascript; charset=utf-8"
    assert "immutable" in script.headers["cache-control"]
    again = _get(server, "/", headers={"If-None-Match": index.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


@pytest.mark.parametrize(
    "path",
    [
        b"/../outside.txt",
        b"/%2e%2e/outside.txt",
        b"/assets/..%2f..%2foutside.txt",
        b"/..%5coutside.txt",
        b"//etc/passwd",
        b"/%2fetc/passwd",
        b"/C:/Windows/win.ini",
        b"/.hidden",
        b"/link.txt",
        b"/assets",
        b"/index.html%00.js",
        b"/index.html::$DATA",
        b"/" + b"a" * 4000,
        b"/%ff%fe",
    ],
)
def test_nothing_but_the_page_is_served(start: Any, page: Path, path: bytes) -> None:
    server = start(page=page)
    # By hand, because clients tidy paths up before they send them.
    with socket.create_connection(("127.0.0.1", server.port), timeout=10) as link:
        link.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        answer = b"".join(iter(lambda: link.recv(65536), b""))
    assert answer.startswith(b"HTTP/1.1 404"), answer[:100]
    assert b"secret" not in answer


def test_says_what_to_do_when_the_page_is_not_built(start: Any, tmp_path: Path) -> None:
    answer = _get(start(page=tmp_path / "nowhere"), "/")
    assert answer.status_code == 503
    assert "pip install" in answer.text


def test_serves_the_scene_and_its_files(start: Any, tmp_path: Path) -> None:
    glb = tmp_path / "heart.glb"
    glb.write_bytes(b"glTF" + bytes(100))
    server = start(files={"/scene/heart.glb": glb, "/scene/gone.bin": tmp_path / "gone.bin"})
    scene = _get(server, "/scene/scene.json")
    assert {camera.name for camera in SceneDescription.model_validate_json(scene.content).cameras} == {"top", "front"}
    assert _get(server, "/scene/scene.json", headers={"If-None-Match": scene.headers["etag"]}).status_code == 304
    answer = _get(server, "/scene/heart.glb")
    assert answer.content == glb.read_bytes()
    assert answer.headers["content-type"] == "model/gltf-binary"
    assert _get(server, "/scene/heart.glb", headers={"If-None-Match": answer.headers["etag"]}).status_code == 304
    for missing in ("/scene/labels.bin", "/scene/gone.bin", "/scene/../heart.glb"):
        assert _get(server, missing).status_code == 404


def test_refuses_scene_files_that_could_not_be_reached(start: Any, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="/scene/"):
        start(files={"/heart.glb": tmp_path})


def test_health_and_unknown_paths_of_the_api(server: LiveServer) -> None:
    health = _get(server, "/api/health")
    assert health.headers["cache-control"] == "no-store"
    assert health.json()["protocol"] == 1
    unknown = _get(server, "/api/nothing")
    assert unknown.status_code == 404
    assert "docs/wire.md" in unknown.json()["error"]
    assert httpx.post(f"{server.url}/api/health", timeout=10).status_code == 405
    for path in ("/docs", "/redoc", "/openapi.json"):
        assert _get(server, path).status_code == 404  # FastAPI's own pages load from other hosts


def test_answers_carry_security_headers(server: LiveServer) -> None:
    for path in ("/", "/api/health", "/nothing", "/scene/scene.json"):
        headers = _get(server, path).headers
        policy = headers["content-security-policy"]
        assert "default-src 'self'" in policy
        assert f"ws://127.0.0.1:{server.port}" in policy
        assert "unsafe" not in policy
        assert headers["x-content-type-options"] == "nosniff"


# --- pictures ---------------------------------------------------------------------------------------------------------


def test_a_picture_says_which_pair_it_is_of(server: LiveServer, hub: Hub, kit: SimpleNamespace) -> None:
    hub.publish_picture(kit.picture("top", 1_500_000_000, 99), seq=41)
    answer = _get(server, "/cameras/top.jpg?after=40&width=320")
    assert answer.headers["content-type"] == "image/jpeg"
    assert (answer.headers["x-cathxr-seq"], float(answer.headers["x-cathxr-t"])) == ("41", 1.5)
    assert answer.headers["cache-control"] == "no-store"
    pixels = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert pixels is not None
    assert pixels.shape == (180, 320)
    assert np.abs(pixels.astype(int) - 99).max() <= 1  # a flat grey: JPEG rounds its mean to a level


@pytest.mark.parametrize(("width", "expected"), [("1", 160), ("161", 320), ("5000", 640), (None, 640)])
def test_widths_go_in_steps_up_to_the_pictures_own(
    server: LiveServer, hub: Hub, kit: SimpleNamespace, width: str | None, expected: int
) -> None:
    hub.publish_picture(kit.picture("front", 0, 50), seq=0)
    content = _get(server, "/cameras/front.jpg" + (f"?width={width}" if width else "")).content
    pixels = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert pixels is not None
    assert pixels.shape[1] == expected


def test_waits_for_a_newer_picture(server: LiveServer, hub: Hub, kit: SimpleNamespace) -> None:
    hub.publish_picture(kit.picture("top", 0, 1), seq=0)
    with ThreadPoolExecutor(4) as pool:
        waiting = [pool.submit(_get, server, "/cameras/top.jpg?after=0") for _ in range(4)]
        while hub.pictures.waiting("top") < 4:
            time.sleep(0.005)
        hub.publish_picture(kit.picture("front", 0, 1), seq=1)  # another camera's wakes nobody
        hub.publish_picture(kit.picture("top", 0, 1), seq=1)
        assert [each.result().headers.get("x-cathxr-seq") for each in waiting] == ["1"] * 4


def test_none_came(server: LiveServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "PICTURE_WAIT_S", 0.05)
    answer = _get(server, "/cameras/top.jpg?after=5")
    assert (answer.status_code, answer.content) == (204, b"")


def test_a_client_of_an_earlier_run_gets_the_newest(server: LiveServer, hub: Hub, kit: SimpleNamespace) -> None:
    hub.publish_picture(kit.picture("top", 0, 1), seq=3)
    assert _get(server, "/cameras/top.jpg?after=5000").headers["x-cathxr-seq"] == "3"


def test_each_picture_is_encoded_once_for_all(
    server: LiveServer, hub: Hub, kit: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[int] = []

    def counted(pixels: Any, width_px: int) -> bytes:
        made.append(width_px)
        return encode(pixels, width_px)

    encode = pictures.encoded_jpeg
    monkeypatch.setattr(pictures, "encoded_jpeg", counted)
    for seq in range(3):
        hub.publish_picture(kit.picture("top", seq, 1), seq=seq)
        with ThreadPoolExecutor(6) as pool:
            paths = [f"/cameras/top.jpg?width={width}" for width in (320, 320, 300, 640, 640, 600)]
            list(pool.map(lambda path: _get(server, path), paths))
    assert sorted(made) == [320] * 3 + [640] * 3


@pytest.mark.parametrize(
    "query", ["after=x", "after=-2", "after=" + "9" * 30, "width=0", "width=1e3", "width=-5", "after="]
)
def test_a_wrong_query_is_told(server: LiveServer, query: str) -> None:
    answer = _get(server, f"/cameras/top.jpg?{query}")
    assert answer.status_code == 400
    assert "whole number" in answer.json()["error"]


def test_an_unknown_camera_is_told(server: LiveServer) -> None:
    answer = _get(server, "/cameras/side.jpg")
    assert answer.status_code == 404
    assert "front, top" in answer.json()["error"]


# --- guard ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8765", "localhost.evil.example", "10.0.0.1", "", "127.0.0.2"]
)
def test_a_foreign_host_is_refused(server: LiveServer, kit: SimpleNamespace, host: str) -> None:
    answer = _get(server, "/api/health", headers={"Host": host})
    assert answer.status_code == 403
    assert "Host" in answer.json()["error"]
    # What a page does whose name was pointed at this machine after it had loaded.
    link = kit.RawLink(server.port, host=host)
    link.close()
    assert link.head.startswith(b"HTTP/1.1 403")


def _sock(server: LiveServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.port), timeout=10)


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST", "localhost.", "127.0.0.1", "[::1]"])
def test_the_loopback_names_are_taken(server: LiveServer, host: str) -> None:
    assert _get(server, "/api/health", headers={"Host": f"{host}:{server.port}"}).status_code == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1:{port}", "http://127.0.0.1:1", ""]
)
def test_a_page_of_another_origin_is_refused(server: LiveServer, origin: str) -> None:
    headers = {"Origin": origin.format(port=server.port)}
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(f"ws://127.0.0.1:{server.port}/ws?protocol=1", additional_headers=headers),
    ):
        pass
    assert refused.value.response.status_code == 403
    assert "origin" in json.loads(refused.value.response.body)["error"]


def test_the_page_itself_is_taken(server: LiveServer) -> None:
    origin = f"http://127.0.0.1:{server.port}"
    with connect(f"ws://127.0.0.1:{server.port}/ws?protocol=1", origin=origin) as link:  # type: ignore[arg-type]
        assert json.loads(link.recv(timeout=10))["type"] == "hello"


# --- start and stop ---------------------------------------------------------------------------------------------------


def test_takes_the_next_free_port(start: Any) -> None:
    first = start()
    second = start(port=first.port)
    assert first.port < second.port < first.port + 20
    assert _get(second, "/api/health").status_code == 200


def test_stops_in_time_whatever_the_clients_do(start: Any, hub: Hub, kit: SimpleNamespace) -> None:
    server = start()
    stop_publishing = threading.Event()

    def publish() -> None:
        seq = 0
        while not stop_publishing.is_set():
            hub.publish_track(kit.track(seq := seq + 1))
            hub.publish_picture(kit.picture("top", seq, 1), seq=seq)
            time.sleep(0.002)

    publisher = threading.Thread(target=publish)
    publisher.start()
    stalled = [kit.RawLink(server.port, receive_buffer=4096) for _ in range(5)]
    half_open = _sock(server)
    half_open.sendall(b"GET / HTTP/1.1\r\nHost: local")
    with ThreadPoolExecutor(4) as pool, connect(f"ws://127.0.0.1:{server.port}/ws?protocol=1") as good:
        polls = [pool.submit(_get, server, "/cameras/front.jpg") for _ in range(4)]
        while hub.pictures.waiting("front") < 4:
            time.sleep(0.005)
        server.stop(timeout_s=kit.WAIT_S)
        assert not server.running
        assert [each.result().status_code for each in polls] == [204] * 4
        with suppress(ConnectionClosed):
            while True:
                good.recv(timeout=10)
        assert good.close_code == CloseCode.GOING_AWAY
    stop_publishing.set()
    publisher.join()
    for link in stalled:
        link.close()
    half_open.close()


def test_the_port_is_free_after_the_stop(start: Any) -> None:
    server = start()
    with connect(f"ws://127.0.0.1:{server.port}/ws?protocol=1"):
        server.stop()
    again = start(port=server.port)
    assert again.port == server.port


def test_stopping_twice_or_before_the_start_does_nothing(server: LiveServer) -> None:
    server.stop()
    server.stop()
    assert server.failure is None
