"""Fiducials found, placed and taken away by a person: the logic alone, with made-up sightings."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cathxr.calibration.poses import PosesResult
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import CathxrError, DataError, Rig
from cathxr.geometry import CameraModel
from cathxr.runtime import calibration_markers
from cathxr.runtime.calibration_markers import MarkersSession
from cathxr.runtime.calibration_task import Ending
from cathxr.storage.rig_file import example_rig
from cathxr.twin import true_rig

NOMINAL = example_rig()
TRUE = true_rig(NOMINAL, 4)
NAMES = [marker.name for group in NOMINAL.markers.values() for marker in group]
PIXELS = np.zeros((720, 1280, 3), np.uint8)
SIGMA_PX = 0.05
FAR = np.array([17.0, 23.0])


def places(camera: str) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
    """Return where a true camera sees each fiducial."""
    model = CameraModel.of(TRUE.cameras[camera])
    markers = [marker for group in NOMINAL.markers.values() for marker in group]
    return {each.name: model.project(each.position_mm) for each in markers}


def sighting(camera: str, missing: tuple[str, ...] = ()) -> Sighting:
    found = [
        FoundMarker(name, "red", place, SIGMA_PX, 9.0) for name, place in places(camera).items() if name not in missing
    ]
    problem = f"{missing[0]} was not found." if missing else None
    return Sighting(camera, NOMINAL.cameras[camera].size_px, tuple(found), missing=missing, problem=problem)


class Bench:
    """A session whose pictures show what `found` says; a click within 10 px of a fiducial snaps to it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **found: Sighting) -> None:
        self.found = {"top": sighting("top"), "front": sighting("front")} | found
        monkeypatch.setattr(calibration_markers, "find_markers", lambda rig, camera, pixels: self.found[camera])
        monkeypatch.setattr(calibration_markers, "sighting_from_points", self.snap)
        # Drawing takes a second each time, and is tested where it is made.
        for name in ("error_map_png", "residuals_png"):
            monkeypatch.setattr(calibration_markers, name, lambda result: b"PNG")
        self.pictures: dict[str, bytes] = {}
        self.saved: PosesResult | None = None
        self.refusal: str | None = None
        self.session = MarkersSession(
            NOMINAL,
            {"top": [PIXELS], "front": [PIXELS]},
            date="2026-01-31",
            judge=lambda result, summary: "It is what it is.",
            keep=self.keep,
            save=self.save,
        )

    def snap(self, rig: Rig, camera: str, pixels: Any, points: Mapping[str, Any]) -> Sighting:
        markers = []
        for name, point in points.items():
            near = places(camera)[name]
            sure = float(np.linalg.norm(near - point)) < 10.0
            markers.append(
                FoundMarker(name, "red", near if sure else point, SIGMA_PX if sure else 1.0, 9.0 * sure, placed=True)
            )
        return Sighting(camera, NOMINAL.cameras[camera].size_px, tuple(markers))

    def keep(self, name: str, png: bytes) -> str:
        self.pictures[name] = png
        return f"/calibration/{name}.png"

    def save(self, result: PosesResult, sightings: Mapping[str, Sighting]) -> Ending:
        if self.refusal is not None:
            raise DataError(self.refusal)
        self.saved = result
        return Ending("Saved.", True)

    def ask(self, name: str, **args: Any) -> Mapping[str, Any]:
        return self.session.handle(f"calibration_{name}", args)

    def work(self) -> int:
        """Do everything that is to be worked out; return how many jobs it was."""
        count = 0
        while (job := self.session.take_job()) is not None:
            count += 1
            try:
                value = job.work()
            except CathxrError as error:
                job.failed(str(error))
            else:
                job.done(value)
        return count

    def marker(self, camera: str, name: str) -> Any:
        return next(each for each in self.session.state().markers if (each.camera, each.name) == (camera, name))


def test_what_is_found_is_solved_at_once_and_can_be_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    assert bench.session.state().stage == "solving"
    assert bench.session.state().markers == []
    assert bench.work() == 3  # finding, solving, drawing
    state = bench.session.state()
    assert (state.stage, state.can_save, state.advice) == ("done", True, "It is what it is.")
    assert len(state.markers) == 16
    assert {each.origin for each in state.markers} == {"found"}
    assert all(each.residual_px is not None and each.residual_px < 1e-3 for each in state.markers)
    assert [each.path for each in state.pictures] == [
        "/calibration/expected_error.png",
        "/calibration/markers_residuals.png",
    ]
    assert bench.ask("accept")["saved"]
    assert bench.saved is not None
    found = bench.saved.rig.cameras["top"].camera_from_box
    # Exact pixels: what is left is the solver's tolerance.
    assert np.allclose(found.translation_mm, TRUE.cameras["top"].camera_from_box.translation_mm, atol=1e-3)
    assert bench.saved.rig.cameras["top"].pose_provenance.date == "2026-01-31"


