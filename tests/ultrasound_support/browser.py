"""The harness page of the ultrasound image in a headless browser: web/tests/harness/ice.html."""

import base64
import functools
import http.server
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from playwright.sync_api import Page

from cathxr.core import FloatArray
from cathxr.ultrasound import AcousticField, IceSettings

from ..e2e.chromium import drawing_chromium

HANG_MS = 120_000.0
"""A limit on waiting, not a measurement."""
_NAMES = {
    "sector_rad": "sectorRad",
    "depth_mm": "depthMm",
    "frequency_mhz": "frequencyMHz",
    "gain_db": "gainDb",
    "tgc_slope_db_cm_mhz": "tgcSlopeDbCmMHz",
    "tgc_db": "tgcDb",
    "dynamic_range_db": "dynamicRangeDb",
    "myocardium_db": "myocardiumDb",
    "white_db": "whiteDb",
    "noise_db": "noiseDb",
    "ring_db": "ringDb",
    "incidence_power": "incidencePower",
    "apex_mm": "apexMm",
    "aperture_mm": "apertureMm",
    "slices": "slices",
}


def as_page_settings(settings: IceSettings) -> dict[str, Any]:
    """Return the settings by the names that the page uses."""
    return {_NAMES[name]: value for name, value in asdict(settings).items() if name in _NAMES}


class IcePage:
    """The page, and the folder that it is served from."""

    def __init__(self, page: Page, folder: Path) -> None:
        self.page = page
        self._folder = folder
        self._served = 0
        self.troubles: list[str] = []
        page.on("console", lambda told: self.troubles.append(told.text) if told.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: self.troubles.append(str(error)))

    def call(self, name: str, *arguments: Any) -> Any:
        """Return what a function of the page returns."""
        return self.page.evaluate("([name, given]) => window.ice[name](...given)", [name, list(arguments)])

    def _serve(self, content: bytes) -> str:
        """Return the name of a file of its own: what changes twice in a second looks unchanged to a browser's cache."""
        self._served += 1
        name = f"volume-{self._served}.bin"
        (self._folder / name).write_bytes(content)
        return name

    def give(self, field: AcousticField) -> None:
        """Put an acoustic volume on the graphics card."""
        size = field.rgba.shape[2::-1]
        self.call(
            "volume",
            self._serve(field.rgba.tobytes()),
            [int(each) for each in size],
            field.ct_from_voxel.ravel().tolist(),
        )

    def give_labels(self, labels: npt.NDArray[np.uint8], ct_from_voxel: FloatArray, colours: Mapping[int, str]) -> None:
        """Put labels on the graphics card, and colour by them."""
        (self._folder / "labels.bin").write_bytes(np.ascontiguousarray(labels).tobytes())
        size = [int(each) for each in labels.shape[::-1]]
        self.call(
            "labels", "labels.bin", size, ct_from_voxel.ravel().tolist(), [list(each) for each in colours.items()]
        )

    def grey(
        self, pose: FloatArray, settings: IceSettings, *, seq: int = 0, persistence: float = 0.0
    ) -> npt.NDArray[np.uint8]:
        """Return the polar picture's grey levels (lines, samples) that the graphics card makes."""
        self.call("settings", as_page_settings(settings))
        self.call("pose", pose.ravel().tolist())
        data = np.frombuffer(base64.b64decode(self.call("picture", seq, persistence)), np.uint8)
        return data.reshape(settings.samples, settings.lines).T


@contextmanager
def ice_page(folder: Path, chromium: Path) -> Iterator[IcePage]:
    """Give the harness page, built in `folder`, open in a browser with working graphics."""
    handler = functools.partial(_Silent, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with drawing_chromium(chromium) as browser:
            made = IcePage(browser.new_page(viewport={"width": 820, "height": 660}), folder)
            made.page.set_default_timeout(HANG_MS)
            made.page.goto(f"http://127.0.0.1:{server.server_port}/ice.html")
            made.page.wait_for_function("window.ice !== undefined")
            yield made
        server.shutdown()


class _Silent(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""
