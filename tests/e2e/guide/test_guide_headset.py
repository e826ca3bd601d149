"""The guide in an emulated headset: by the controllers' rays through all of it, and by bare hands."""

import time
from typing import Literal

import pytest

from .newcomer import DONE, HANG_S, Wearer, to_target


@pytest.mark.proof  # minutes; at the desktop all of it is done in every run
def test_a_newcomer_is_led_through_all_of_it_by_ray(wearer: Wearer) -> None:
    _begin(wearer, "controller")
    for step, buttons in (
        ("take", ("Push in", "Pull back")),
        ("insert", ("Pull back", "Pull back", "Push in", "Push in")),
        ("roll", ("Roll left",)),
        ("flex", ("Left", "Left", "Right", "Right")),
    ):
        wearer.until(f"window.__cathxr.guide.step === '{step}'")
        wearer.work(*buttons)
        wearer.until_past(step)
    _carry(wearer)
    _enlarge(wearer)

    assert wearer.step == "settings"
    wearer.press("right", "b-button")
    wearer.until("window.__cathxr.guide.progress.includes('menu is open')")
    wearer.press_at(wearer.until("window.__cathxr.xr.row('Numbers')"))
    wearer.until_past("settings")
    wearer.until("window.__cathxr.guide.progress.startsWith('1')")
    wearer.press_at(wearer.until("window.__cathxr.xr.row('Ultrasound (ICE)')"))
    wearer.until_past("picture")
    wearer.press("right", "b-button")
    _reach(wearer)
    wearer.press_button("Done")
    assert wearer.ask("window.__cathxr.guide.phase") == "idle"
    assert not wearer.ask("window.__cathxr.guide.plate")


@pytest.mark.parametrize("device", ["hand"])
def test_bare_hands_press_hold_and_leave_it(wearer: Wearer, device: Literal["hand"]) -> None:
    _begin(wearer, device)
    wearer.work("Push in", "Pull back")
    wearer.until_past("take")
    assert "pinch" not in wearer.ask("window.__cathxr.guide.text").lower()
    while wearer.step != "turn":
        before = wearer.step
        wearer.press_button("Next")
        assert wearer.step != before
    assert "Pinch" in wearer.ask("window.__cathxr.guide.text")
    _carry(wearer)
    wearer.press_button("Back")
    assert wearer.step == "turn"
    assert wearer.ask(DONE), "what is done stays done"
    wearer.press_button("Skip the guide")
    assert wearer.ask("window.__cathxr.guide.phase") == "idle"
    wearer.frames(30)
    assert wearer.ask("window.__cathxr.guide.phase") == "idle"
    wearer.ask("window.__cathxr.guide.start(false)")
    assert wearer.step == "turn", "it goes on where it was left"


def _begin(wearer: Wearer, device: Literal["controller", "hand"]) -> None:
    wearer.until("window.__cathxr.heartParts > 0")
    wearer.enter("vr")
    wearer.take_up(device)
    wearer.until("window.__cathxr.guide.phase === 'offered' && window.__cathxr.guide.plate")
    wearer.press_button("Show me")
    assert wearer.step == "take"


def _carry(wearer: Wearer) -> None:
    """Take the heart in one hand and carry it; a hand that holds nothing carries nothing."""
    assert wearer.step == "turn"
    right = f"{wearer.device}-right"
    away = [0.0, 0.0, 0.0, 1.0]
    wearer.put(right, [0.25, 1.0, -0.3], away)
    wearer.put(right, [0.25, 1.0, -0.55], away)
    assert not wearer.ask(DONE)
    wearer.put(right, [0.25, 1.0, -0.3], away)
    wearer.squeeze(down=True)
    for z in (-0.34, -0.38, -0.42, -0.46):
        wearer.put(right, [0.25, 1.0, z], away)
    wearer.squeeze(down=False)
    wearer.until_past("turn")


def _enlarge(wearer: Wearer) -> None:
    assert wearer.step == "size"
    level = [0.0, 0.0, 0.0, 1.0]
    for side, x in (("left", -0.1), ("right", 0.1)):
        wearer.put(f"{wearer.device}-{side}", [x, 0.95, -0.4], level)
    wearer.squeeze(down=True, side="left")
    wearer.squeeze(down=True, side="right")
    for x in (0.12, 0.15, 0.18):
        wearer.put(f"{wearer.device}-left", [-x, 0.95, -0.4], level)
        wearer.put(f"{wearer.device}-right", [x, 0.95, -0.4], level)
    wearer.squeeze(down=False, side="left")
    wearer.squeeze(down=False, side="right")
    wearer.until_past("size")


def _reach(wearer: Wearer) -> None:
    assert wearer.step == "target"
    deadline = time.monotonic() + HANG_S
    while wearer.step == "target" and not wearer.ask(DONE):
        assert time.monotonic() < deadline, wearer.ask("window.__cathxr.guide.progress")
        way = to_target(wearer.ask, wearer.page)
        if way is None or abs(way) < 3.0:
            wearer.page.wait_for_timeout(500)
        else:
            wearer.press_button("Push in" if way > 0 else "Pull back")  # a press of some frames: some mm
    wearer.until_past("target")
