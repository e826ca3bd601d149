"""What a headset's wearer meets: the beam, a target, the menu's pages, the inside of a chamber, true scale."""

import json
import urllib.request
from collections.abc import Callable, Iterator
from itertools import combinations
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from scipy import ndimage
from websockets.sync.client import connect

from cathxr.core import FloatArray

from ..flat.played import Played
from .headset import Headset, rotation

OpenHeadset = Callable[..., Headset]
LEAST_CLEARANCE_MM = 5.0
"""Of the head from every wall, in the heart's own millimetres: web/src/xr/standpoint.ts."""
HEART_RADIUS_M = 0.075


def angle_deg(a: FloatArray, b: FloatArray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b))))


@pytest.fixture
def room(resting: Played, open_headset: OpenHeadset) -> Headset:
    headset = open_headset(resting.url)
    headset.until("window.__cathxr.heartParts > 0")
    headset.enter("vr")
    return headset


def test_the_beam_in_the_room_looks_where_the_track_says(turning: Played, open_headset: OpenHeadset) -> None:
    """Within 1 degree while the catheter rolls, in the room that both eyes see, with the world moved and enlarged."""
    headset = open_headset(turning.url)
    headset.enter("vr")
    headset.set(ice=True, depthMm=80)
    headset.until("window.__cathxrFlat.beam().visible")
    headset.ask("window.__cathxr.xr.go('inside')")
    headset.frames(10)
    asked = (
        "({ drawn: window.__cathxr.drawn(), beam: window.__cathxrFlat.beam(), "
        "from: window.__cathxr.xr.room(window.__cathxrFlat.beam().origin), "
        "to: window.__cathxr.xr.room(window.__cathxrFlat.beam().ball), "
        "axes: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].map((p) => window.__cathxr.xr.room(p)) })"
    )
    offs = []
    for _ in range(10):
        headset.frames(4)
        told = headset.ask(asked)
        headset.page.wait_for_timeout(200)  # until the Track after this instant has come to the witness, too
        origin, *ends = np.array(told["axes"])
        room_from_box = np.stack([(end - origin) / np.linalg.norm(end - origin) for end in ends], axis=1)
        drawn = np.array(told["to"]) - np.array(told["from"])
        offs.append(angle_deg(drawn, room_from_box @ turning.beam_at(told["drawn"]["t"])))
    assert max(offs) < 1.0, offs


def test_a_target_is_placed_at_the_tip_by_the_menu_and_reached(room: Headset) -> None:
    room.press("right", "b-button")
    room.tab("Targets")
    room.row("Targets")
    assert room.settings()["targets"] is True
    before = room.ask("window.__cathxr.scene().targets")
    room.row("Add")
    after = room.ask("window.__cathxr.scene().targets")
    assert len(after) == len(before) + 1
    tip = room.ask("window.__cathxr.drawn().tip")
    assert np.linalg.norm(np.array(after[-1]["positionMm"]) - tip) < 0.5
    room.until("window.__cathxr.scene().target?.reached")
    room.until("window.__cathxr.xr.report().hud.includes('reached')")
    room.row("In force", 1)
    assert room.ask("window.__cathxr.scene().target.name") != after[-1]["name"]
    room.row("In force", 0)
    assert room.ask("window.__cathxr.scene().target.name") == after[-1]["name"]
    room.row("Remove")
    assert room.ask("window.__cathxr.scene().targets") == before


def test_the_parts_of_the_heart_are_hidden_and_thinned_by_the_menu(room: Headset) -> None:
    shown = room.ask("window.__cathxr.xr.report().triangles")
    room.press("right", "b-button")
    room.tab("Parts")
    room.row("Left ventricle", 1)
    part = room.settings()["parts"]
    assert [each["visible"] for each in part.values()] == [False]
    room.row("Left ventricle", 0)
    (changed,) = room.settings()["parts"].values()
    assert changed["visible"] is True, "who drags how dense a part is wants to see it"
    assert 0.3 < changed["opacity"] < 0.7
    room.row("All parts", 1)
    assert all(not each["visible"] for each in room.settings()["parts"].values())
    room.press("right", "b-button")
    room.frames(4)
    assert room.ask("window.__cathxr.xr.report().triangles") < shown / 2


