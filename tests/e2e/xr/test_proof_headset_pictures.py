"""Pictures of what a headset's wearer sees, by one eye, for the documentation: docs/images/xr_*.png."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from ..flat.played import Played
from .headset import Headset

FINE = "?xr=emulate&aa=1&dpr=1&pictures=0&iceHz=5&guide=0"
SIZE = (1800, 780)
MOST_BYTES = 300_000


def look_down(degrees: float, left: float = 0.0) -> list[float]:
    """The turn (x, y, z, w) of a head that looks down and to the left, degrees."""
    p, y = np.deg2rad(-degrees) / 2, np.deg2rad(left) / 2
    return [np.cos(y) * np.sin(p), np.sin(y) * np.cos(p), -np.sin(y) * np.sin(p), np.cos(y) * np.cos(p)]


def take(headset: Headset, path: Path) -> None:
    """Write what the left eye sees."""
    headset.frames(8)
    shot = headset.page.screenshot()
    both = np.asarray(cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_COLOR))
    eye = both[:, : both.shape[1] // 2]
    cv2.imwrite(str(path), eye, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    if path.stat().st_size > MOST_BYTES:
        cv2.imwrite(str(path), cv2.resize(eye, None, fx=0.7, fy=0.7, interpolation=cv2.INTER_AREA))
    assert path.stat().st_size < MOST_BYTES


@pytest.mark.proof
def test_pictures_for_the_documentation(resting: Played, open_headset: Callable[..., Headset], repo_root: Path) -> None:
    images = repo_root / "docs" / "images"
    headset = open_headset(resting.url, query=FINE, size=SIZE)
    headset.until("window.__cathxr.heartParts > 0")
    eyes = [0.0, 1.45, -0.12]
    headset.enter("vr")
    for side, x in (("left", -0.2), ("right", 0.2)):
        headset.put(f"controller-{side}", [x, 1.12, -0.38])
    headset.set(ice=True, targets=True)
    headset.until("window.__cathxrFlat.ice().made > 3")
    headset.put("headset", eyes, look_down(16.0, 6.0))
    take(headset, images / "xr_ice.png")
    headset.press("right", "b-button")
    headset.tab("Parts")
    headset.put("headset", eyes, look_down(12.0, -22.0))
    headset.aim("controller-right", [0.28, 1.15, -0.2], headset.until("window.__cathxr.xr.row('Right atrium', 0)"))
    headset.page.wait_for_timeout(1500)
    take(headset, images / "xr_menu.png")
    headset.tab("View")
    headset.hands("hand")
    headset.aim("hand-right", [0.26, 1.22, -0.3], headset.until("window.__cathxr.xr.row('Numbers')"))
    headset.pinch("right", down=True)
    take(headset, images / "xr_hands.png")
    headset.pinch("right", down=False)
    headset.set(hud=True)
    headset.hands("controller")
    headset.press("right", "b-button")
    headset.put("headset", eyes, look_down(0.0))
    headset.until("window.__cathxr.scene().wall.state === 'ready'")
    headset.set(ice=False)
    headset.ask("window.__cathxr.xr.go('inside')")
    headset.page.wait_for_timeout(1500)
    take(headset, images / "xr_inside.png")
    headset.ask("window.__cathxr.xr.go('table')")
    headset.set(mode="2d", ice=True, biplane="oblique")
    headset.page.wait_for_timeout(3000)
    headset.frames(20)
    take(headset, images / "xr_2d.png")
    headset.set(mode="3d")
    headset.leave()
    headset.enter("ar")
    headset.hands("hand")
    headset.put("hand-left", [-0.16, 1.15, -0.42])
    headset.put("hand-right", [0.16, 1.15, -0.42])
    headset.put("headset", eyes, look_down(22.0))
    headset.page.wait_for_timeout(1500)
    take(headset, images / "xr_ar.png")
