"""A page with an emulated headset: the test moves the viewer's head and hands, and asks the page what it did."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from playwright.sync_api import Browser, Page

from ..asked_page import AskedPage

CHEAP = "?xr=emulate&aa=0&mat=lambert&dpr=0.5&pictures=0&iceHz=5&guide=0"
SIZE = (480, 240)
Side = Literal["left", "right"]
Place = Sequence[float] | npt.NDArray[np.float64]


class Headset(AskedPage):
    """The page in a browser of its own context, and everything that it asked for and complained about."""

    state = "JSON.stringify([window.__cathxr?.link, window.__cathxr?.status, window.__cathxr?.xr.report()])"

    def __init__(self, browser: Browser, url: str, *, query: str = CHEAP, size: tuple[int, int] = SIZE) -> None:
        self.url = url.split("?")[0]
        self.context = browser.new_context(viewport={"width": size[0], "height": size[1]}, device_scale_factor=1)
        self.page: Page = self.context.new_page()
        self.requests: list[str] = []
        self.listen()
        self.context.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.requests.append(socket.url))
        self.page.goto(self.url + query)
        self.until("window.__cathxr?.drawn() && window.__cathxr.link === 'live'")

    def strays(self) -> list[str]:
        """Return every request of the page, its workers and sockets that did not go to the page's own host."""
        own = (self.url, self.url.replace("http", "ws", 1), f"blob:{self.url}", "data:")
        return [url for url in self.requests if not url.startswith(own)]

    def set(self, **change: Any) -> None:
        self.page.evaluate("(change) => window.__cathxr.xr.set(change)", change)

    # --- the session ---

    def enter(self, mode: Literal["vr", "ar"]) -> None:
        """Begin a session by the button's own way, and wait until the heart stands before the viewer."""
        self.page.mouse.click(3, 3)  # a browser wants a person's press before
        self.page.evaluate("(mode) => window.__cathxr.xr.enter(mode)", mode)
        self.until("window.__cathxr.xr.report().settled")
        self.frames(2)

    def leave(self) -> None:
        self.ask("window.__cathxr.xr.leave()")
        self.until("window.__cathxr.xr.report().mode === null")

    def frames(self, count: int) -> None:
        """Wait for so many more frames of the session."""
        now = self.report()["frames"]
        self.until(f"window.__cathxr.xr.report().frames >= {now + count}")

    def report(self) -> dict[str, Any]:
        found: dict[str, Any] = self.ask("window.__cathxr.xr.report()")
        return found

    def settings(self) -> dict[str, Any]:
        found: dict[str, Any] = self.ask("window.__cathxr.xr.settings()")
        return found

    def world(self) -> npt.NDArray[np.float64]:
        """Return room_from_world, 4x4, m."""
        stands = self.report()["world"]
        matrix = np.eye(4)
        matrix[:3, :3] = stands["scale"] * rotation(stands["orientation"])
        matrix[:3, 3] = stands["position"]
        return matrix

    # --- the viewer ---

    def hands(self, kind: Literal["controller", "hand"]) -> None:
        """Take the controllers up, or put them down."""
        self.page.evaluate("(mode) => window.__headset.remote.dispatch('set_input_mode', { mode })", kind)
        self.frames(3)

    def put(self, device: str, position: Place, turn_xyzw: Place = (0.0, 0.0, 0.0, 1.0)) -> None:
        x, y, z = (float(each) for each in position)
        a, b, c, w = (float(each) for each in turn_xyzw)
        self.page.evaluate(
            "(params) => window.__headset.remote.dispatch('set_transform', params)",
            {"device": device, "position": {"x": x, "y": y, "z": z}, "orientation": {"x": a, "y": b, "z": c, "w": w}},
        )
        self.frames(2)

    def aim(self, device: str, position: Place, target: Place) -> None:
        """Put a hand somewhere so that its ray goes through a place."""
        self.put(device, position, turn_towards(position, target))

    def button(self, side: Side, name: str, *, down: bool) -> None:
        """Press or release a controller's button: trigger, squeeze, a-button, …"""
        self.page.evaluate(
            "([side, name, value]) => window.__headset.controllers[side].updateButtonValue(name, value)",
            [side, name, int(down)],
        )
        self.frames(2)

    def press(self, side: Side, name: str) -> None:
        self.button(side, name, down=True)
        self.button(side, name, down=False)

    def row(self, label: str, segment: int = -1, *, hand: Place = (0.3, 1.25, -0.1), side: Side = "right") -> None:
        """Point a controller at a row of the open menu and press."""
        self.aim(f"controller-{side}", hand, self.until(f"window.__cathxr.xr.row({label!r}, {segment})"))
        self.press(side, "trigger")
        self.frames(6)

    def tab(self, name: str) -> None:
        self.page.evaluate("(name) => window.__cathxr.xr.tab(name)", name)
        self.frames(8)

    def pinch(self, side: Side, *, down: bool) -> None:
        self.page.evaluate("([side, value]) => window.__headset.hands[side].updatePinchValue(value)", [side, int(down)])
        self.frames(2)


def turn_towards(position: Place, target: Place) -> npt.NDArray[np.float64]:
    """Return the level turn (x, y, z, w) that takes -z to the way from a place to another."""
    x, y, z = np.asarray(target, dtype=float) - np.asarray(position, dtype=float)
    yaw, pitch = np.arctan2(-x, -z), np.arctan2(y, np.hypot(x, z))
    (sy, cy), (sp, cp) = ((np.sin(each / 2), np.cos(each / 2)) for each in (yaw, pitch))
    return np.array([cy * sp, sy * cp, -sy * sp, cy * cp])


def rotation(turn_xyzw: Sequence[float]) -> npt.NDArray[np.float64]:
    """Return the 3x3 matrix of a unit quaternion."""
    x, y, z, w = turn_xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
