"""A page in a browser that a test asks: everything that drives a page builds on this."""

import time
from typing import Any

from playwright.sync_api import Page

HANG_S = 120.0
"""Limit on waiting for what must come, on a loaded machine without a graphics card; not a measurement."""
STATE = "JSON.stringify([window.__cathxr?.link, window.__cathxr?.status, document.body.innerText])"


class AskedPage:
    """A page that is asked, and everything that it complained about.

    A class of its own sets `page` once it has opened it, and calls `listen` before the first address.
    """

    page: Page
    hang_s = HANG_S
    state = STATE
    """What is asked of the page for the message when something never came true."""

    def listen(self) -> None:
        """Keep what the page says on its console as an error or a warning, and what it does not catch."""
        self.complaints: list[str] = []
        self.page.on("console", lambda told: self.note(told.type, told.text))
        self.page.on("pageerror", lambda error: self.complaints.append(f"uncaught: {error}"))

    def note(self, kind: str, text: str) -> None:
        """Keep a line of the console; classes that expect some leave these out."""
        if kind in ("error", "warning"):
            self.complaints.append(f"{kind}: {text}")

    def ask(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        return self.page.evaluate(f"() => {expression}")

    def until(self, expression: str) -> Any:
        """Return the expression's value once it is true. Not `wait_for_function`: the page's policy forbids eval."""
        deadline = time.monotonic() + self.hang_s
        while time.monotonic() < deadline:
            if value := self.ask(expression):
                return value
            self.page.wait_for_timeout(40)
        raise AssertionError(f"never came true: {expression}\n{self.ask(self.state)}\n{self.complaints}")
