"""Seeds are placed, moved, deleted, undone and saved; labels follow the segmentation; bad commands are sentences."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cathxr.core import ConfigError, DataError
from cathxr.heart.volume import Grid, LabelVolume
from cathxr.runtime.heart_seeds import SeedSession

from .conftest import SHAPE, labels_of, seed

PLACE = [-2.0, -15.0, 106.0]  # voxel i 3, j 5, k 3; seen from the head: z = 7 - 3


def place(session: SeedSession, structure: str, position: list[float], **more: Any) -> int:
    return int(session.handle("seeds_place", {"structure": structure, "position_mm": position, **more})["seed"])


def seeds(session: SeedSession) -> list[tuple[str, tuple[float, ...]]]:
    return [(each.structure, each.position_mm) for each in session.state().seeds]


def segmented(session: SeedSession) -> None:
    """Do what the thread does."""
    given = session.take_work()
    assert given is not None
    session.take_outcome(session.segment(given, lambda what, share: session.note_progress(what, share)))


def test_a_seed_tells_where_it_is_and_what_is_there(make_session: Callable[..., SeedSession]) -> None:
    session = make_session(labels=labels_of())
    place(session, "aorta", PLACE)
    shown = session.state().seeds[0]
    assert (shown.structure, shown.position_mm, shown.seen) == ("aorta", (-2.0, -15.0, 106.0), (3.0, 5.0, 4.0))
    assert (shown.hu, shown.labelled) == (100 * 3 + 10 * 5 + 3 - 1000, "right_ventricle")


def test_a_second_click_moves_the_seed_and_shift_adds_one(make_session: Callable[..., SeedSession]) -> None:
    session = make_session(labels=labels_of())
    first = place(session, "aorta", PLACE)
    assert place(session, "aorta", [0.0, -15.0, 106.0]) == first
    second = place(session, "aorta", PLACE, add=True)
    place(session, "left_atrium", PLACE)
    assert second != first
    assert [name for name, _ in seeds(session)] == ["aorta", "aorta", "left_atrium"]
    place(session, "aorta", [1.0, -15.0, 106.0], seed=first)
    assert [place[0] for _, place in seeds(session)] == [1.0, -2.0, -2.0]
    # The id of another structure's seed, or of one that has gone, moves the newest of the chosen structure.
    place(session, "aorta", [2.0, -15.0, 106.0], seed=99)
    assert [place[0] for _, place in seeds(session)] == [1.0, 2.0, -2.0]


def test_everything_is_undone_and_done_again(make_session: Callable[..., SeedSession]) -> None:
    session = make_session(labels=labels_of())
    states = [seeds(session)]
    number = place(session, "aorta", PLACE)
    states.append(seeds(session))
    place(session, "aorta", [0.0, -15.0, 106.0])
    states.append(seeds(session))
    session.handle("seeds_remove", {"seed": number})
    states.append(seeds(session))
    for state in reversed(states[:-1]):
        session.handle("seeds_undo", {})
        assert seeds(session) == state
    assert not session.state().can_undo
    session.handle("seeds_undo", {})  # nothing is left to undo: nothing happens
    for state in states[1:]:
        session.handle("seeds_redo", {})
        assert seeds(session) == state
    session.handle("seeds_undo", {})
    place(session, "left_atrium", PLACE)
    assert not session.state().can_redo, "a new change ends what could be done again"


def test_the_labels_follow_the_segmentation(make_session: Callable[..., SeedSession], segmentation: Any) -> None:
    session = make_session()
    assert session.state().labels_from == "nothing"
    segmented(session)
    state = session.state()
    assert (state.stage, state.labels_version, state.labels_from) == ("ready", 1, "segmentation")
    assert state.is_current
    assert state.findings == ["No veins were found."]
    halves = SHAPE[0] * SHAPE[1] * 6 * 0.002  # mL of half the voxels of 2 mm3
    volumes = {each.key: each.volume_ml for each in state.structures if each.volume_ml is not None}
    assert volumes == {"right_ventricle": halves, "left_ventricle": halves}

    place(session, "aorta", PLACE)
    assert not session.state().is_current
    session.handle("seeds_segment", {})
    segmented(session)
    assert [(each.structure, *each.position_mm) for each in segmentation.given[1]] == [("aorta", -2.0, -15.0, 106.0)]
    aorta, right = (next(e for e in session.state().structures if e.key == key) for key in ("aorta", "right_ventricle"))
    assert (aorta.volume_ml, aorta.before_ml) == (0.01, None)  # 6 voxels are 0.012 mL
    assert right.before_ml == halves
    assert session.state().labels_version == 2


def test_ready_labels_are_shown_and_nothing_is_segmented_by_itself(make_session: Callable[..., SeedSession]) -> None:
    session = make_session(labels=labels_of())
    assert session.take_work() is None
    state = session.state()
    assert (state.labels_from, state.labels_version, state.is_current) == ("file", 1, False)
    shown = {each.key: each.label for each in state.structures if each.label}
    assert shown == {"left_ventricle": 1, "right_ventricle": 2}, "the values are the catalogue's, not the file's"
    assert state.labels_box == [(0, 0, 0), (11, 9, 7)]
    slices = session.slices
    axial = np.frombuffer(slices.labels(1, "axial", 0) or b"", np.uint8).reshape(10, 12)
    assert (axial[:, :6] == 2).all()
    assert (axial[:, 6:] == 1).all()


def test_structures_that_no_catalogue_has_are_shown_but_take_no_seeds(make_session: Callable[..., SeedSession]) -> None:
    labels = labels_of()
    other = LabelVolume(labels.labels, labels.grid, {7: "stent_graft", 9: "blood_pool"})
    session = make_session(labels=other)
    extra = {each.key: each for each in session.state().structures if not each.seedable}
    found = {(each.name, each.label) for each in extra.values()}
    assert found == {("Stent graft", 100), ("Blood pool, not separated", 13)}
    for key in ("stent_graft", "blood_pool", "myocardium"):
        with pytest.raises(ConfigError, match="choose a structure of the list"):
            place(session, key, PLACE)
    place(session, "none", PLACE)


def test_saving_says_whether_the_file_holds_the_seeds(make_session: Callable[..., SeedSession]) -> None:
    session = make_session(labels=labels_of(), seeds=[seed("aorta", (0.0, -15.0, 106.0), radius_mm=3.0)], saved=True)
    assert session.state().saved
    place(session, "aorta", PLACE)
    assert not session.state().saved
    assert session.handle("seeds_save", {}) == {"sentence": "1 seed is saved."}
    assert session.state().saved
    ((written,),) = session.written  # type: ignore[attr-defined]
    assert (written.structure, *written.position_mm, written.radius_mm) == ("aorta", -2.0, -15.0, 106.0, 3.0)
    session.handle("seeds_undo", {})
    assert not session.state().saved
    session.handle("seeds_redo", {})
    assert session.handle("seeds_done", {}) == {"saved": True, "sentence": "1 seed is saved.", "paths": []}


def test_seeds_of_another_file_are_not_saved_yet(make_session: Callable[..., SeedSession]) -> None:
    session = make_session(labels=labels_of(), seeds=[seed("aorta", (0.0, -15.0, 106.0))])
    assert not session.state().saved
    session.handle("seeds_done", {})
    assert session.ending is not None
    assert not session.ending.saved


def test_done_waits_for_the_segmentation(make_session: Callable[..., SeedSession]) -> None:
    session = make_session()
    assert session.take_work() == ()
    assert session.handle("seeds_done", {}) == {}
    assert session.ending is None
    assert session.stop_wanted
    session.take_failure("")
    assert session.ending is not None


def test_a_failure_leaves_the_labels_and_says_why(make_session: Callable[..., SeedSession]) -> None:
    session = make_session(labels=labels_of())
    session.handle("seeds_segment", {})
    session.take_work()
    with pytest.raises(ConfigError, match="runs already"):
        session.handle("seeds_segment", {})
    session.take_failure("There is no contrast in the heart.")
    state = session.state()
    assert (state.stage, state.advice, state.labels_version) == ("failed", "There is no contrast in the heart.", 1)


@pytest.mark.parametrize(
    ("name", "args", "sentence"),
    [
        ("seeds_place", {"structure": "aorta", "position_mm": [900, 0, 0]}, "outside the CT"),
        ("seeds_place", {"structure": "aorta", "position_mm": [0, 0]}, "three numbers"),
        ("seeds_place", {"structure": "aorta", "position_mm": [0, 0, float("nan")]}, "three numbers"),
        ("seeds_place", {"structure": "spleen", "position_mm": PLACE}, "choose a structure"),
        ("seeds_place", {"structure": 5, "position_mm": PLACE}, "must be a text"),
        ("seeds_place", {"structure": "aorta"}, "takes structure, position_mm"),
        ("seeds_remove", {"seed": 4}, "not there any more"),
        ("seeds_eat", {}, "no command"),
    ],
)
def test_bad_commands(make_session: Callable[..., SeedSession], name: str, args: dict[str, Any], sentence: str) -> None:
    session = make_session(labels=labels_of())
    with pytest.raises(ConfigError, match=sentence):
        session.handle(name, args)
    assert session.state().seeds == []


def test_seeds_and_labels_of_another_ct_are_refused(make_session: Callable[..., SeedSession]) -> None:
    with pytest.raises(DataError, match=r"Seed 1 \(aorta\) lies outside the CT"):
        make_session(seeds=[seed("aorta", (0.0, 0.0, 0.0))])
    moved = labels_of().grid.ct_from_voxel.copy()
    moved[0, 3] += 1.0
    with pytest.raises(DataError, match="not on the CT's grid"):
        make_session(labels=LabelVolume(labels_of().labels, Grid(SHAPE, moved), {7: "aorta", 9: "left_atrium"}))