def test_missing_fiducials_are_placed_until_they_suffice(monkeypatch: pytest.MonkeyPatch) -> None:
    others = tuple(name for name in NAMES if name not in ("mT1", "mT2", "mT3"))
    bench = Bench(monkeypatch, top=sighting("top", missing=others))
    bench.work()
    state = bench.session.state()
    assert (state.stage, state.can_save, state.advice) == ("collecting", False, "mT4 was not found.")
    assert bench.marker("top", "mT4").model_dump() == {
        "camera": "top",
        "name": "mT4",
        "colour": "yellow",
        "pixel": None,
        "origin": "missing",
        "residual": None,
        "residual_px": None,
    }
    with pytest.raises(CathxrError, match=r"nothing to accept yet\. mT4 was not found"):
        bench.ask("accept")
    place = places("top")["mT4"]
    answer = bench.ask("place", camera="top", marker="mT4", pixel=(place + 4.0).tolist())
    assert answer["pixel"] == pytest.approx(place.round(2).tolist())  # it snapped
    assert bench.session.state().stage == "solving"
    with pytest.raises(CathxrError, match="in a moment"):
        bench.ask("accept")
    bench.work()
    assert bench.session.state().can_save
    assert bench.marker("top", "mT4").origin == "placed"


def test_an_exact_place_does_not_snap(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.work()
    wanted = (places("top")["mT4"] + 3.0).round(2).tolist()
    assert bench.ask("place", camera="top", marker="mT4", pixel=wanted, exact=True)["pixel"] == wanted
    bench.work()
    residual = bench.marker("top", "mT4").residual
    assert residual is not None
    assert min(residual) > 1.0  # the other seven hold the pose where it is


def test_the_clearest_of_several_pictures_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.work()
    sharp, snap = np.ones_like(PIXELS), bench.snap

    def by_picture(rig: Rig, camera: str, pixels: Any, points: Mapping[str, Any]) -> Sighting:
        seen = snap(rig, camera, pixels, points)
        shift, sigma = (0.0, 0.02) if pixels is sharp else (2.0, 0.3)
        markers = tuple(replace(each, centre_px=each.centre_px + shift, sigma_px=sigma) for each in seen.markers)
        return replace(seen, markers=markers)

    monkeypatch.setattr(calibration_markers, "sighting_from_points", by_picture)
    bench.session._views["top"].pictures = [PIXELS, sharp]
    place = places("top")["mT1"]
    assert bench.ask("place", camera="top", marker="mT1", pixel=place.tolist())["pixel"] == place.round(2).tolist()


def test_a_found_fiducial_is_taken_away_and_brought_back(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.work()
    bench.ask("unplace", camera="front", marker="mF2")
    bench.work()
    assert bench.marker("front", "mF2").origin == "missing"
    assert bench.session.state().can_save  # seven are enough
    bench.ask("unplace", camera="front", marker="mF2")
    bench.work()
    assert bench.marker("front", "mF2").origin == "found"


def test_a_placed_fiducial_is_taken_away(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, top=sighting("top", missing=("mF1",)))
    bench.work()
    with pytest.raises(CathxrError, match="There is no mF1 in the top picture"):
        bench.ask("unplace", camera="top", marker="mF1")
    bench.ask("place", camera="top", marker="mF1", pixel=places("top")["mF1"].tolist())
    bench.ask("unplace", camera="top", marker="mF1")
    assert bench.marker("top", "mF1").origin == "missing"


def test_a_wrong_place_shows_in_the_residuals_or_the_advice(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.work()
    bench.ask("place", camera="top", marker="mT1", pixel=FAR.tolist())
    bench.work()
    state = bench.session.state()
    assert bench.marker("top", "mT1").pixel == (17.0, 23.0)
    told = [each.value for each in state.figures if each.level == "warn"] + [state.advice]
    assert any("mT1" in each for each in told)


def test_only_what_was_asked_for_last_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.work()
    bench.ask("place", camera="top", marker="mT1", pixel=FAR.tolist())
    first = bench.session.take_job()
    assert first is not None
    value = first.work()
    bench.ask("unplace", camera="top", marker="mT1")
    first.done(value)
    assert bench.session.state().stage == "solving"
    bench.work()
    assert bench.marker("top", "mT1").origin == "found"


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        ({"camera": "left", "marker": "mT1", "pixel": [1.0, 2.0]}, "no picture of a camera 'left'"),
        ({"camera": "top", "marker": "mX", "pixel": [1.0, 2.0]}, "no fiducial 'mX': it has mT1"),
        ({"camera": "top", "marker": "mT1", "pixel": [1.0]}, "pixel must be two numbers"),
        ({"camera": "top", "marker": "mT1", "pixel": [True, 2]}, "pixel must be two numbers"),
        ({"camera": "top", "marker": "mT1", "pixel": "here"}, "pixel must be two numbers"),
        ({"camera": "top", "marker": "mT1", "pixel": [1280.0, 2.0]}, "not in a picture of 1280 x 720"),
        ({"camera": "top", "marker": "mT1"}, "takes camera, marker, pixel"),
        ({"camera": 3, "marker": "mT1", "pixel": [1.0, 2.0]}, "camera must be a text"),
    ],
)
def test_refusals_are_sentences(monkeypatch: pytest.MonkeyPatch, args: dict[str, Any], sentence: str) -> None:
    bench = Bench(monkeypatch)
    bench.work()
    with pytest.raises(CathxrError, match=sentence):
        bench.ask("place", **args)


def test_nothing_is_placed_before_the_pictures_were_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CathxrError, match="still being looked for"):
        Bench(monkeypatch).ask("place", camera="top", marker="mT1", pixel=[1.0, 2.0])


def test_what_cannot_be_saved_can_be_accepted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.work()
    bench.refusal = "rig.toml: cannot write it."
    with pytest.raises(DataError):
        bench.ask("accept")
    bench.refusal = None
    assert bench.ask("accept")["saved"]


def test_cancelling_saves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.work()
    assert bench.ask("cancel")["saved"] is False
    assert bench.saved is None
    assert not bench.session.state().can_save