@pytest.fixture
def locking(resting: Played) -> Iterator[Callable[..., None]]:
    """A function that sends a training session's commands to the page's server."""
    with connect(f"ws://127.0.0.1:{resting.port}/ws?protocol=1", compression=None) as link:

        def ask(name: str, **args: object) -> None:
            link.send(json.dumps({"type": "command", "name": name, "args": args, "id": name}))

        yield ask
        ask("unlock_view")


def test_a_lock_leaves_one_picture_and_the_menu_says_why(room: Headset, locking: Callable[..., None]) -> None:
    locking("lock_view", values={"mode": "2d"}, sentence="This task is done with the flat pictures.")
    room.until("window.__cathxr.xr.settings().mode === '2d'")
    room.until("window.__cathxr.xr.plates().some((plate) => plate.title === '2D view')")
    assert "world" not in " ".join(room.ask("window.__cathxr.xr.drawables()")), "of the scene in space nothing is drawn"
    room.press("right", "b-button")
    room.tab("View")
    room.row("Picture", 0)
    assert room.settings()["mode"] == "2d"
    locking("lock_view", values={"mode": "3d"}, sentence="This task is done in space.")
    room.until("window.__cathxr.xr.settings().mode === '3d'")
    room.frames(10)
    room.row("Picture", 1)
    assert room.settings()["mode"] == "3d"
    assert all(plate["title"] != "2D view" for plate in room.ask("window.__cathxr.xr.plates()"))
    locking("unlock_view")
    room.page.wait_for_timeout(300)
    room.row("Picture", 1)
    assert room.settings()["mode"] == "2d"


def test_inside_is_within_the_tips_chamber_away_from_its_walls(room: Headset) -> None:
    scene, labels = _labels(room.url)
    room.until("window.__cathxr.scene().wall.state === 'ready'")
    room.ask("window.__cathxr.xr.go('inside')")
    room.frames(6)
    places = room.ask("[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].map((p) => window.__cathxr.xr.room(p))")
    origin, *ends = np.array(places)
    columns = np.stack(ends, axis=1) - origin[:, None]
    head_box = np.linalg.solve(columns, np.array(room.report()["head"]) - origin)
    tip_box = np.array(room.ask("window.__cathxr.drawn().tip"))
    blood = np.isin(labels, [each["value"] for each in scene["labels"]["values"] if each["is_blood"]])
    to_voxel = _voxel_from_box(scene)
    spacing = np.linalg.norm(np.array(scene["labels"]["ct_from_voxel"]).reshape(4, 4)[:3, :3], axis=0)
    clearance = ndimage.distance_transform_edt(blood, sampling=spacing)
    head, tip = (tuple(np.round(to_voxel @ [*place, 1.0])[:3].astype(int)) for place in (head_box, tip_box))
    assert blood[tip], "the recorded tip is in the blood"
    assert labels[head] == labels[tip]
    assert clearance[head] >= LEAST_CLEARANCE_MM - spacing.max() / 2
    assert np.isclose(room.report()["world"]["scale"], 24.0)


def test_true_scale_is_exact(room: Headset) -> None:
    """A millimetre in the box is a millimetre in the room: on the table, and when it was asked for after enlarging."""
    asked = "[[0, 0, 0], [120, 0, 0], [0, -60, 0], [0, 0, 60], [33, 7, -21]].map((p) => window.__cathxr.xr.room(p))"
    box = np.array([[0, 0, 0], [120, 0, 0], [0, -60, 0], [0, 0, 60], [33, 7, -21]], dtype=float)

    def off() -> float:
        found = 1000.0 * np.array(room.ask(asked))
        pairs = list(combinations(range(len(box)), 2))
        return max(abs(float(np.linalg.norm(found[a] - found[b]) - np.linalg.norm(box[a] - box[b]))) for a, b in pairs)

    assert off() < 1e-9
    room.ask("window.__cathxr.xr.go('inside')")
    room.frames(3)
    assert off() > 1000.0
    room.ask("window.__cathxr.xr.go('true')")
    room.until(
        "!window.__cathxr.xr.report().travelling && Math.abs(window.__cathxr.xr.report().world.scale - 1) < 1e-12"
    )
    room.frames(2)
    assert off() < 1e-9


