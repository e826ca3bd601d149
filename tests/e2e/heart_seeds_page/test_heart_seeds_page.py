"""What a person does on the seeds' page: looks, places, moves, adds, deletes, undoes, segments, saves, closes."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from .conftest import HANDLE, SHAPE

VENTRICLE = (42.0, 24.0, 15.0)  # seen: x to the left, y to the back, z from the head down
OTHER_HALF = (22.0, 24.0, 15.0)
# Half a CSS pixel of rounding to where the mouse may click; the views show at least 3 pixels a voxel.
CLICK_VOXELS = 0.2


def seeds(desk: Any) -> list[tuple[str, tuple[float, ...]]]:
    return [(each.structure, each.seen) for each in desk.session.state().seeds]


def until_seeds(watched: Any, count: int) -> None:
    watched.until(f"document.querySelectorAll('#seeds li').length === {count}")


def test_the_scan_and_its_labels_are_shown_where_they_are(make_desk: Callable[..., Any], open_seeds: Any) -> None:
    watched = open_seeds(make_desk().server.url)
    watched.ready()
    page = watched.page
    page.locator("[data-overlay=off]").click()
    watched.settled()
    for plane in ("axial", "coronal", "sagittal"):
        # 500 HU in the window 250 ± 400 is 81 % of white, 100 HU 31 %; a PNG keeps what was drawn, the smoothing
        # of the enlargement changes nothing where all neighbours are alike.
        inside = watched.colour_at(plane, (46.0, 20.0, 11.0))
        assert np.abs(inside - round(255 * 0.8125)).max() <= 1
    dark = watched.colour_at("axial", OTHER_HALF)
    assert np.abs(dark - round(255 * 0.3125)).max() <= 1

    page.locator("[data-overlay=fill]").click()
    watched.settled()
    blue, _, red = watched.colour_at("axial", (46.0, 20.0, 15.0))
    assert red - blue > 20, "the left ventricle is red"
    assert np.ptp(watched.colour_at("axial", (58.0, 20.0, 15.0))) == 0, "beside it nothing is labelled"
    page.get_by_role("button", name="Show Left ventricle").click()
    watched.settled()
    assert np.ptp(watched.colour_at("axial", (46.0, 20.0, 15.0))) == 0
    page.locator("#window").select_option("lung")
    watched.settled()
    assert watched.colour_at("axial", OTHER_HALF).min() >= 240
    assert watched.complaints == []


def test_slices_of_voxels_that_are_not_cubes_have_their_true_shape(
    make_desk: Callable[..., Any], open_seeds: Any
) -> None:
    watched = open_seeds(make_desk().server.url)
    watched.ready()
    (x0, y0), (x1, y1) = (watched.where("coronal", (at, 24.0, at)) for at in (10.0, 20.0))
    assert (y1 - y0) / (x1 - x0) == pytest.approx(2.0, rel=1e-6)  # 2 mm from slice to slice, 1 mm from column to column


def test_a_click_places_a_seed_where_it_is(make_desk: Callable[..., Any], open_seeds: Any) -> None:
    desk = make_desk()
    watched = open_seeds(desk.server.url)
    watched.ready()
    page = watched.page
    watched.click("axial", VENTRICLE)
    watched.settled()
    assert seeds(desk) == [], "no structure is chosen: a click only looks"
    watched.current()

    page.keyboard.press("5")
    assert page.evaluate(f"() => {HANDLE}.chosen") == "aorta"
    watched.click("coronal", OTHER_HALF)
    until_seeds(watched, 1)
    ((structure, seen),) = seeds(desk)
    assert structure == "aorta"
    assert seen == pytest.approx((*OTHER_HALF[:1], page.evaluate(f"() => {HANDLE}.cursor[1]"), 15.0), abs=CLICK_VOXELS)
    assert "100 HU" in page.locator("#seeds").inner_text()
    assert "labelled as nothing" in page.locator("#seeds").inner_text()

    watched.click("sagittal", (22.0, 30.0, 12.0))
    watched.until("document.querySelector('#seeds').innerText.includes('30.0')")
    assert seeds(desk)[0][1][1:] == pytest.approx((30.0, 12.0), abs=CLICK_VOXELS)
    watched.current()
    page.keyboard.down("Shift")
    watched.click("axial", (20.0, 20.0, 12.0))
    page.keyboard.up("Shift")
    until_seeds(watched, 2)
    page.get_by_role("button", name="Undo").click()
    until_seeds(watched, 1)
    page.keyboard.press("Control+Shift+z")
    until_seeds(watched, 2)
    page.get_by_role("button", name="Delete the seed of Aorta").first.click()
    until_seeds(watched, 1)
    assert watched.complaints == []


def test_the_planes_are_linked_and_keys_do_it_all(make_desk: Callable[..., Any], open_seeds: Any) -> None:
    desk = make_desk()
    watched = open_seeds(desk.server.url)
    watched.ready()
    page = watched.page
    page.locator("canvas[data-plane=coronal]").focus()
    before = page.evaluate(f"() => {HANDLE}.cursor")
    for key in ("ArrowRight", "ArrowRight", "ArrowUp", "PageDown"):
        page.keyboard.press(key)
    watched.current()
    assert page.evaluate(f"() => {HANDLE}.cursor") == [before[0] + 2, before[1] + 1, before[2] - 1]
    page.keyboard.press("1")
    page.keyboard.press("Enter")
    until_seeds(watched, 1)
    assert seeds(desk)[0] == ("left_ventricle", (before[0] + 2, before[1] + 1, before[2] - 1))
    page.keyboard.press("Delete")
    until_seeds(watched, 0)
    page.keyboard.press("Escape")
    assert page.evaluate(f"() => {HANDLE}.chosen") is None

    x, y = watched.where("axial", VENTRICLE)
    page.mouse.move(x, y)
    slice_before = page.evaluate(f"() => {HANDLE}.shown().axial")
    page.mouse.wheel(0, 120)
    watched.until(f"{HANDLE}.shown().axial > {slice_before}")
    page.mouse.down()
    page.mouse.move(x + 30, y + 12, steps=3)
    page.mouse.up()
    watched.current()
    far, _ = watched.where("axial", (0.0, 0.0, 0.0))
    page.keyboard.down("Control")
    page.mouse.wheel(0, -240)
    page.keyboard.up("Control")
    watched.settled()
    assert watched.where("axial", (0.0, 0.0, 0.0))[0] < far, "with Ctrl the wheel enlarges"


def test_segmenting_again_shows_the_new_labels_and_saving_ends_it(
    make_desk: Callable[..., Any], open_seeds: Any
) -> None:
    desk = make_desk()
    watched = open_seeds(desk.server.url)
    watched.ready()
    page = watched.page
    page.locator("#structures button", has_text="Aorta").click()
    watched.click("axial", OTHER_HALF)
    until_seeds(watched, 1)
    assert np.ptp(watched.colour_at("axial", (16.0, 18.0, 15.0))) == 0
    page.get_by_role("button", name="Segment again").click()
    watched.until("document.querySelector('#findings').innerText.includes('No veins were found.')")
    watched.until("document.querySelector('#structures').innerText.includes('13 mL')")  # 14 x 24 x 20 voxels of 2 mm3
    watched.until(f"{HANDLE}.labels === 2")
    watched.settled()
    blue, _, red = watched.colour_at("axial", (16.0, 18.0, 15.0))
    assert red - blue > 20, "the aorta is red, where nothing was labelled before"

    page.get_by_role("button", name="Done").click()
    page.get_by_role("button", name="Go on").click()
    page.keyboard.press("Control+s")
    watched.until("document.querySelector('#advice').innerText.includes('saved')")
    assert [each.structure for each in desk.saved[-1]] == ["aorta"]
    page.get_by_role("button", name="Done").click()
    watched.until("!document.querySelector('#ended').hidden")
    assert "1 seed is saved." in page.locator("#ended").inner_text()
    assert watched.complaints == []


def test_a_viewer_sees_nothing_of_the_scan_until_it_is_paired(make_desk: Callable[..., Any], open_seeds: Any) -> None:
    desk = make_desk(force_pairing=True)
    watched = open_seeds(desk.server.url)
    page = watched.page
    watched.until("document.querySelector('.slice .note').innerText.includes('operators only')")
    assert not any("/heart/ct" in each for each in watched.requests)
    page.locator("#pairing-code").fill(desk.server.pairing_code)
    page.get_by_role("button", name="Pair").click()
    watched.ready()
    assert page.locator("#pairing").is_hidden()
    assert not any("key-of-the-test" in each for each in watched.requests), "the key is in no address"
    assert watched.complaints == []


def test_fingers_place_zoom_and_scroll(make_desk: Callable[..., Any], open_seeds: Any) -> None:
    desk = make_desk()
    watched = open_seeds(desk.server.url, size=(820, 1180))
    watched.ready()
    page = watched.page
    page.locator("#structures button", has_text="Aorta").tap()
    x, y = watched.where("axial", OTHER_HALF)
    page.touchscreen.tap(round(x), round(y))
    until_seeds(watched, 1)
    assert seeds(desk)[0][1][:2] == pytest.approx(OTHER_HALF[:2], abs=CLICK_VOXELS)

    def fingers(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(places)]
        cdp.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    cdp = watched.context.new_cdp_session(page)
    middle = watched.where("axial", VENTRICLE)
    span = watched.where("axial", (52.0, 24.0, 15.0))[0] - middle[0]
    fingers("touchStart", (middle[0] - 40, middle[1]), (middle[0] + 40, middle[1]))
    for apart in (50, 60, 80):
        fingers("touchMove", (middle[0] - apart, middle[1]), (middle[0] + apart, middle[1]))
    fingers("touchEnd")
    watched.settled()
    # Twice as far apart is twice as large: the view held the whole slice before, so that no edge limits it.
    assert watched.where("axial", (52.0, 24.0, 15.0))[0] - watched.where("axial", VENTRICLE)[0] == pytest.approx(
        2 * span, rel=0.02
    )
    assert len(seeds(desk)) == 1, "two fingers place nothing"
    page.locator("[data-plane=axial] input[type=range]").fill(str(SHAPE[0] - 1))
    watched.until(f"{HANDLE}.shown().axial === {SHAPE[0] - 1}")
    assert watched.complaints == []
