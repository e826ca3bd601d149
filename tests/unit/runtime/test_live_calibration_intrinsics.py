"""Which views of a board are kept, what is advised, and what the commands do: the logic alone, with made-up corners."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from cathxr.calibration.board import parse_board
from cathxr.calibration.board_views import BoardView, RejectedView
from cathxr.calibration.coverage import CoverageMap
from cathxr.core import CathxrError, DataError, FloatArray, Health, Image, Pose
from cathxr.geometry import CameraModel
from cathxr.geometry.pose import quaternion_from_rotation_vector
from cathxr.runtime.calibration_intrinsics import MOST_VIEWS, IntrinsicsSession, Solution
from cathxr.runtime.calibration_task import Ending
from cathxr.storage.rig_file import example_rig

BOARD = parse_board("charuco:10x10:6.0:4.0:DICT_4X4_50")
CAMERA = example_rig().cameras["top"]
PERIOD_NS = 100_000_000
NOISE_PX = 0.05
PIXELS = np.zeros((720, 1280), np.uint8)


@dataclass(frozen=True)
class Place:
    """Where a board is held: mm from the optical axis, mm away, and its tilts in degrees."""

    x: float = 0.0
    y: float = 0.0
    z: float = 200.0
    about_x: float = 0.0
    about_y: float = 0.0


def seen(place: Place, rng: np.random.Generator) -> BoardView:
    """Return the board's corners as a camera sees them there, those within the picture, with noise."""
    turn = quaternion_from_rotation_vector(np.deg2rad([place.about_x, place.about_y, 0.0]))
    middle = Pose(turn, np.zeros(3)).apply(BOARD.corners_mm.mean(axis=0))
    pose = Pose(turn, np.array([place.x, place.y, place.z]) - middle)
    model = CameraModel(CAMERA.intrinsics, pose, CAMERA.size_px)
    corners: FloatArray = model.project(BOARD.corners_mm) + rng.normal(0.0, NOISE_PX, (BOARD.corner_count, 2))
    inside = ((corners > 0) & (corners < np.array(CAMERA.size_px) - 1)).all(axis=1)
    return BoardView("found", CAMERA.size_px, np.flatnonzero(inside), corners[inside], 1.0, 30.0)


GOOD = [
    Place(x, y, z, about_x, about_y)
    for x, y, z, about_x, about_y in (
        (0, 0, 120, 0, 0), (-60, -28, 190, 25, 0), (60, -28, 190, -25, 0), (-60, 28, 190, 0, 25), (60, 28, 190, 0, -25),
        (0, -25, 170, 30, 0), (0, 25, 170, -30, 0), (-50, 0, 170, 0, 30), (50, 0, 170, 0, -30), (20, 0, 130, 20, 20),
    )
]  # fmt: skip


class Bench:
    """A session fed by hand."""

    def __init__(self) -> None:
        self.rng = np.random.default_rng(5)
        self.t_ns, self.seq = 0, -1
        self.kept_pictures: dict[str, bytes] = {}
        self.saved: Solution | None = None
        self.refusal: str | None = None
        self.session = IntrinsicsSession(
            BOARD, camera="top", size_px=CAMERA.size_px, date="2026-01-31", keep=self.keep, save=self.save
        )

    def keep(self, name: str, png: bytes) -> str:
        self.kept_pictures[name] = png
        return f"/calibration/{name}.png"

    def save(self, solution: Solution) -> Ending:
        if self.refusal is not None:
            raise DataError(self.refusal)
        self.saved = solution
        return Ending("Saved.", True)

    def ask(self, name: str, **args: Any) -> Mapping[str, Any]:
        return self.session.handle(f"calibration_{name}", args)

    def show(self, found: BoardView | RejectedView | Place | None, *, pixels: Any = PIXELS) -> Any:
        """Give one picture, and return the state."""
        self.t_ns += PERIOD_NS
        self.seq += 1
        if isinstance(found, Place):
            found = seen(found, self.rng)
        self.session.look(Image("top", self.seq, self.t_ns, pixels), found)
        return self.session.state()

    def rest(self, place: Place, *, pictures: int = 6) -> Any:
        return [self.show(place) for _ in range(pictures)][-1]

    def work(self) -> None:
        job = self.session.take_job()
        assert job is not None
        try:
            value = job.work()
        except CathxrError as error:
            job.failed(str(error))
        else:
            job.done(value)

    def collect(self) -> None:
        for place in GOOD:
            self.rest(place)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_a_view_is_kept_by_itself_once_it_is_new_and_has_rested(bench: Bench) -> None:
    states = [bench.show(Place()) for _ in range(5)]
    # The board rests from the first picture on; the fourth is the first that is 0.3 s after it.
    assert [state.kept for state in states] == [0, 0, 0, 1, 1]
    assert [state.is_still for state in states] == [False, False, False, True, True]
    assert states[0].is_new
    assert "Hold the board still" in states[0].advice
    assert not states[4].is_new
    assert states[4].views[0].model_dump() == {"name": "top_01", "kept": True, "reason": ""}
    assert states[4].corners_seq == 4
    assert len(states[4].corners_px) == BOARD.corner_count
    assert sum(states[4].coverage.counts) > 0


