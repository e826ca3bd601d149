"""What a headset's picture costs: draw calls and triangles of both eyes, in everything that can be shown."""

from collections.abc import Callable

import pytest

from cathxr.wire.hub import Hub

from ..flat.played import Played
from ..training.trainer import Phase, Trainer, run_path
from .headset import Headset

MOST_CALLS = 60
MOST_TRIANGLES = 300_000
FULL = "?xr=emulate&aa=0&dpr=0.25&pictures=0&iceHz=5&guide=0"
"""The materials of a headset (two passes for what one sees through), few pixels."""


@pytest.fixture
def room(resting: Played, open_headset: Callable[..., Headset]) -> Headset:
    headset = open_headset(resting.url, query=FULL)
    headset.until("window.__cathxr.heartParts > 0")
    headset.enter("vr")
    headset.put("headset", headset.report()["head"], [-0.2, 0.0, 0.0, 0.98])  # all of the table's heart is in view
    for side, x in (("left", -0.2), ("right", 0.2)):
        headset.put(f"controller-{side}", [x, 1.2, -0.3])
    return headset


def show_training(room: Headset, phase: Phase) -> None:
    """Show the page a state of training, as if the server had sent it."""
    trainer = Trainer(Hub())
    trainer.show(phase, reached=3, progress=0.5)
    trainer.close()
    room.page.evaluate("(state) => window.__cathxr.training.show(state)", trainer.message().model_dump(mode="json"))


def test_everything_that_can_be_shown_at_once_keeps_within_the_budget(room: Headset) -> None:
    rows: list[tuple[str, int, int]] = []

    def count(name: str) -> None:
        room.frames(8)
        report = room.report()
        rows.append((name, report["calls"], report["triangles"]))

    count("3D, view from the tip")
    room.set(ice=True, depthMm=80)
    room.until("window.__cathxrFlat.ice().made > 3")
    count("3D, ultrasound")
    room.set(targets=True, landmarks=True, teaching=0.6)
    count("3D, ultrasound in colour, targets, landmarks")
    room.set(cut="beam")
    count("the same, cut by the beam")
    room.set(cut="off", heartOpacity=0.7)
    count("the same, not cut, a dense heart")
    room.set(heartOpacity=0.16, parts={"left_ventricle": {"visible": True, "opacity": 1.0}})
    count("the same, thin, but one part opaque")
    room.press("right", "b-button")
    count("the same, menu open")
    room.hands("hand")
    count("the same, bare hands")
    room.page.evaluate("(run) => window.__cathxr.training.showRun(run)", run_path().model_dump(mode="json"))
    count("the same, a run shown again")
    show_training(room, "running")
    count("the same, a trial running, a plane to find")
    show_training(room, "idle")
    room.ask("window.__cathxr.xr.guide()")
    count("the same, guide running")
    room.ask("window.__cathxr.xr.go('inside')")
    count("the same, inside")
    room.hands("controller")
    room.set(mode="2d")
    room.frames(20)
    count("2D, menu open, guide running")
    print("\n\n| scene, both eyes | draw calls | triangles |\n|---|---|---|")
    for name, calls, triangles in rows:
        print(f"| {name} | {calls} | {triangles / 1000:.0f} k |")
    assert max(calls for _, calls, _ in rows) <= MOST_CALLS, rows
    assert max(triangles for *_, triangles in rows) <= MOST_TRIANGLES, rows
