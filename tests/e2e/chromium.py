"""A headless Chromium that draws: what every test of a page uses."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

QUIET = (
    "--no-sandbox",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
)
"""Nothing leaves this machine, and no list of bad graphics cards is minded."""
GRAPHICS = (("--use-gl=angle", "--use-angle=gl-egl"), ("--use-gl=angle", "--use-angle=swiftshader"))
"""Ways of drawing without a graphics card, the faster one first."""
DRAWABLE = "() => !!document.createElement('canvas').getContext('webgl2')?.getExtension('EXT_color_buffer_float')"


@contextmanager
def drawing_chromium(path: Path) -> Iterator[Browser]:
    """Give a browser that draws WebGL 2 into half-float pictures; it is closed afterwards.

    Not two of these at once in one thread: Playwright's own rule. Another one with other switches comes from
    `browser.browser_type.launch(executable_path=…)`.

    Raises:
        AssertionError: This Chromium draws in neither of the two ways.
    """
    with sync_playwright() as playwright:
        for graphics in GRAPHICS:
            browser = playwright.chromium.launch(executable_path=path, args=[*QUIET, *graphics])
            page = browser.new_page()
            draws = page.evaluate(DRAWABLE)
            page.close()
            if draws:
                break
            browser.close()
        else:
            raise AssertionError("this Chromium draws no WebGL 2 with half floats, neither with EGL nor SwiftShader")
        yield browser
        browser.close()
