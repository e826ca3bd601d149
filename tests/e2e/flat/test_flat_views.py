"""The ultrasound beam and picture, and the X-ray pictures, in a real browser on a recording whose poses are known."""

import io
import json
from collections.abc import Callable
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from websockets.sync.client import connect

from cathxr.core import FloatArray

from .played import FlatPage, Played

OpenPage = Callable[..., FlatPage]
_PICTURED = "window.__cathxrFlat.ice().message === '' && window.__cathxrFlat.ice().made > 3"


def grey(page: FlatPage) -> npt.NDArray[np.uint8]:
    """Return the ultrasound picture (samples, lines)."""
    told = page.ask("window.__cathxrFlat.ice()")
    return np.asarray(told["grey"], np.uint8).reshape(told["samples"], told["lines"])


def angle_deg(a: FloatArray, b: FloatArray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b))))


def test_the_beam_looks_where_the_track_says(turning: Played, open_page: OpenPage) -> None:
    """Within 1 degree while the catheter turns: the drawn matrix against the Tracks sent around the drawn instant."""
    page = open_page(turning)
    page.set(ice=True, depthMm=80)
    page.until("window.__cathxrFlat.beam().visible")
    offs, axes = [], []
    for _ in range(12):
        page.frames(7)
        told = page.ask("({ beam: window.__cathxrFlat.beam(), drawn: window.__cathxr.drawn() })")
        page.page.wait_for_timeout(150)  # until the Track after this instant has come to the witness, too
        offs.append(angle_deg(np.array(told["beam"]["direction"]), turning.beam_at(told["drawn"]["t"])))
        axes.append(angle_deg(np.array(told["beam"]["axis"]), np.array([1.0, 0.0, 0.0])))
        ball = np.array(told["beam"]["ball"]) - np.array(told["beam"]["origin"])
        assert np.linalg.norm(ball) == pytest.approx(80.0, abs=1e-3)
        assert angle_deg(ball, np.array(told["beam"]["direction"])) < 0.01
        from_tip = np.array(told["beam"]["origin"]) - np.array(told["drawn"]["tip"])
        assert from_tip[0] == pytest.approx(-5.0, abs=0.15)  # the array lies behind the tip
    print(f"beam off by {max(offs):.2f} degrees at most, the catheter's axis by {max(axes):.2f}")
    assert max(offs) < 1.0
    assert max(axes) < 0.5
    assert page.complaints == []


def test_the_picture_is_one_of_blood_and_walls_and_does_what_it_is_told(turning: Played, open_page: OpenPage) -> None:
    page = open_page(turning)
    page.set(ice=True)
    page.until(_PICTURED)
    picture = grey(page)
    beyond_ring = picture[40:]
    assert np.median(beyond_ring) < 60
    assert np.percentile(beyond_ring, 99) > 120  # walls: twice the brightest that the middle of all may be
    page.set(gainDb=12)
    made = page.ask("window.__cathxrFlat.ice().made")
    page.until(f"window.__cathxrFlat.ice().made > {made + 5}")
    assert grey(page)[40:].mean() > beyond_ring.mean() + 15
    page.set(frozen=True)
    page.frames(3)
    held = grey(page)
    page.frames(40)
    assert np.array_equal(grey(page), held)
    page.set(frozen=False)
    page.frames(40)
    assert not np.array_equal(grey(page), held)
    assert page.complaints == []


def test_a_tip_at_rest_gives_a_picture_at_rest(resting: Played, open_page: OpenPage) -> None:
    """Noise of 0.02 mm and 0.05 degrees: the picture does not crawl, and hardly any are made."""
    page = open_page(resting)
    page.set(ice=True)
    page.until(_PICTURED)
    page.page.wait_for_timeout(9000)  # until the page has learnt how large the noise is: some 60 Tracks, 12 a second
    begin = page.ask("window.__cathxrFlat.ice().made")
    pictures = []
    for _ in range(8):
        pictures.append(grey(page).astype(float))
        page.frames(12)
    made = page.ask("window.__cathxrFlat.ice().made") - begin
    steps = [np.abs(b - a).mean() for a, b in pairwise(pictures)]
    print(f"mean grey difference between looks: {np.mean(steps):.2f}, at most {max(steps):.2f}; pictures made: {made}")
    # A picture of another place differs by some 10 grey levels; one that is only made anew, with noise, by some 0.5.
    assert max(steps) < 2.5


_MADE = "({ ice: window.__cathxrFlat.ice().made, xray: window.__cathxrFlat.xrayMade(), s: performance.now() / 1000 })"


