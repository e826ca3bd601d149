"""Tasks, their files, their places, their orders."""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cathxr.core import ConfigError, DataError, Roi
from cathxr.heart import builtin_path, read_heart
from cathxr.registration import read_registration
from cathxr.training import (
    Practice,
    builtin_tasks,
    find_task,
    order_of,
    place_task,
    practice_of,
    read_task,
    task_from_text,
    task_sha256,
    task_toml,
)  # fmt: skip
from cathxr.training.closeness import angle_deg, closeness, ray_distance
from cathxr.training.placing import PlacedTarget, PlacedTask

ROI = Roi(np.array([0.0, -60.0, -60.0]), np.array([120.0, 60.0, 60.0]))
GOOD = """
schema = "cathxr-task/1"
key = "mine"
name = "Mine"
text = "Do it."
limit_s = 60.0
[[targets]]
key = "one"
name = "One"
place = { position_box_mm = [50.0, 0.0, 0.0] }
reach = { by = "tip", radius_mm = 5.0 }
"""


def built_in(key: str) -> PlacedTask:
    heart = read_heart(builtin_path())
    assert heart.registration is not None
    matrix = read_registration(heart.registration).matrix
    return place_task(find_task(key), ct_from_box=matrix, points_ct=heart.points_ct, roi=ROI)


@pytest.mark.parametrize("task", builtin_tasks(), ids=lambda each: each.key)
def test_built_in_tasks_fit_the_built_in_heart_and_survive_their_files(task) -> None:
    assert built_in(task.key).targets
    again = task_from_text(task_toml(task), name="again")
    assert task_toml(again) == task_toml(task)
    assert task_sha256(again) == task_sha256(task)


def test_the_progression_is_whole() -> None:
    assert [each.step for each in builtin_tasks() if each.step] == [1, 1, 1, 2, 3, 4, 5, 6]
    assert len(find_task("six_targets").targets) == 6


def test_the_sweep_turns_clockwise_by_the_registered_landmarks() -> None:
    """Roll of each view about the insertion, from roll zero (-y), right-handed: clockwise for who looks along it."""
    rolls = []
    for target in built_in("clockwise_sweep").targets:
        assert target.up_box is not None
        assert target.direction_box is not None
        assert abs(target.up_box[0]) < 0.01  # the caval axis is the box's x in the default placement
        rolls.append(math.degrees(math.atan2(-target.up_box[2], -target.up_box[1])))
        assert target.direction_box == pytest.approx(np.cross([1.0, 0.0, 0.0], target.up_box), abs=0.01)
    assert rolls == sorted(rolls)
    # From the home view to the right veins it is about a quarter turn.
    assert 60.0 < rolls[-1] - rolls[0] < 150.0


def test_a_catheter_along_the_caval_axis_meets_every_view_by_roll_alone() -> None:
    for target in built_in("clockwise_sweep").targets:
        assert target.up_box is not None
        z = np.array([1.0, 0.0, 0.0])
        x = target.up_box - (target.up_box @ z) * z
        x /= np.linalg.norm(x)
        near = closeness(target, np.array([40.0, 0.0, 0.0]), np.column_stack([x, np.cross(z, x), z]))
        assert near.inside
        assert near.distance_mm < 0.5
        assert near.angle_deg is not None
        assert near.angle_deg < 1.0


