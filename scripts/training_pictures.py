"""Takes the documents' pictures of training from the real server: docs/images/training-*.png. See page_pictures.py.

A study of one participant is made, two trials of the clockwise sweep are done on the twin's rendered pictures, the
first in an emulated headset and the second on the page, and the survey after them is asked in both.
"""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import Browser, Page

from cathxr.core import FloatArray
from cathxr.runtime.simulated_aim import controls_for
from cathxr.storage.rig_file import example_rig
from cathxr.training.placing import PlacedTarget
from cathxr.twin import TwinWorld, scene, true_rig

Until = Callable[[Page, str], None]
CONTROLS = ("insertion_mm", "roll_deg", "anterior_deg", "left_deg")
SIZE, EYES = (1360, 800), (1800, 780)
DESIGN = """schema = "cathxr-study/1"
key = "views"
title = "Views"
question = "Does the view change how fast standard views are found?"
[conditions.3d]
name = "3D view"
view = "3d"
[conditions.2d]
name = "2D view"
view = "2d"
[sequences]
kind = "listed"
listed = [["3d", "2d"]]
[trials]
tasks = ["clockwise_sweep"]
per_condition = 2
[participants]
planned = 1
[allocation]
blocks = [1]
[outcomes]
primary = "t"
[[surveys]]
survey = "tlx"
asked = "each"
"""
SETTINGS: dict[str, Any] = {"ice": True, "hud": True, "frozen": False, "sectorDeg": 90, "depthMm": 90, "gainDb": 3,
                            "teaching": 0.3, "heartOpacity": 0.2}  # fmt: skip
STATE = "window.__cathxr?.training"
STORED = f"{STATE}.state.result?.stored?.startsWith('Stored')"


@contextmanager
def study(folder: Path) -> Iterator[list[str]]:
    """Make a study with a participant in a folder, and give the options of `cathxr run` for it."""
    (folder / "study.toml").write_text(DESIGN, encoding="utf-8")
    for command in (["init", str(folder)], ["allocate", "P07", "--study", str(folder)]):
        subprocess.run([sys.executable, "-m", "cathxr", "study", *command], check=True, stdout=subprocess.DEVNULL)
    yield ["--study", str(folder), "--recordings", str(folder / "recordings")]


class Hand:
    """Steers the twin to a trial's targets by the page's own link."""

    def __init__(self, page: Page, until: Until) -> None:
        self.page, self.until = page, until
        self._body = TwinWorld(true_rig(example_rig(), 0), seed=0, settings=scene("smooth"), start_ns=0).body
        self._now: FloatArray = np.array([60.0, 0.0, 0.0, 0.0])

    def state(self) -> dict[str, Any]:
        """Return how training stands."""
        found: dict[str, Any] = self.page.evaluate(f"() => {STATE}.state")
        return found

    def aim(self, *, beside_deg: float = 0.0) -> None:
        """Steer to the target that is offered, or to a roll beside it."""
        state = self.state()
        target = next(each for each in state["run"]["targets"] if each["key"] == state["now"]["target"])
        vectors = {key: None if target[key] is None else np.array(target[key]) for key in ("direction", "up")}
        placed = PlacedTarget(
            target["key"], target["name"], target["kind"], np.array(target["position_mm"]), target["radius_mm"],
            direction_box=vectors["direction"], up_box=vectors["up"],
        )  # fmt: skip
        self._now = controls_for(self._body, placed, self._now)
        values = dict(zip(CONTROLS, map(float, self._now), strict=True))
        self.command("steer", **(values | {"roll_deg": values["roll_deg"] + beside_deg}))

    def reach(self, number: int | None = None) -> None:
        """Reach targets until the `number`-th is offered, or until the trial has ended."""
        while self.state()["phase"] in ("running", "paused"):
            if self.state()["phase"] == "paused":  # a machine that stalls
                self.command("training_resume")
                self.until(self.page, f"{STATE}.phase === 'running'")
            now = self.state()["now"]
            if number is not None and now["number"] >= number:
                return
            self.aim()
            self.until(self.page, f"{STATE}.phase !== 'running' || {STATE}.state.now.number !== {now['number']}")

    def command(self, name: str, **args: Any) -> None:
        """Ask the server by a link of the page's own."""
        self.page.evaluate(
            """([name, args]) => new Promise((done, fail) => {
                const link = new WebSocket(`ws://${location.host}/ws?protocol=1`);
                link.onopen = () => link.send(JSON.stringify({ type: "command", name, args, id: "picture" }));
                link.onmessage = ({ data }) => {
                    const told = JSON.parse(data);
                    const mine = told.id === "picture" || told.payload?.id === "picture";
                    if (mine && (told.type === "refusal" || told.kind === "done")) {
                        link.close();
                        if (told.type === "refusal") fail(new Error(told.sentence));
                        else done();
                    }
                };
            })""",
            [name, args],
        )

    def begin(self) -> None:
        """Prepare what the study says, and begin."""
        self.command("training_prepare", participant="P07")
        self.until(self.page, f"{STATE}.phase === 'ready'")
        self.command("training_begin")
        self.until(self.page, f"{STATE}.phase === 'running'")


