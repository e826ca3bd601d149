"""Landmarks being touched: when a tip rests, and what a person at the page can do."""

from typing import Any

import numpy as np
import pytest

from cathxr.core import FloatArray, Pose, RegistrationError, Status, Track
from cathxr.registration import Kind, Registration
from cathxr.registration.drawing import HeartShape
from cathxr.runtime.calibration_task import Ending
from cathxr.runtime.registration_rest import LEAST_S, RestFinder
from cathxr.runtime.registration_touch import TouchSession, Wanted

RATE_HZ = 30.0
PLACES = {
    "apex": (40.0, -35, 30), "valve": (50.0, -40, -20), "sinus": (30.0, 20, -25), "cava": (70.0, 0, 0),
    "vein": (75.0, -30, 15),
}  # fmt: skip
TRUTH = Registration(Pose(np.array([0.5, 0.5, 0.5, 0.5]), np.array([10.0, -20.0, 30.0])), Kind.PLACEMENT, "truth")


def track(seq: int, tip: FloatArray | None, *, t_s: float | None = None) -> Track:
    t_ns = round(1e9 * (seq / RATE_HZ if t_s is None else t_s))
    if tip is None:
        return Track(seq, t_ns, Status.LOST, reason="a hand")
    shape = np.stack([tip, tip - [5.0, 0, 0]])
    return Track(seq, t_ns, Status.TRACKED, shape_box=shape, box_from_tip=Pose.identity(), sigma_mm=0.3)


def test_a_rest_is_the_mean_of_its_tracks_with_their_spread() -> None:
    rng = np.random.default_rng(3)
    finder = RestFinder()
    for seq in range(60):
        finder.add(track(seq, np.array([40.0, 1, 2]) + rng.normal(0.0, 0.05, 3)))
    rest = finder.rest
    assert rest is not None
    assert rest.is_enough
    # 60 Tracks of 0.05 mm: their mean is known to 0.007 mm along each axis; five times that
    assert np.allclose(rest.mean_box, [40.0, 1, 2], atol=0.035)
    assert rest.spread_mm == pytest.approx(0.05 * np.sqrt(3.0), rel=0.3)
    assert (rest.position_std_mm > 0.3 / np.sqrt(3.0) - 1e-9).all()  # the tracker's own error does not average out


def test_a_moving_tip_does_not_rest_and_a_wild_track_ends_no_rest() -> None:
    finder = RestFinder()
    for seq in range(90):
        finder.add(track(seq, np.array([30.0 + 5.0 * seq / RATE_HZ, 0, 0])))  # 5 mm/s
    assert finder.rest is not None
    assert finder.rest.seconds < LEAST_S
    finder.clear()
    for seq in range(60):
        finder.add(track(seq, None if seq % 7 == 3 else np.array([40.0, 0, 9.0 if seq == 20 else 0.0])))
    assert finder.rest is not None
    assert finder.rest.is_enough
    assert np.allclose(finder.rest.mean_box, [40.0, 0, 0])


def test_a_rest_begins_anew_elsewhere_and_after_a_long_loss() -> None:
    finder = RestFinder()
    for seq in range(40):
        finder.add(track(seq, np.array([40.0, 0, 0])))
    for seq in range(40, 50):
        finder.add(track(seq, np.array([50.0, 0, 0])))
    assert finder.rest is not None
    assert np.allclose(finder.rest.mean_box, [50.0, 0, 0])
    assert not finder.rest.is_enough
    finder.add(track(51, np.array([50.0, 0, 0]), t_s=9.0))
    assert finder.rest is None


