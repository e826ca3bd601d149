"""The page of `cathxr register --touch` in a real browser, with the twin and the real tracker behind it."""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect, sync_playwright

from cathxr.registration import read_registration

HANG_MS = 240_000.0
"""A limit on hanging, not a measurement."""


@pytest.fixture
def page(tmp_path: Path, require_tool: Callable[[str], Path]) -> Iterator[Page]:
    arguments = ["register", "--touch", "--source", "twin", "--seed", "2", "--out", str(tmp_path / "registration.toml")]
    process = subprocess.Popen(
        [sys.executable, "-m", "cathxr", *arguments, "--no-browser", "--port", "0"],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1, encoding="utf-8",
    )  # fmt: skip
    assert process.stdout is not None
    try:
        found = None
        said = ""
        while found is None and (line := process.stdout.readline()):
            said += line
            found = re.search(r"Open (http://\S+)", line)
        assert found is not None, said
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=require_tool("chromium"), args=["--no-sandbox"])
            opened = browser.new_page(viewport={"width": 1366, "height": 768})
            opened.set_default_timeout(HANG_MS)
            expect.set_options(timeout=HANG_MS)
            opened.goto(found[1])
            yield opened
            browser.close()
    finally:
        process.terminate()
        process.wait(30)
        process.stdout.close()


def press(page: Page, *, until_touched: int, with_key: bool) -> None:
    """Take the present landmark as a person does: again, where the tip was lost for a moment just then."""
    take = page.get_by_role("button", name="Take this place")
    done = page.locator("#touch-list li[data-status='touched']")
    for _ in range(30):
        expect(take).to_be_enabled()
        page.keyboard.press("Space") if with_key else take.click()
        try:
            expect(done).to_have_count(until_touched, timeout=4000.0)
            return
        except AssertionError:
            continue
    raise AssertionError(f"the landmark was never taken: {page.locator('#why').text_content()}")


def test_a_person_touches_finishes_and_saves(page: Page, tmp_path: Path) -> None:
    faults: list[str] = []
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    expect(page.locator("#task")).to_have_text("Registration by touch: simulation")
    expect(page.locator(".heart-view img")).to_have_count(2)
    count = page.locator("#touch-list li").count()
    for touched in range(count):
        expect(page.locator(".spots i[data-look='now']").first).to_be_visible()
        press(page, until_touched=touched + 1, with_key=touched == 0)
    expect(page.locator("#figures")).to_contain_text("Held-out error")
    page.get_by_role("button", name="Finish").click()
    picture = page.locator("#touch-results img")
    expect(picture).to_be_visible()
    page.wait_for_function("document.querySelector('#touch-results img').naturalWidth > 600")
    page.get_by_role("button", name=re.compile("^Save")).click()
    expect(page.locator("#ended-title")).to_have_text("Saved")
    assert len(read_registration(tmp_path / "registration.toml").landmarks) == count
    assert faults == []