def take_all(browser: Browser, address: str, until: Until, write: Callable[[np.ndarray, str], None]) -> None:
    """Take all pictures. address: of a server of that study. write: keeps a picture (H, W, 3) BGR under a name."""

    def shot(page: Page) -> np.ndarray:
        page.wait_for_timeout(6000)
        data = page.screenshot(timeout=240_000)
        return np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR))

    def eye(page: Page) -> np.ndarray:
        both = shot(page)
        high, wide = both.shape[0], both.shape[1] // 2
        return np.ascontiguousarray(both[: high * 7 // 8, : wide * 9 // 10])

    worn = _headset(browser, address, until)
    hand = Hand(worn, until)
    hand.begin()
    hand.reach(3)
    hand.aim(beside_deg=-25.0)
    write(eye(worn), "training-headset")
    hand.reach()
    until(worn, STORED)  # on a busy machine the next trial would be refused until then
    worn.context.close()

    page = _desktop(browser, address, until)
    hand = Hand(page, until)
    hand.begin()
    hand.reach(3)
    hand.aim(beside_deg=-25.0)
    write(shot(page), "training-trial")
    hand.reach()
    until(page, STORED)
    page.locator("#training").get_by_role("button", name="Show the run", exact=True).click()
    until(page, f"{STATE}.replayS > 4")
    slider = page.locator("#training-time")
    middle = 0.75 * float(str(slider.get_attribute("max")))
    slider.evaluate("(own, value) => { own.value = value; own.dispatchEvent(new Event('input')); }", middle)
    write(shot(page), "training-result")
    until(page, f"{STATE}.state.survey !== null")
    page.get_by_role("button", name="Answer here").click()
    write(shot(page), "training-survey")
    page.context.close()

    worn = _headset(browser, address, until)
    until(worn, f"{STATE}.asked !== ''")
    _press(worn, until, "survey", "Begin")
    write(eye(worn), "training-headset-survey")
    worn.context.close()


def _desktop(browser: Browser, address: str, until: Until) -> Page:
    page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
    page.goto(f"{address}/?aa=1&dpr=1&pictures=0&iceHz=3&guide=0")
    until(page, "window.__cathxr?.drawn() && window.__cathxr.heartParts > 0 && window.__cathxr.training.offer")
    page.evaluate("(change) => window.__cathxrFlat.set(change)", SETTINGS)
    toggle = page.locator("#training-toggle[aria-expanded=false]")
    if toggle.count():
        toggle.click()
    return page


def _headset(browser: Browser, address: str, until: Until) -> Page:
    page = browser.new_page(viewport={"width": EYES[0], "height": EYES[1]})
    page.goto(f"{address}/?xr=emulate&aa=1&dpr=1&pictures=0&iceHz=3&guide=0")
    until(page, "window.__cathxr?.drawn() && window.__cathxr.heartParts > 0 && window.__cathxr.training.offer")
    page.mouse.click(3, 3)  # a browser wants a person's press before
    page.evaluate("(mode) => window.__cathxr.xr.enter(mode)", "vr")
    until(page, "window.__cathxr.xr.report().settled")
    page.evaluate("(change) => window.__cathxr.xr.set(change)", SETTINGS)
    for side, x in (("left", -0.22), ("right", 0.22)):
        _put(page, f"controller-{side}", (x, 1.02, -0.4), 0.0)
    _put(page, "headset", (0.0, 1.42, -0.12), 14.0)
    return page


def _press(page: Page, until: Until, plate: str, label: str) -> None:
    """Point the right controller at a button of a plate and press, until the plate says something else."""
    where = f"window.__cathxr.training.button({plate!r}, {label!r})"
    until(page, where)
    hand = np.array([0.25, 1.2, -0.15])
    for _ in range(5):
        found = page.evaluate(f"() => {where}")
        if found is None:
            break
        x, y, z = np.array(found) - hand
        _put(page, "controller-right", tuple(hand), -float(np.rad2deg(np.arctan2(y, np.hypot(x, z)))), (x, z))
        _frames(page, until)
        for value in (1, 0):
            page.evaluate("(value) => window.__headset.controllers.right.updateButtonValue('trigger', value)", value)
            _frames(page, until)
    _put(page, "controller-right", (0.22, 1.02, -0.4), 0.0)


def _frames(page: Page, until: Until) -> None:
    """Wait for some frames of the session, however long they take."""
    now = page.evaluate("() => window.__cathxr.xr.report().frames")
    until(page, f"window.__cathxr.xr.report().frames >= {now + 4}")


def _put(
    page: Page, device: str, position: tuple[float, ...], down_deg: float, ahead: tuple[float, float] = (0, -1)
) -> None:
    """Put a device somewhere, looking so far down and towards `ahead` (x, z)."""
    half, yaw = np.deg2rad(-down_deg) / 2, np.arctan2(-ahead[0], -ahead[1]) / 2
    sp, cp, sy, cy = np.sin(half), np.cos(half), np.sin(yaw), np.cos(yaw)
    page.evaluate(
        "(params) => window.__headset.remote.dispatch('set_transform', params)",
        {
            "device": device,
            "position": dict(zip("xyz", position, strict=True)),
            "orientation": {"x": float(cy * sp), "y": float(sy * cp), "z": float(-sy * sp), "w": float(cy * cp)},
        },
    )