@pytest.mark.parametrize("pitch_deg", [0.0, -15.0, -30.0])
def test_at_first_nothing_covers_anything(room: Headset, pitch_deg: float) -> None:
    """Heart, numbers, ultrasound picture and open menu, as angles seen from the head, for a head level or bent."""
    room.set(ice=True)
    half = np.deg2rad(pitch_deg) / 2
    room.put("headset", room.report()["head"], [np.sin(half), 0.0, 0.0, np.cos(half)])
    room.press("right", "b-button")
    room.until("window.__cathxr.xr.plates().length === 3")
    room.page.wait_for_timeout(1500)
    room.frames(15)
    head = np.array(room.report()["head"])
    world = room.world()
    centre = (world @ [*room.ask("window.__cathxr.xr.centre()"), 1.0])[:3] - head
    half_heart = np.arcsin(HEART_RADIUS_M / np.linalg.norm(centre))
    plates = {each["title"]: np.array(each["corners"]) - head for each in room.ask("window.__cathxr.xr.plates()")}
    assert set(plates) == {"numbers", "menu", "Ultrasound (ICE)"}
    for name, corners in plates.items():
        away = [angle_deg(point, centre) for point in _points(corners)]
        assert min(away) > np.degrees(half_heart), f"{name} covers the heart"
    for (name, a), (other, b) in combinations(plates.items(), 2):
        for one, another in ((a, b), (b, a)):
            assert not any(_behind(one, point) for point in _points(another)), f"{name} and {other} overlap"


def test_graphics_that_are_taken_away_are_said_and_come_back(room: Headset) -> None:
    room.page.evaluate(
        "() => { const graphics = document.getElementById('view').getContext('webgl2');"
        " window.taken = graphics.getExtension('WEBGL_lose_context'); window.taken.loseContext(); }"
    )
    room.until("window.__cathxr.xr.report().mode === null")
    room.until("document.getElementById('banner-title').textContent.includes('graphics card')")
    assert room.page.is_visible("#banner")
    assert room.ask("window.__cathxr.link") == "live"
    room.page.evaluate("() => window.taken.restoreContext()")
    room.until("document.getElementById('banner').hidden")
    drawn = room.ask("window.__cathxr.frames")
    room.until(f"window.__cathxr.frames > {drawn}")
    shot = np.frombuffer(room.page.locator("#view").screenshot(), np.uint8)
    seen = np.asarray(cv2.imdecode(shot, cv2.IMREAD_COLOR), dtype=np.int64)
    coloured = (np.abs(seen - np.median(seen, axis=(0, 1))).max(axis=2) > 25).mean()
    assert coloured > 0.01, "the heart is drawn again"
    room.enter("vr")
    assert room.report()["mode"] == "vr"


def _points(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return places all over a plate, (N, 3), from its corners, round from the lower left."""
    u, v = (each.ravel()[:, None] for each in np.meshgrid(np.linspace(0, 1, 21), np.linspace(0, 1, 21)))
    return np.asarray(corners[0] + u * (corners[1] - corners[0]) + v * (corners[3] - corners[0]))


def _behind(corners: npt.NDArray[np.float64], way: npt.NDArray[np.float64]) -> bool:
    """Return whether one who looks in a direction looks at a plate; both from the head."""
    columns = np.stack([way, corners[0] - corners[1], corners[0] - corners[3]], axis=1)
    t, u, v = np.linalg.solve(columns, corners[0])
    return bool(t > 0 and 0 <= u <= 1 and 0 <= v <= 1)


def _labels(url: str) -> tuple[dict[str, Any], npt.NDArray[np.uint8]]:
    """Return the scene's heart and its labels, indexed (i, j, k)."""
    with urllib.request.urlopen(f"{url}scene/scene.json") as answer:
        heart: dict[str, Any] = json.load(answer)["heart"]
    with urllib.request.urlopen(url.rstrip("/") + heart["labels"]["file"]) as answer:
        data = np.frombuffer(answer.read(), np.uint8)
    ni, nj, nk = heart["labels"]["size"]
    return heart, data.reshape(nk, nj, ni).transpose(2, 1, 0)


def _voxel_from_box(heart: dict[str, Any]) -> npt.NDArray[np.float64]:
    pose, scale = heart["registration"]["ct_from_box"], heart["registration"]["scale"]
    w, x, y, z = pose["rotation_wxyz"]
    ct_from_box = np.eye(4)
    ct_from_box[:3, :3] = scale * rotation([x, y, z, w])
    ct_from_box[:3, 3] = pose["translation_mm"]
    ct_from_voxel = np.array(heart["labels"]["ct_from_voxel"]).reshape(4, 4)
    return np.asarray(np.linalg.inv(ct_from_voxel) @ ct_from_box)
