"""The calibration page in a real browser, on a real server: states are shown, buttons send commands, clicks hit."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import pytest

from cathxr.core import PixelArray
from cathxr.storage.rig_file import example_rig, read_rig, write_rig
from cathxr.wire.calibration_messages import (
    BoardView,
    CamerasState,
    Coverage,
    DeviceState,
    Figure,
    IntrinsicsState,
    MarkersState,
    MarkerState,
    ResultPicture,
)

LENS_S = 400.0
"""Limit on waiting: a person, the twin's too, moves a board to fifteen places and rests in each."""
SIZE_PX = (1280, 720)
_NO_COVERAGE = Coverage(columns=8, rows=5, counts=[0] * 40)


def grey_picture() -> PixelArray:
    """Return a plain picture."""
    return np.full((SIZE_PX[1], SIZE_PX[0], 3), 110, np.uint8)


def lens_state(**changed: Any) -> IntrinsicsState:
    """Return a state of a lens being measured."""
    usual: dict[str, Any] = {
        "camera": "top", "stage": "collecting", "advice": "Move the board to the upper left corner.",
        "size_px": SIZE_PX, "corners_px": [], "corners_seq": 1, "is_still": False, "is_new": False,
        "coverage": _NO_COVERAGE, "kept": 0, "wanted": 12, "views": [], "figures": [], "pictures": [],
    }  # fmt: skip
    return IntrinsicsState(**(usual | changed))


def marker(
    name: str, pixel: tuple[float, float] | None, *, camera: str = "top", origin: Literal["found", "placed"] = "found"
) -> MarkerState:
    """Return one fiducial's state."""
    return MarkerState(
        camera=camera, name=name, colour="blue", pixel=pixel, origin="missing" if pixel is None else origin,
        residual=None, residual_px=None,
    )  # fmt: skip


def markers_state(*markers: MarkerState, **changed: Any) -> MarkersState:
    """Return a state of the fiducials being found."""
    usual: dict[str, Any] = {
        "stage": "collecting", "advice": "Place what is missing.", "sizes_px": {"top": SIZE_PX, "front": SIZE_PX},
        "markers": list(markers), "can_save": False, "figures": [], "pictures": [],
    }  # fmt: skip
    return MarkersState(**(usual | changed))