class Bench:
    """A session, with a hand that puts the tip wherever it is told."""

    def __init__(self, kind: Kind = Kind.RIGID) -> None:
        rng = np.random.default_rng(2)
        self.asked: list[str | None] = []
        self.saved: list[Registration] = []
        self.kept: dict[str, bytes] = {}
        self.seq = 0
        box = np.array(list(PLACES.values()))
        cloud = TRUTH.ct(rng.uniform(box.min(axis=0), box.max(axis=0), (40, 3)))
        shape = HeartShape(cloud, np.arange(39).reshape(-1, 3), ["#aa3344"] * 13)
        self.session = TouchSession(
            [Wanted(key, key.title(), TRUTH.ct(np.array(place))) for key, place in PLACES.items()],
            shape, kind=kind, method="touched", date="2026-01-31", keep=self._keep, save=self._save,
            on_landmark=self.asked.append,
        )  # fmt: skip

    def _keep(self, name: str, png: bytes) -> str:
        self.kept[name] = png
        return f"/calibration/{name}.png"

    def _save(self, registration: Registration) -> Ending:
        self.saved.append(registration)
        return Ending("Written.", True)

    def rest(self, key: str, *, off: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        """Rest at a landmark's place for long enough."""
        tip = np.array(PLACES[key]) + off
        for _ in range(40):
            self.seq += 1
            self.session.take([track(self.seq, tip)])

    def do(self, name: str, **args: Any) -> None:
        """Carry out a command and then the work that it asked for."""
        self.session.handle(name, args)
        job = self.session.take_job()
        if job is not None:
            try:
                value = job.work()
            except RegistrationError as error:
                job.failed(str(error))
            else:
                job.done(value)

    def touch(self, *keys: str) -> None:
        for key in keys:
            self.rest(key)
            self.do("registration_take")


def test_touching_every_landmark_gives_the_registration() -> None:
    bench = Bench()
    assert bench.session.state().views[0].path == "/calibration/heart-0.png"
    bench.touch(*PLACES)
    assert bench.asked == [*PLACES, None]
    state = bench.session.state()
    assert state.current is None
    assert state.advice == "All landmarks are done: finish."
    assert len(state.tip_places) == 2
    bench.do("calibration_finish")
    state = bench.session.state()
    assert (state.stage, state.can_save, state.doubts) == ("done", True, [])
    assert bench.kept["registration"].startswith(b"\x89PNG")
    bench.do("calibration_accept")
    assert bench.session.ending is not None
    assert bench.session.ending.saved
    box = np.array(list(PLACES.values()))
    assert np.allclose(bench.saved[0].ct(box), TRUTH.ct(box), atol=1e-6)
    assert all(pair.box_std_mm is not None for pair in bench.saved[0].landmarks)


def test_one_rest_is_not_two_landmarks() -> None:
    bench = Bench()
    bench.touch("apex")
    bench.rest("apex")
    state = bench.session.state()
    assert not state.can_take
    assert state.why == "Move the tip on to the valve."
    with pytest.raises(RegistrationError, match="Move the tip on"):
        bench.do("registration_take")


def test_what_moves_or_is_lost_cannot_be_taken() -> None:
    bench = Bench()
    with pytest.raises(RegistrationError, match="not tracked"):
        bench.do("registration_take")
    bench.session.take([track(1, np.array(PLACES["apex"]))])
    with pytest.raises(RegistrationError, match="does not rest yet"):
        bench.do("registration_take")
    bench.session.take([track(2, None)])
    assert bench.session.state().trouble == "a hand"


def test_landmarks_can_be_skipped_and_touched_again() -> None:
    bench = Bench()
    bench.do("registration_skip")
    bench.touch("valve", "sinus", "cava")
    assert bench.session.state().current == "vein"
    bench.do("registration_choose", landmark="valve")
    bench.rest("valve", off=(0.5, 0, 0))
    bench.do("registration_take")
    state = bench.session.state()
    assert state.current == "vein"
    assert [each.status for each in state.landmarks] == ["skipped", "touched", "touched", "touched", "waiting"]
    assert state.can_finish
    with pytest.raises(RegistrationError, match="no landmark 'nose' here"):
        bench.do("registration_choose", landmark="nose")


def test_a_wrong_landmark_is_named_and_can_be_put_right() -> None:
    bench = Bench()
    bench.touch("apex", "valve", "sinus", "cava")
    bench.rest("vein", off=(0.0, 12.0, -9.0))
    bench.do("registration_take")
    bench.do("calibration_finish")
    state = bench.session.state()
    assert state.is_grave
    assert state.doubts[0].startswith("vein does not fit the others")
    bench.do("registration_choose", landmark="vein")
    assert bench.session.state().stage == "collecting"
    bench.touch("vein")
    bench.do("calibration_finish")
    assert bench.session.state().doubts == []


def test_kinds_and_too_few_landmarks() -> None:
    bench = Bench()
    bench.touch("apex", "valve", "sinus")
    assert bench.session.state().can_finish
    bench.do("registration_kind", kind="affine")
    state = bench.session.state()
    assert not state.can_finish
    with pytest.raises(RegistrationError, match="3 of 4 landmarks that affine registration takes"):
        bench.do("calibration_finish")
    with pytest.raises(RegistrationError, match="rigid, similarity or affine"):
        bench.do("registration_kind", kind="bent")
    with pytest.raises(RegistrationError, match="no result to save"):
        bench.do("calibration_accept")


def test_an_outcome_that_came_too_late_is_dropped() -> None:
    bench = Bench()
    bench.touch("apex", "valve")
    bench.rest("sinus")
    bench.session.handle("registration_take", {})
    job = bench.session.take_job()
    assert job is not None
    bench.session.handle("registration_kind", {"kind": "affine"})
    job.done(job.work())
    assert bench.session.solution is None
