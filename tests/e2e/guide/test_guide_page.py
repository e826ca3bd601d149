"""The guide on the page, gone through on the real command with the twin: every step ends by what is really done."""

import itertools
import json
import time
from collections.abc import Callable

from .newcomer import DONE, HANG_S, Newcomer, to_target

Open = Callable[..., Newcomer]
ALL = ["take", "insert", "roll", "flex", "turn", "size", "settings", "picture", "target", "end"]


def test_a_newcomer_is_led_through_all_of_it_at_the_desktop(newcomer: Open) -> None:
    person = newcomer()
    page = person.page
    person.until("window.__cathxr.guide.phase === 'offered'")
    assert page.locator(".guide").is_visible()
    person.until("window.__cathxr.heartParts > 0")
    page.get_by_role("button", name="Show me").click()
    assert person.step == "take"
    person.until("window.__cathxr.guide.steps.includes('roll')")
    assert person.steps == ALL
    person.watch(2)
    assert person.step == "take", "the twin's own motion is nobody's doing"
    assert not person.ask(DONE)

    person.work("w s")
    person.until_past("take")
    _insert(person)
    person.work("a a a d d d")
    person.until_past("roll")
    _flex(person)
    _look_round(person)

    page.locator("#set-landmarks").click()
    person.until_past("settings")
    page.locator("#set-ice").click()
    assert person.ask("window.__cathxr.guide.step") == "picture"
    person.until("window.__cathxr.guide.progress.startsWith('1') || window.__cathxr.guide.done")
    page.locator("#set-ice").click()
    person.until_past("picture")
    _reach(person)

    assert page.locator(".guide-skip").is_hidden()
    page.get_by_role("button", name="Done").click()
    assert person.phase == "idle"
    page.locator(".guide").wait_for(state="hidden")
    assert (
        person.ask("window.__cathxr.scene().targets.filter((each) => /Practice/.test(each.name ?? each)).length") == 0
    )
    assert json.loads(person.ask("localStorage['cathxr.guide']"))["page"]["state"] == "finished"
    person.open()
    person.until("window.__cathxr.heartParts > 0")
    person.watch(4)
    assert person.phase == "idle", "who has been led round is not asked again"
    assert person.complaints == []


def _insert(person: Newcomer) -> None:
    """Pushing is measured; rolling is not pushing."""
    assert person.step == "insert"
    person.press_for("d", 900)  # 100 degrees a second
    person.watch(0.5)
    assert person.step == "insert"
    assert not person.ask(DONE), person.progress
    person.work("s w")
    person.until_past("insert")


def _flex(person: Newcomer) -> None:
    """Bending is measured, by a slider this time; pushing is not bending."""
    assert person.step == "flex"
    person.press_for("w", 600)
    person.watch(0.5)
    assert not person.ask(DONE), person.progress
    slider = person.page.locator("#slider-left_deg")
    begin = round(float(slider.input_value()))
    deadline = time.monotonic() + HANG_S
    for by in itertools.cycle((12, 24, 36, 24, 12, 0, -12, -24, -12, 0)):
        if person.step != "flex" or person.ask(DONE):
            break
        assert time.monotonic() < deadline, person.progress
        slider.fill(str(begin + by))
        person.watch(0.4)
    person.until_past("flex")


def _look_round(person: Newcomer) -> None:
    assert person.step == "turn"
    mouse = person.page.mouse
    mouse.move(480, 260)
    mouse.down()
    for x in range(480, 660, 10):
        mouse.move(x, 260)
    mouse.up()
    person.until_past("turn")
    for _ in range(8):
        mouse.wheel(0, -200)
        person.page.wait_for_timeout(60)
    person.until_past("size")


def _reach(person: Newcomer) -> None:
    """Bring the tip into the ball by presses as long as the way is; where it is there, wait."""
    assert person.step == "target"
    deadline = time.monotonic() + HANG_S
    while person.step == "target" and not person.ask(DONE):
        assert time.monotonic() < deadline, person.progress
        way = to_target(person.ask, person.page)
        if way is None or abs(way) < 3.0:
            person.watch(0.5)
        else:
            person.press_for("w" if way > 0 else "s", round(min(400, max(60, 25 * abs(way)))))
    person.until_past("target")


def test_it_can_be_left_at_any_step_and_taken_up_again_from_help(newcomer: Open) -> None:
    person = newcomer()
    page = person.page
    person.until("window.__cathxr.guide.phase === 'offered'")
    page.get_by_role("button", name="Show me").click()
    page.locator("h2.guide-title").click()
    for _ in range(2):
        page.keyboard.press("Enter")
    left = person.step
    assert left == person.steps[2]
    page.get_by_role("button", name="Back").click()
    page.get_by_role("button", name="Next").click()
    page.keyboard.press("Escape")
    assert person.phase == "idle"
    page.locator(".guide").wait_for(state="hidden")
    assert "Help" in page.locator("#toasts").inner_text()

    page.keyboard.press("?")
    assert page.locator("#help").is_visible()
    page.get_by_role("button", name="Go on at step 3").click()
    assert page.locator("#help").is_hidden()
    assert person.step == left
    person.open()  # loaded anew in the middle: it offers to go on
    person.until("window.__cathxr.guide.phase === 'offered'")
    page.get_by_role("button", name="Go on").click()
    assert person.step == left
    page.get_by_role("button", name="Skip the guide").click()
    assert person.phase == "idle"
    page.locator("#help-open").click()
    page.get_by_role("button", name="From the beginning").click()
    assert person.step == "take"


def test_a_no_is_a_no(newcomer: Open) -> None:
    person = newcomer()
    person.until("window.__cathxr.guide.phase === 'offered'")
    person.page.get_by_role("button", name="No, thank you").click()
    assert person.phase == "idle"
    person.open()
    person.watch(4)
    assert person.phase == "idle"
    quiet = newcomer(query="&guide=0")
    quiet.watch(4)
    assert quiet.phase == "idle"


def test_what_makes_no_sense_is_left_out(newcomer: Open) -> None:
    person = newcomer(query="&heart=0")
    person.until("window.__cathxr.guide.phase === 'offered'")
    person.until("window.__cathxr.guide.steps.includes('roll')")
    assert person.steps == [each for each in ALL if each not in ("picture", "target")]
    person.ask("window.__cathxr.guide.start(true)")
    person.ask("window.__cathxr.xr.hold({ values: { mode: '2d' }, sentence: 'The exercise holds this.' })")
    person.until("!window.__cathxr.guide.steps.includes('turn')")
    assert "size" not in person.steps
    assert "settings" in person.steps
    assert person.step == "take"
