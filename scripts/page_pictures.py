"""Takes the documents' pictures of the page: docs/images/page.png, flat_view.png and training-*.png.

    python scripts/page_pictures.py --out docs/images [--only page|training]

Starts `cathxr run` on the twin, steers the catheter into the right atrium with the page's own sliders, and looks at it
with Chromium at full quality; then starts it on a study, and does trials (training_pictures.py). Takes a minute or two
for the page and ten for training, without a graphics card.
"""

import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright
from training_pictures import study, take_all

LIMIT_BYTES = 400_000
HANG_S = 240.0
FLAGS = ["--no-sandbox", "--ignore-gpu-blocklist", "--use-gl=angle", "--use-angle=gl-egl"]
NO_GUIDE = (
    "localStorage.setItem('cathxr.guide', JSON.stringify("
    "{ page: { state: 'left', at: '' }, headset: { state: 'left', at: '' } }))"
)
STEER = (
    "([control, value]) => { const slider = document.querySelector(`#slider-${control}`); slider.value = value;"
    " slider.dispatchEvent(new Event('input', { bubbles: true })); }"
)
AMBER_BGR = (0x54, 0xB4, 0xFF)
GOOD = "window.__cathxr.status === 'tracked' && window.__cathxrFlat.ice().message === ''"
POSE = {"insertion_mm": 58, "roll_deg": 25, "anterior_deg": 12, "left_deg": -8}
COMMON: dict[str, Any] = {"ice": True, "hud": True, "frozen": False, "sectorDeg": 90, "depthMm": 90, "gainDb": 3}
PICTURES: dict[str, dict[str, Any]] = {
    "page": {"mode": "3d", "teaching": 0, "heartOpacity": 0.2},
    "flat_view": {"mode": "2d", "biplane": "oblique", "teaching": 0.3},
}


@contextmanager
def server(*options: str) -> Iterator[str]:
    """Give the address of a page of its own."""
    command = [sys.executable, "-m", "cathxr", "run", "--source", "twin", "--port", "0", "--no-browser", *options]
    with tempfile.TemporaryFile("w+", encoding="utf-8") as log:
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        try:
            deadline = time.monotonic() + HANG_S
            while True:
                log.seek(0)
                text = log.read()
                if match := re.search(r"http://127\.0\.0\.1:\d+", text):
                    break
                if process.poll() is not None or time.monotonic() > deadline:
                    raise click.ClickException(f"cathxr run has not started:\n{text[-2000:]}")
                time.sleep(0.2)
            yield match[0]
        finally:
            process.terminate()
            process.wait()


def until(page: Page, expression: str) -> None:
    """Wait until an expression is true."""
    deadline = time.monotonic() + HANG_S
    while not page.evaluate(f"() => Boolean({expression})"):
        if time.monotonic() > deadline:
            raise click.ClickException(f"never came true: {expression}")
        page.wait_for_timeout(100)


def take(page: Page, out: Path, name: str) -> None:
    """Take one picture of the page."""
    page.evaluate("(change) => window.__cathxrFlat.set(change)", COMMON | PICTURES[name])
    made = page.evaluate("() => window.__cathxrFlat.ice().made")
    until(page, f"window.__cathxrFlat.ice().message === '' && window.__cathxrFlat.ice().made > {made + 6}")
    page.wait_for_timeout(8000)
    while True:  # on a busy machine the catheter, or its roll, may be lost for a moment: words in amber say so
        until(page, GOOD)
        data = page.screenshot(timeout=HANG_S * 1000)
        pixels = np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR))
        if np.all(np.abs(pixels.astype(int) - AMBER_BGR) < 12, axis=2).sum() < 100:
            break
    write(pixels, out / f"{name}.png")


def write(pixels: np.ndarray, path: Path) -> None:
    """Write one picture (H, W, 3) BGR, in fewer shades when it would be too large."""
    for step in (1, 2, 4, 8, 16):
        coarse = (pixels // step * step).astype(np.uint8)
        written = cv2.imencode(".png", coarse, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes()
        if len(written) < LIMIT_BYTES:
            break
    path.write_bytes(written)
    click.echo(f"{path.name}: {len(written) // 1000} kB, shades in steps of {step}")


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False, exists=True), required=True)
@click.option("--chromium", default="/usr/bin/chromium", show_default=True)
@click.option("--url", help="Of a twin's page that is served already; then no pictures of training are taken.")
@click.option("--only", type=click.Choice(["page", "training"]), help="Take these only.")
def main(out: Path, chromium: str, url: str | None, only: str | None) -> None:
    """Take the documents' pictures of the page and of training."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        if only != "training":
            page_pictures(browser, out, url)
        if only != "page" and url is None:
            with tempfile.TemporaryDirectory() as folder, study(Path(folder)) as options, server(*options) as address:
                take_all(browser, address, until, lambda pixels, name: write(pixels, out / f"{name}.png"))
        browser.close()


def page_pictures(browser: Browser, out: Path, url: str | None) -> None:
    """Take the pictures of the page itself."""
    with server() if url is None else nullcontext(url) as address:
        page = browser.new_page(viewport={"width": 1360, "height": 800})
        page.add_init_script(NO_GUIDE)
        page.goto(f"{address}/?aa=1&dpr=1&pictures=2&iceHz=5")
        until(page, "window.__cathxr?.drawn() && window.__cathxr.heartParts > 0 && window.__cathxr.role === 'operator'")
        until(page, "document.querySelector('#slider-insertion_mm')")
        for control, value in POSE.items():
            page.evaluate(STEER, [control, value])
        for name in PICTURES:
            take(page, out, name)
        page.close()


if __name__ == "__main__":
    main()