def test_pictures_cost_nothing_at_rest_and_their_own_rate_while_the_tip_crawls(
    resting: Played, crawling: Played, open_page: OpenPage
) -> None:
    """The X-ray's rays are followed only when an arm turns; ultrasound at most ten times a second, as asked for."""
    for played in (resting, crawling):
        page = open_page(played)
        page.set(mode="2d", ice=True)
        page.until(_PICTURED + " && window.__cathxrFlat.xrayMade() >= 4")  # a coarse and a fine one of each arm
        page.page.wait_for_timeout(3000)
        begin = page.ask(_MADE)
        page.page.wait_for_timeout(4000)
        end = page.ask(_MADE)
        ice_hz = (end["ice"] - begin["ice"]) / (end["s"] - begin["s"])
        print(f"{ice_hz:.1f} ultrasound pictures a second, {end['xray'] - begin['xray']} X-ray pictures")
        assert end["xray"] == begin["xray"]
        assert ice_hz < 0.6 if played is resting else 0.5 < ice_hz < 10.5
        page.set(arms=[{"laoDeg": 20, "cranialDeg": 0}, {"laoDeg": 90, "cranialDeg": 0}])
        page.until(f"window.__cathxrFlat.xrayMade() === {end['xray'] + 2}")  # of the arm that has turned
        page.context.close()


def test_without_a_known_roll_there_is_no_beam_and_the_panel_says_why(blind: Played, open_page: OpenPage) -> None:
    page = open_page(blind)
    page.set(ice=True)
    page.until("window.__cathxrFlat.ice().message.startsWith('Roll is not known')")
    assert page.ask("window.__cathxrFlat.beam().visible") is False
    assert page.ask("window.__cathxrFlat.ice().made") == 0
    assert page.complaints == []


def _screen(page: FlatPage) -> npt.NDArray[np.uint8]:
    data = np.frombuffer(io.BytesIO(page.page.screenshot()).getvalue(), np.uint8)
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE))


@pytest.mark.parametrize("arm", [0, 1])
def test_the_catheter_is_dark_where_the_arm_sees_it(resting: Played, open_page: OpenPage, arm: int) -> None:
    page = open_page(resting)
    page.set(mode="2d", arms=[{"laoDeg": -30, "cranialDeg": 0}, {"laoDeg": 45, "cranialDeg": 20}])
    page.page.wait_for_timeout(3000)
    page.frames(30)
    holes = page.ask(
        "[...document.querySelectorAll('.arm .hole')].map((each) => each.getBoundingClientRect().toJSON())"
    )
    hole = holes[arm]
    side = min(hole["width"], hole["height"])
    middle = np.array([hole["x"] + hole["width"] / 2.0, hole["y"] + hole["height"] / 2.0])
    screen = _screen(page).astype(float)

    def shown(point: list[float]) -> tuple[int, int]:
        x, y = page.ask(f"window.__cathxrFlat.inPicture({arm}, {json.dumps(point)})")
        column, row = middle + 0.5 * side * np.array([x, -y])
        return round(row), round(column)

    darker = 0
    for along in (15.0, 25.0, 35.0, 45.0):
        row, column = shown([along, 0.0, 0.0])
        across = screen[row, column - 14 : column + 15]
        assert across[12:17].min() < 0.75 * np.median(across), (along, np.round(across))
        darker += 1
    assert darker == 4
    tip = shown([52.0, 0.0, 0.0])
    ahead = shown([66.0, 0.0, 0.0])
    assert screen[tip] < 0.8 * screen[ahead[0] - 2 : ahead[0] + 3, ahead[1] - 2 : ahead[1] + 3].mean()
    assert page.complaints == []


def test_a_lock_leaves_only_one_of_the_views(turning: Played, open_page: OpenPage) -> None:
    page = open_page(turning)
    hidden = "document.querySelector('.flat').hidden"
    with connect(f"ws://127.0.0.1:{turning.port}/ws?protocol=1", compression=None) as link:

        def ask(name: str, **args: object) -> None:
            link.send(json.dumps({"type": "command", "name": name, "args": args, "id": name}))

        ask("lock_view", values={"mode": "2d"}, sentence="This task is done with the flat pictures.")
        page.until("window.__cathxrFlat.settings.mode === '2d'")
        page.frames(5)
        assert page.ask(hidden) is False
        page.set(mode="3d")
        page.frames(5)
        assert page.ask("window.__cathxrFlat.settings.mode") == "2d"
        assert page.ask(hidden) is False
        ask("lock_view", values={"mode": "3d"}, sentence="This task is done in space.")
        page.until("window.__cathxrFlat.settings.mode === '3d'")
        page.set(mode="2d")
        page.frames(5)
        assert page.ask(hidden) is True
        ask("unlock_view")
        page.frames(5)


@pytest.mark.parametrize("size", [(1280, 720), (390, 844)])
def test_the_pictures_fit_the_screen_and_can_be_resized(
    resting: Played, open_page: OpenPage, size: tuple[int, int]
) -> None:
    page = open_page(resting, size=size)
    page.set(mode="2d", ice=True)
    page.frames(10)
    measure = "[...document.querySelectorAll('.flat .hole')].map((each) => each.getBoundingClientRect().toJSON())"
    before = page.ask(measure)
    for hole in before:
        assert hole["width"] > 100
        assert hole["height"] > 100
        assert hole["right"] <= size[0]
        assert hole["bottom"] <= size[1]
    bar = page.page.locator(".splitter.row")
    bar.focus()
    for _ in range(4):
        bar.press("ArrowUp")
    page.frames(5)
    after = page.ask(measure)
    assert after[0]["height"] < before[0]["height"] - 20
    assert after[2]["height"] > before[2]["height"] + 20
    assert page.complaints == []
