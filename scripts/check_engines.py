"""Opens the page in the engines of Firefox and Safari, and says what works there.

    python scripts/check_engines.py --out /tmp/engines

Not part of the tests: needs Debian's packages firefox-esr, webkit2gtk-driver (which brings WebKitGTK and its
MiniBrowser) and xvfb; what is absent is left out. Starts `cathxr run` on the twin, unless --url names a running one.
Writes pictures of what was seen. Exits with 1 when something that must work does not. Results: docs/browsers.md.
"""

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np
from browser_engines import HANG_S, Engine, firefox, screen, started, webkit

CHEAP = "?aa=0&mat=lambert&dpr=1&pictures=5&iceHz=5"


@dataclass
class Report:
    """What was tried in an engine and what came of it."""

    engine: str
    lines: list[str] = field(default_factory=list)
    failed: int = 0

    def add(self, what: str, works: bool, seen: str = "") -> None:
        """Note one finding, and print it."""
        self.failed += not works
        self.lines.append(f"{'yes' if works else 'NO '}  {what}{f': {seen}' if seen else ''}")
        click.echo(f"  {self.lines[-1]}")


def until(engine: Engine, expression: str) -> Any:
    """Return the expression's value once it is true; None when it never is."""
    deadline = time.monotonic() + HANG_S
    while time.monotonic() < deadline:
        if value := engine.ask(expression):
            return value
        time.sleep(0.2)
    return None


def picture(engine: Engine, out: Path, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    """Write what is seen, and return it: (H, W, 3) BGR."""
    data = engine.screenshot()
    (out / f"{engine.name.split()[0].lower()}-{name}.png").write_bytes(data)
    return np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR), dtype=int)


def within(pixels: np.ndarray[Any, Any], box: dict[str, float]) -> np.ndarray[Any, Any]:
    """Return the part of a picture that an element fills."""
    return pixels[round(box["y"]) : round(box["bottom"]), round(box["x"]) : round(box["right"])]


def check(engine: Engine, url: str, out: Path) -> Report:
    """Open everything that the page has and look at it."""
    report = Report(engine.name)
    click.echo(engine.name)
    engine.open(url + CHEAP)
    graphics = engine.ask(
        "(() => { const gl = document.createElement('canvas').getContext('webgl2'); if (gl === null) return null;"
        " return [gl.getParameter(gl.VERSION), gl.getExtension('EXT_color_buffer_float') !== null]; })()"
    )
    report.add(
        "WebGL 2", graphics is not None, "" if graphics is None else f"{graphics[0]}, half floats: {graphics[1]}"
    )
    if graphics is None:
        return report
    report.add("the link is live", until(engine, "window.__cathxr?.link === 'live'") is not None)
    report.add("the catheter is tracked and drawn", until(engine, "window.__cathxr?.drawn()") is not None)
    parts = until(engine, "window.__cathxr?.heartParts")
    report.add("the heart is loaded", parts is not None, f"{parts} parts")
    panels = until(engine, "window.__cathxr.pictures().every(({ seq, overlaid }) => seq >= 0 && overlaid)")
    report.add("the cameras' pictures carry their curve", panels is not None)
    until(engine, "window.__cathxr.frames > 10")
    time.sleep(3.0)
    stage = engine.ask("document.querySelector('#view').getBoundingClientRect().toJSON()")
    seen = within(picture(engine, out, "3d"), stage)
    coloured = (np.ptp(seen, axis=2) > 30).mean()
    report.add("heart and catheter are seen", coloured > 0.03, f"{100 * coloured:.0f} % of the view is in colour")
    check_ultrasound(engine, out, report)
    check_flat(engine, out, report)
    reason = engine.ask("document.querySelector('#enter-vr').title")
    report.add("without WebXR the button says so", bool(reason), reason)
    errors = engine.ask("window.__cathxr.consoleErrors")
    report.add("no errors of the page's own", errors == 0, str(errors))
    check_diag(engine, url, out, report)
    own = [each for each in engine.complaints if "ReadPixels" not in each]
    for each in own:
        click.echo(f"      console: {each[:200]}")
    report.lines += [f"     console: {each[:200]}" for each in own]
    return report


def check_ultrasound(engine: Engine, out: Path, report: Report) -> None:
    """The ultrasound image in the beam and in the inset."""
    engine.ask("window.__cathxrFlat.set({ mode: '3d', ice: true, teaching: 0 })")
    made = until(engine, "window.__cathxrFlat.ice().message === '' && window.__cathxrFlat.ice().made > 3")
    image = engine.ask("window.__cathxrFlat.ice()")
    grey = np.array(image["grey"]).reshape(image["samples"], image["lines"])[40:]
    looks = f"median {np.median(grey):.0f}, brightest hundredth {np.percentile(grey, 99):.0f} of 255"
    report.add("ultrasound image", made is not None and np.percentile(grey, 99) > 150 > np.median(grey), looks)
    time.sleep(1.0)
    picture(engine, out, "ice")


def check_flat(engine: Engine, out: Path, report: Report) -> None:
    """Two X-ray pictures beside the ultrasound image."""
    engine.ask("window.__cathxrFlat.set({ mode: '2d', biplane: 'oblique' })")
    time.sleep(6.0)
    boxes = engine.ask(
        "[...document.querySelectorAll('.flat .hole')].map((each) => each.getBoundingClientRect().toJSON())"
    )
    shown = picture(engine, out, "2d")
    spreads = [float(within(shown, box).mean(axis=2).std()) for box in boxes]
    report.add(
        "2D view", len(spreads) == 3 and min(spreads) > 12.0, "contrast " + ", ".join(f"{x:.0f}" for x in spreads)
    )
    engine.ask("window.__cathxrFlat.set({ mode: '3d' })")


def check_diag(engine: Engine, url: str, out: Path, report: Report) -> None:
    """The page that measures the device."""
    engine.open(url + "diag")
    verdict = until(
        engine, "document.querySelector('#save')?.disabled === false && document.querySelector('#verdict').textContent"
    )
    report.add("/diag measures", verdict is not None, str(verdict))
    picture(engine, out, "diag")


@contextmanager
def served(url: str | None) -> Iterator[str]:
    """Give the address of a page: of the one that is named, or of one that is started."""
    if url is not None:
        yield url.rstrip("/") + "/"
        return
    command = [sys.executable, "-m", "cathxr", "run", "--source", "twin", "--port", "0", "--no-browser"]
    with started(command, r"(http://127\.0\.0\.1:\d+)", os.environ) as address:
        yield f"{address}/"


ENGINES: dict[str, Callable[[Mapping[str, str]], AbstractContextManager[Engine | None]]] = {
    "firefox": firefox,
    "webkit": webkit,
}


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder for the pictures.")
@click.option("--url", help="Of a page that is served already, such as http://127.0.0.1:8765.")
@click.option(
    "--engine", "names", type=click.Choice(list(ENGINES)), multiple=True, help="Only this one; may be repeated."
)
def main(out: Path, url: str | None, names: tuple[str, ...]) -> None:
    """Open the page in other engines than Chromium's, and say what works there."""
    out.mkdir(parents=True, exist_ok=True)
    reports = []
    with served(url) as address, screen() as environment:
        for name in names or ENGINES:
            with ENGINES[name](environment) as engine:
                if engine is None:
                    click.echo(f"{name}: is not installed here")
                else:
                    reports.append(check(engine, address, out))
    if not reports:
        raise click.ClickException("there is no other engine here: apt-get install firefox-esr webkit2gtk-driver xvfb")
    sys.exit(any(report.failed for report in reports))


if __name__ == "__main__":
    main()