def test_a_board_that_moves_or_trembles_is_not_kept(bench: Bench) -> None:
    for i in range(12):
        state = bench.show(Place(x=2.0 * i))  # 13 px each picture
    assert (state.kept, state.is_still) == (0, False)


def test_a_view_like_one_before_is_not_kept_again(bench: Bench) -> None:
    bench.rest(Place())
    assert bench.rest(Place(x=0.5)).kept == 1
    assert bench.rest(Place(x=55.0, y=-25.0, z=180.0, about_y=30.0)).kept == 2


def test_a_picture_without_board_says_why_and_breaks_the_rest(bench: Bench) -> None:
    for _ in range(3):
        bench.show(Place())
    state = bench.show(RejectedView("x", "no board is seen; bring it into the picture."))
    assert state.advice == "Not usable: no board is seen; bring it into the picture."
    assert state.corners_px == []
    assert bench.show(Place()).kept == 0


def test_a_person_captures_without_waiting(bench: Bench) -> None:
    with pytest.raises(CathxrError, match="no picture to keep yet"):
        bench.ask("capture")
    bench.show(Place())
    assert bench.ask("capture") == {"view": "top_01"}
    assert bench.session.kept[0].pixels is PIXELS
    bench.show(RejectedView("x", "blurred."))
    with pytest.raises(CathxrError, match="cannot be used: blurred"):
        bench.ask("capture")


def test_a_discarded_view_can_be_taken_again_under_another_name(bench: Bench) -> None:
    bench.rest(Place())
    bench.ask("discard", view="top_01")
    state = bench.session.state()
    assert (state.kept, sum(state.coverage.counts), state.views) == (0, 0, [])
    assert bench.rest(Place()).views[0].name == "top_02"
    with pytest.raises(CathxrError, match="There is no view 'top_01'"):
        bench.ask("discard", view="top_01")


def test_finishing_solves_and_accepting_saves(bench: Bench) -> None:
    with pytest.raises(CathxrError, match="No view is kept yet"):
        bench.ask("finish")
    bench.collect()
    bench.ask("finish")
    assert bench.session.state().stage == "solving"
    assert bench.session.examine(Image("top", 0, 0, PIXELS)) is None
    bench.work()
    state = bench.session.state()
    assert state.stage == "done"
    assert [each.path for each in state.pictures] == [
        "/calibration/intrinsics_top_coverage.png",
        "/calibration/intrinsics_top_residuals.png",
    ]
    assert all(png.startswith(b"\x89PNG") for png in bench.kept_pictures.values())
    assert any(each.label.startswith("Focal") and "±" in each.value for each in state.figures)
    assert bench.ask("accept")["saved"]
    assert bench.saved is not None
    found = bench.saved.result.intrinsics
    # The reported standard deviations are honest (proved elsewhere): five of them are not exceeded by chance.
    error = np.abs(found.focal_px - CAMERA.intrinsics.focal_px)
    assert (error < 5.0 * found.provenance.std["focal_px"]).all()
    assert found.provenance.date == "2026-01-31"
    assert list(bench.saved.views) == [each.name for each in state.views]
    assert all(png.startswith(b"\x89PNG") for png in bench.saved.views.values())