def test_closeness_against_closed_forms() -> None:
    rotation = np.eye(3)
    beam = PlacedTarget("b", "b", "beam", np.array([30.0, 3.0, 4.0]), 5.0, angle_deg=20.0, range_mm=40.0)
    near = closeness(beam, np.zeros(3), rotation)
    assert (near.distance_mm, near.inside) == (5.0, True)
    assert near.angle_deg == pytest.approx(math.degrees(math.atan2(5.0, 30.0)))
    assert not closeness(beam, np.array([-20.0, 0.0, 0.0]), rotation).inside  # beyond the range
    assert ray_distance(np.array([-3.0, 4.0, 0.0]), np.array([1.0, 0.0, 0.0])) == 5.0  # behind the tip
    tip = PlacedTarget("t", "t", "tip", np.zeros(3), 5.0, angle_deg=10.0, direction_box=np.array([0.0, 1.0, 0.0]))
    near = closeness(tip, np.array([3.0, 4.0, 0.0]), rotation)
    assert (near.distance_mm, near.angle_deg, near.inside) == (5.0, 90.0, False)
    # A mirrored plane is another view.
    plane = PlacedTarget("p", "p", "plane", np.zeros(3), 5.0, angle_deg=10.0, up_deg=10.0,
                         direction_box=np.array([0.0, -1.0, 0.0]), up_box=np.array([1.0, 0.0, 0.0]))  # fmt: skip
    assert closeness(plane, np.zeros(3), rotation).angle_deg == 180.0
    assert angle_deg(np.array([1.0, 0.0, 0.0]), np.array([1.0, 1e-9, 0.0])) == pytest.approx(math.degrees(1e-9))


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('key = "mine"', 'key = "My Task"', "key is wrong"),
        ("limit_s = 60.0", "limit_s = 0.0", "limit_s is wrong"),
        ("limit_s = 60.0", "limit_s = nan", "limit_s is wrong"),
        ("limit_s = 60.0", "", "limit_s is missing"),
        ("limit_s = 60.0", "limit_s = 60.0\ncolour = 1", "colour is not a key"),
        ("limit_s = 60.0", "limit_s = 60.0\ndraw = 2", "draw: expected 1 to 1"),
        ("limit_s = 60.0", "limit_s = 60.0\n[practice]\nlimit_s = 9.0", "target_limit_s"),
        (
            "radius_mm = 5.0",
            "radius_mm = 5.0, angle_deg = 10.0",
            "target one: reach: expected angle_deg and direction_box",
        ),
        ("radius_mm = 5.0", "radius_mm = -5.0", "radius_mm is wrong"),
        ('by = "tip"', 'by = "nose"', "by is wrong"),
        ("{ position_box_mm = [50.0, 0.0, 0.0] }", "{}", "target one: place: expected exactly one"),
        ("[50.0, 0.0, 0.0]", "[50.0, 0.0]", "position_box_mm"),
        ('reach = { by = "tip", radius_mm = 5.0 }', "", "target one: expected either reach or plane"),
        ("cathxr-task/1", "cathxr-task/9", "schema is wrong"),
        ("[[targets]]", "[[targets]", "not valid TOML"),
        ("limit_s = 60.0", "limit_s = 1e300", "limit_s is wrong"),
        ("radius_mm = 5.0", "radius_mm = 5.0, dwell_s = 60.0", "target one: dwell_s: expected less than .* 60 s"),
        ("limit_s = 60.0", "limit_s = 60.0\ntarget_limit_s = inf", "target_limit_s is wrong"),
        ('name = "Mine"', 'name = "  "', "name is wrong: expected a text, got none"),
        ('name = "Mine"', 'name = "Mi\\nne"', r"got the control character U\+000A"),
        ('name = "One"', f'name = "{81 * "x"}"', "targets.0.name is wrong: expected at most 80 characters, got 81"),
        ('text = "Do it."', 'text = "\\u001b[31mDo"', r"text is wrong: .*U\+001B"),
    ],
)
def test_wrong_files_are_refused_in_a_sentence(old: str, new: str, sentence: str) -> None:
    assert task_from_text(GOOD, name="mine.toml").key == "mine"
    with pytest.raises(ConfigError, match=sentence) as caught:
        task_from_text(GOOD.replace(old, new), name="mine.toml")
    assert "mine.toml" in str(caught.value)
    assert "\n" not in str(caught.value).split("(at line")[0]


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot be read"):
        read_task(tmp_path / "none.toml")
    (tmp_path / "odd.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match="UTF-8"):
        read_task(tmp_path / "odd.toml")
    with pytest.raises(ConfigError, match="six_targets"):
        find_task("seven_targets")


def test_places_that_do_not_fit_are_refused() -> None:
    unknown = GOOD.replace("{ position_box_mm = [50.0, 0.0, 0.0] }", '{ landmark = "foramen" }')
    with pytest.raises(ConfigError, match="landmark foramen, which this heart does not have"):
        place_task(task_from_text(unknown, name="x"), ct_from_box=np.eye(4), points_ct={}, roi=ROI)
    outside = GOOD.replace("50.0", "150.0")
    with pytest.raises(ConfigError, match="outside the region of interest"):
        place_task(task_from_text(outside, name="x"), ct_from_box=np.eye(4), points_ct={}, roi=ROI)
    # What is only looked at may lie outside.
    beam = outside.replace('"tip"', '"beam"')
    assert place_task(task_from_text(beam, name="x"), ct_from_box=np.eye(4), points_ct={}, roi=ROI).targets
    view = GOOD.replace("reach = { by = \"tip\", radius_mm = 5.0 }",
                        'plane = { axis = ["a", "b"], offset_mm = 1.0, angle_deg = 5.0 }')  # fmt: skip
    points = {"a": np.zeros(3), "b": np.array([1.0, 0.0, 0.0])}
    with pytest.raises(ConfigError, match="lies on the axis"):
        place_task(task_from_text(view, name="x"), ct_from_box=np.eye(4), points_ct=points, roi=ROI)


def test_scale_and_offset_of_the_registration_count() -> None:
    text = GOOD.replace("position_box_mm = [50.0, 0.0, 0.0]", "position_ct_mm = [110.0, 20.0, 30.0]")
    matrix = np.diag([2.0, 2.0, 2.0, 1.0])
    matrix[:3, 3] = [10.0, 20.0, 30.0]
    (target,) = place_task(task_from_text(text, name="x"), ct_from_box=matrix, points_ct={}, roi=ROI).targets
    assert target.point_box == pytest.approx([50.0, 0.0, 0.0])


def test_orders() -> None:
    six, random = find_task("six_targets"), find_task("random_targets")
    rows = [order_of(six, row=row) for row in range(6)]
    for place in range(6):
        assert len({row[place] for row in rows}) == 6
    neighbours = {pair for row in rows for pair in pairwise(row)}
    assert len(neighbours) == 30  # each ordered pair once: balanced for carry-over
    assert order_of(six, row=6) == rows[0]
    drawn = order_of(random, seed=4)
    assert len(drawn) == len(set(drawn)) == 8
    assert drawn == order_of(random, seed=4) != order_of(random, seed=5)
    assert order_of(find_task("insertion")) == tuple(each.key for each in find_task("insertion").targets)


def test_any_task_can_be_practised() -> None:
    task = practice_of(find_task("random_targets"), Practice(3, 120.0), target_limit_s=20.0)
    assert (task.practice, task.draw, task.target_limit_s) == (Practice(3, 120.0), None, 20.0)