def test_the_lens_is_measured_on_the_page(watched: Any, bench: Any) -> None:
    page = watched.page
    bench.show("top", grey_picture(), seq=1)
    bench.hub.publish_calibration(lens_state())
    watched.until("document.querySelector('#lens-shot').dataset.look === 'searching'")
    watched.until("window.__cathxrCalibration.shown().top === 1")
    assert page.locator("#advice").inner_text() == "Move the board to the upper left corner."
    assert page.get_by_role("button", name="Capture now").is_disabled()
    watched.settled()
    before = watched.picture("#lens-canvas")

    corners = [(200.0 + 30 * (i % 8), 150.0 + 30 * (i // 8)) for i in range(48)]
    seen = {"corners_px": corners, "is_new": True, "kept": 4}
    bench.hub.publish_calibration(lens_state(**seen))
    watched.until("document.querySelector('#lens-shot').dataset.look === 'hold'")
    page.get_by_role("button", name="Capture now").click()
    assert watched.commanded(1) == ("calibration_capture", {})

    counts = [0] * 40
    counts[39] = 30
    views = [BoardView(name="top_01", kept=True, reason=""), BoardView(name="x", kept=False, reason="blurred")]
    done = {"kept": 5, "views": views, "coverage": Coverage(columns=8, rows=5, counts=counts)}
    bench.hub.publish_calibration(lens_state(**done))
    watched.until("document.querySelector('#lens-shot').dataset.look === 'captured'")
    assert page.locator("#kept").inner_text() == "5"
    assert "1 of 40" in page.locator("#covered").inner_text()
    assert "blurred" in page.locator("#views").inner_text()
    watched.until("document.querySelector('#lens-shot').dataset.look === 'searching'")
    watched.settled()
    after = watched.picture("#lens-canvas")
    height, width = after.shape[:2]
    # The lower right cell of eight by five turns green, the lower left one stays. The lines about the cells are left
    # out; JPEG moves a plain grey by a grey level or two, the fill by 13 and more.
    lowest = slice(-height // 5 + 12, -12)
    filled, empty = (lowest, slice(-width // 8 + 12, -12)), (lowest, slice(12, width // 8 - 12))
    greener = (after - before)[..., 1] - (after - before)[..., 2]
    assert greener[filled].min() > 8
    assert np.abs(greener[empty]).max() < 4

    page.get_by_role("button", name="Discard top_01").click()
    assert watched.commanded(2) == ("calibration_discard", {"view": "top_01"})
    page.get_by_role("button", name="Finish").click()
    assert watched.commanded(3) == ("calibration_finish", {})
    bench.hub.publish_calibration(lens_state(stage="solving", kept=5))
    watched.until("document.querySelector('#call').dataset.look === 'solving'")
    assert watched.complaints == []


def test_a_result_is_shown_and_accepted(watched: Any, bench: Any) -> None:
    page = watched.page
    png = cv2.imencode(".png", np.full((200, 300, 3), 60, np.uint8))[1].tobytes()
    path = bench.hub.publish_result("coverage", png)
    result = lens_state(
        stage="done", kept=12, advice="Good.", figures=[Figure(label="RMS", value="0.11 px", level="good")],
        pictures=[ResultPicture(title="Where the board was", path=path)],
    )  # fmt: skip
    bench.hub.publish_calibration(result)
    watched.until("document.querySelector('.result img')?.naturalWidth === 300")
    assert "0.11 px" in page.locator("#figures").inner_text()
    page.get_by_role("button", name="Where the board was").click()
    assert page.locator("#enlarged").is_visible()
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Cancel").click()
    page.get_by_role("button", name="Go on").click()
    page.get_by_role("button", name="Collect more").click()
    assert watched.commanded(1) == ("calibration_continue", {})
    bench.answers["calibration_accept"] = {"saved": True, "sentence": "It is in rig.toml.", "paths": ["rig.toml"]}
    page.get_by_role("button", name="Accept").click()
    watched.commanded(2)
    watched.until("!document.querySelector('#ended').hidden")
    assert "It is in rig.toml." in page.locator("#ended").inner_text()
    assert watched.complaints == []
    bench.server.stop()
    watched.until("window.__cathxrCalibration.link === 'lost'")
    assert page.locator("#ended").is_visible(), "what came of it stays when the server is gone"
    assert page.locator("#banner").is_hidden()


def test_a_click_places_a_marker_where_the_picture_shows_it(watched: Any, bench: Any) -> None:
    page = watched.page
    true = np.array([801.0, 263.0])
    picture = grey_picture()
    cv2.circle(picture, (801, 263), 6, (20, 20, 230), -1, cv2.LINE_AA)
    for camera in ("top", "front"):
        bench.show(camera, picture, seq=1)
    others = (marker("mT2", (300.0, 500.0)), marker("mT1", None, camera="front"))
    bench.hub.publish_calibration(markers_state(marker("mT1", None), *others))
    watched.until("Object.values(window.__cathxrCalibration.shown()).every((seq) => seq === 1)")
    watched.until("window.__cathxrCalibration.role === 'operator'")
    canvas = "canvas[data-camera=top]"

    def spot() -> Any:
        """Return where the red spot's middle is on the page, seen from outside: by its colour in a screenshot."""
        page.mouse.move(2, 2)
        watched.settled()
        drawn = watched.picture(canvas)
        red = drawn[..., 2] - drawn[..., :2].max(axis=2)
        rows, columns = np.nonzero(red > 60)
        middle = np.array([np.average(each, weights=red[rows, columns]) for each in (columns, rows)])
        box = page.locator(canvas).bounding_box()
        assert box is not None
        return middle + 0.5 + (box["x"], box["y"])  # a pixel's middle is half a CSS pixel in

    page.locator("#marker-lists .choose", has_text="mT1").first.click()
    x, y = spot()
    page.mouse.move(x, y)
    for _ in range(8):
        page.mouse.wheel(0, -250)
    watched.until("document.querySelector('figure.marked figcaption').innerText.includes('20.1 times')")  # exp(3)
    x, y = spot()
    page.mouse.click(round(x), round(y))
    name, args = watched.commanded(1)
    assert name == "calibration_place"
    assert (args["camera"], args["marker"], args["exact"]) == ("top", "mT1", False)
    # A pixel of the camera is seven on the screen: half a CSS pixel of rounding is under 0.1 px, JPEG's colours and the
    # screenshot move the spot's middle by as much.
    assert np.abs(np.array(args["pixel"]) - true).max() < 0.5

    bench.hub.publish_calibration(markers_state(marker("mT1", (801.0, 263.0), origin="placed"), *others))
    watched.until("document.querySelector('#marker-lists li').innerText.includes('placed')")
    page.wait_for_timeout(500)  # the page shows the clicked place until it is sure that the server's has come
    page.keyboard.press("ArrowRight")
    _, args = watched.commanded(2)
    assert args["exact"]
    assert args["pixel"] == [801.25, 263.0]
    page.wait_for_timeout(500)

    start, drawn_width = spot(), watched.picture(canvas).shape[1]
    page.mouse.move(round(start[0]), round(start[1]))
    page.mouse.down()
    page.mouse.move(round(start[0]) + 10, round(start[1]), steps=5)
    page.mouse.move(round(start[0]) + 40, round(start[1]) - 20, steps=5)
    page.mouse.up()
    _, args = watched.commanded(3)
    caption = page.locator("figure.marked figcaption").first.inner_text()
    enlarged = re.search(r"([\d.]+) times", caption)
    assert enlarged, caption
    scale = drawn_width / SIZE_PX[0] * float(enlarged[1])
    # The caption's factor has one decimal (1 %); the first four CSS pixels only tell a drag from a click.
    assert np.abs((np.array(args["pixel"]) - true) * scale - (40, -20)).max() < 2.0

    page.keyboard.press("Delete")
    assert watched.commanded(4) == ("calibration_unplace", {"camera": "top", "marker": "mT1"})
    page.keyboard.press("Escape")
    assert page.locator(".choose[aria-pressed=true]").count() == 0
    assert page.get_by_role("button", name="Accept").is_disabled()
    assert watched.complaints == []


def test_devices_are_told_apart(watched: Any, bench: Any) -> None:
    page = watched.page
    bench.show("top", grey_picture(), seq=1)
    devices = [
        DeviceState(key="top", device="0", label="First", role="", suggestion="top", settings=[], trouble=""),
        DeviceState(key="3", device="3", label="Third", role="", suggestion="", settings=[], trouble="It is in use."),
    ]
    state = CamerasState(stage="collecting", advice="Choose.", devices=devices, can_save=False, figures=[])
    bench.hub.publish_calibration(state)
    watched.until("window.__cathxrCalibration.shown().top === 1")
    card = page.locator(".card", has_text="Third")
    assert "It is in use." in card.inner_text()
    assert page.get_by_role("button", name="Save").is_disabled()
    page.locator(".card", has_text="First").get_by_role("button", name="Top").click()
    assert watched.commanded(1) == ("calibration_assign", {"key": "top", "role": "top"})
    card.get_by_role("button", name="Neither").click()
    assert watched.commanded(2) == ("calibration_assign", {"key": "3", "role": ""})
    bench.hub.publish_calibration(state.model_copy(update={"can_save": True}))
    bench.answers["calibration_accept"] = {"saved": False}
    watched.until("document.querySelector('#actions .primary').disabled === false")
    page.get_by_role("button", name="Save").click()
    watched.commanded(3)
    watched.settled()
    assert page.locator("#ended").is_hidden(), "the cameras are locked first: it has not ended"
    assert watched.complaints == []


def test_a_viewer_sees_all_and_may_nothing_until_it_is_paired(
    make_bench: Callable[..., Any], open_page: Callable[..., Any]
) -> None:
    bench = make_bench(force_pairing=True)
    watched = open_page(bench)
    page = watched.page
    bench.show("top", grey_picture(), seq=1)
    views = [BoardView(name="top_01", kept=True, reason="")]
    bench.hub.publish_calibration(lens_state(corners_px=[(5.0, 5.0)], kept=12, views=views))
    watched.until("window.__cathxrCalibration.shown().top === 1")
    enabled = "document.querySelectorAll(':is(#actions, #views) button:enabled').length"
    assert page.evaluate(f"() => {enabled}") == 0
    assert "Viewing only" in page.locator("#why").inner_text()
    page.fill("#pairing-code", "000000" if bench.server.pairing_code != "000000" else "111111")
    page.click("#pairing-form button")
    page.locator("#pairing-trouble").wait_for(state="visible")
    page.fill("#pairing-code", bench.server.pairing_code or "")
    page.click("#pairing-form button")
    watched.until(f"{enabled} === 4")
    assert page.locator("#pairing").is_hidden()


@pytest.mark.parametrize("size", [(390, 844), (1280, 720), (2560, 1440)])
def test_everything_fits_the_screen_and_stays_on_the_origin(
    open_page: Callable[..., Any], bench: Any, size: tuple[int, int]
) -> None:
    watched = open_page(bench, size=size)
    sides = ("top", "front")
    every = [marker(f"mT{i}", (100.0 * i, 100.0), camera=side) for side in sides for i in range(1, 9)]
    for state in (
        lens_state(views=[BoardView(name="a_rather_long_name_01", kept=False, reason="blurred: hold it still")]),
        markers_state(*every, advice="All of them are there, and this sentence is not a short one either."),
        CamerasState(stage="collecting", advice="Choose.", devices=[], can_save=False, figures=[]),
    ):
        bench.hub.publish_calibration(state)
        watched.until(f"window.__cathxrCalibration.kind === '{state.type}'")
        watched.settled()
        assert watched.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
        wide = watched.page.evaluate(
            "() => [...document.querySelectorAll('main, .bar, .side, .panel, .call, .work')].filter((each) =>"
            " each.offsetParent !== null && each.scrollWidth > each.clientWidth + 1).map((each) => each.className)"
        )
        assert wide == []
        act = watched.page.locator("#actions").bounding_box()
        assert act is not None
        assert act["y"] + act["height"] <= size[1], "the buttons are in view"
    own = (bench.server.url, bench.server.url.replace("http", "ws"))
    assert [url for url in watched.requests if not url.startswith(own)] == []
    assert watched.complaints == []


def test_a_lost_link_is_shown(watched: Any, bench: Any) -> None:
    bench.hub.publish_calibration(lens_state(kept=3))
    watched.until("window.__cathxrCalibration.kind === 'calibrate_intrinsics'")
    bench.server.stop()
    watched.until("window.__cathxrCalibration.link === 'lost'")
    watched.until("!document.querySelector('#banner').hidden")
    assert "link is lost" in watched.page.locator("#banner").inner_text()
    assert watched.page.get_by_role("button", name="Capture now").is_disabled()
    # The browser itself reports refused connections; the page's own program has nothing to complain about.
    assert watched.page.evaluate("() => window.__cathxrCalibration.consoleErrors") == 0


def test_the_command_measures_a_lens_that_a_person_only_accepts(
    start_calibration: Callable[..., Any], open_page: Callable[..., Any], tmp_path: Path
) -> None:
    rig = tmp_path / "rig.toml"
    write_rig(rig, example_rig())
    board = "charuco:10x10:6.0:4.0:DICT_4X4_50"
    command = start_calibration(
        "intrinsics", "--rig", str(rig), "--camera", "top", "--board", board, "--live", "--source", "twin"
    )
    watched = open_page(f"{command.url}/calibrate.html")
    # The twin's person moves the board about; every view is captured by itself, and the solving starts by itself.
    watched.until("window.__cathxrCalibration?.shown().top >= 0")
    watched.until("Number(document.querySelector('#kept').innerText) >= 2", within_s=LENS_S)
    watched.until("window.__cathxrCalibration.stage === 'done'", within_s=LENS_S)
    watched.until("[...document.querySelectorAll('.result img')].some((each) => each.naturalWidth > 100)")
    assert watched.page.locator("#figures > div").count() >= 3
    watched.page.get_by_role("button", name="Accept").click()
    watched.until("!document.querySelector('#ended').hidden")
    assert watched.complaints == []
    said = command.finish()
    assert command.process.returncode == 0, said
    provenance = read_rig(rig).cameras["top"].intrinsics.provenance
    assert provenance is not None
    assert provenance.covariance is not None