def test_too_few_views_fail_with_a_sentence_and_nothing_is_lost(bench: Bench) -> None:
    bench.rest(Place())
    bench.ask("finish")
    bench.work()
    state = bench.session.state()
    assert (state.stage, state.kept) == ("failed", 1)
    assert "Too few views" in state.advice
    with pytest.raises(CathxrError, match="no result to accept"):
        bench.ask("accept")
    with pytest.raises(CathxrError, match="collect more views first"):
        bench.ask("capture")
    bench.ask("continue")
    assert bench.session.state().stage == "collecting"
    assert bench.rest(GOOD[3]).kept == 2


def test_a_view_that_is_an_outlier_is_named_and_no_longer_kept(bench: Bench) -> None:
    bench.collect()
    kept = len(bench.session.kept)
    bent = seen(Place(10.0, 5.0, 160.0, 15.0, -15.0), bench.rng)
    bowed = bent.corners_px + np.stack([np.zeros(len(bent.ids)), 4.0 * np.sin(bent.corners_px[:, 0] / 60.0)], axis=1)
    bench.show(BoardView("bent", bent.size_px, bent.ids, bowed, 1.0, 30.0))
    bench.ask("capture")
    bench.ask("finish")
    bench.work()
    state = bench.session.state()
    assert state.kept == kept
    rejected = [each for each in state.views if not each.kept]
    assert len(rejected) == 1
    assert "outlier" in rejected[0].reason


def test_discarding_after_a_result_goes_back_to_collecting(bench: Bench) -> None:
    bench.collect()
    bench.ask("finish")
    with pytest.raises(CathxrError, match="being worked out"):
        bench.ask("discard", view="top_01")
    bench.work()
    bench.ask("discard", view="top_01")
    state = bench.session.state()
    assert (state.stage, state.pictures) == ("collecting", [])


def test_a_result_that_comes_after_a_person_went_on_is_void(bench: Bench) -> None:
    bench.collect()
    bench.ask("finish")
    job = bench.session.take_job()
    assert job is not None
    value = job.work()
    job.failed("It took too long.")
    bench.ask("continue")
    job.done(value)
    assert bench.session.state().stage == "collecting"


def test_it_finishes_by_itself_when_the_views_suffice_but_only_once(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(CoverageMap, "complete", property(lambda self: len(self.glances) >= 6))
    for number, place in enumerate(GOOD[:6]):
        assert bench.session.state().stage == "collecting"
        assert bench.rest(place).kept == number + 1
    assert bench.session.state().stage == "solving"
    bench.work()
    bench.ask("continue")
    assert bench.rest(GOOD[6]).kept == 7
    assert bench.session.state().stage == "collecting"


def test_what_cannot_be_saved_leaves_the_result_to_be_accepted_again(bench: Bench) -> None:
    bench.collect()
    bench.ask("finish")
    bench.work()
    bench.refusal = "rig.toml: cannot write it (No space left on device); check the folder and the disk."
    with pytest.raises(DataError, match="No space left"):
        bench.ask("accept")
    assert bench.session.ending is None
    bench.refusal = None
    assert bench.ask("accept")["saved"]


def test_pictures_of_another_size_are_explained(bench: Bench) -> None:
    state = bench.show(Place(), pixels=np.zeros((480, 640), np.uint8))
    assert "640 x 480 and the rig's top camera 1280 x 720" in state.advice
    assert state.corners_px == []


def test_a_camera_that_fails_is_explained(bench: Bench) -> None:
    assert bench.session.state().advice == "Waiting for the camera's pictures."
    bench.session.note_health({"top": Health(0, "top", False, None, 0.0, 0, "The camera is unplugged.")})
    assert bench.session.state().advice == "The camera is unplugged."
    assert "unplugged" not in bench.show(Place()).advice


def test_no_more_views_than_are_of_use(bench: Bench) -> None:
    for _ in range(MOST_VIEWS):
        bench.show(Place())
        bench.ask("capture")
    with pytest.raises(CathxrError, match="as many as are of use"):
        bench.ask("capture")


def test_cancelling_saves_nothing(bench: Bench) -> None:
    bench.collect()
    assert bench.ask("cancel")["saved"] is False
    assert bench.saved is None
    assert bench.session.state().advice == "Cancelled: nothing was written."
