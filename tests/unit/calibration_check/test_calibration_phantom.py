"""The accuracy protocol: dwells are found and matched to holes, and what is put in as an error comes out."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from cathxr.app.calibrate_check import check
from cathxr.calibration.check_drawing import phantom_png
from cathxr.calibration.phantom import phantom_errors
from cathxr.calibration.phantom_dwells import find_dwells, matched
from cathxr.core import CalibrationError, ConfigError, FloatArray, Pose, Status, Track
from cathxr.core.phantom import Hole, Phantom
from cathxr.storage.phantom_file import example_phantom, example_phantom_text, phantom_from_text, read_phantom
from cathxr.storage.rig_file import example_rig, write_rig
from cathxr.storage.session import SessionWriter

_RATE_HZ = 15.0


def visits(
    phantom: Phantom, order: Sequence[int], *, seed: int = 0, noise_mm: float = 0.05, spread_mm: float = 0.0,
    offset: FloatArray | None = None, lost_in: int | None = None, extra: dict[int, FloatArray] | None = None,
) -> list[Track]:  # fmt: skip
    """Return the Tracks of a tip that visits holes by index. spread_mm: between visits; lost_in: a visit with a gap;
    extra: rests elsewhere, before the visit of that position."""
    rng = np.random.default_rng(seed)
    path: list[FloatArray] = []
    lost: set[int] = set()
    at = np.array([20.0, 0.0, 0.0])

    def go(target: FloatArray) -> None:
        nonlocal at
        for share in np.linspace(0.0, 1.0, int(0.8 * _RATE_HZ)):
            path.append(at + (10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5) * (target - at))
        at = target
        path.extend([target] * int(1.5 * _RATE_HZ))

    for position, hole in enumerate(order):
        if extra is not None and position in extra:
            go(extra[position])
        shift = np.zeros(3) if offset is None else offset
        go(phantom.holes[hole].position_mm + shift + spread_mm * rng.normal(0.0, 1.0, 3))
        if lost_in == position:
            lost |= set(range(len(path) - 14, len(path) - 9))
    tracks = []
    for seq, tip in enumerate(path):
        t_ns = round(seq * 1e9 / _RATE_HZ)
        if seq in lost:
            tracks.append(Track(seq, t_ns, Status.LOST, reason="no catheter"))
            continue
        seen = tip + rng.normal(0.0, noise_mm, 3)
        shape = np.linspace(seen, np.zeros(3), 5)
        pose = Pose(np.array([1.0, 0.0, 0.0, 0.0]), seen)
        tracks.append(Track(seq, t_ns, Status.TRACKED, shape_box=shape, box_from_tip=pose, sigma_mm=0.05))
    return tracks


@pytest.fixture(scope="module")
def phantom() -> Phantom:
    return example_phantom()


def test_the_example_fits_the_example_rig(phantom: Phantom) -> None:
    roi = example_rig().roi
    assert (phantom.positions_mm > roi.min_mm + 5.0).all()
    assert (phantom.positions_mm < roi.max_mm - 5.0).all()
    assert phantom.catheter_diameter_mm == example_rig().catheter.diameter_mm
    assert {each.region for each in phantom.holes} == {"near", "middle", "far"}


def test_every_hole_is_found_in_order(phantom: Phantom) -> None:
    order = list(range(len(phantom.holes)))
    dwells = find_dwells(visits(phantom, order, lost_in=3))
    assert [each.hole for each in matched(phantom, dwells)] == order


@settings(max_examples=20)
@given(data=st.data())
def test_any_order_with_skips_repeats_and_rests_elsewhere_is_matched(data: st.DataObject) -> None:
    phantom = example_phantom()
    count = len(phantom.holes)
    skipped = data.draw(st.sets(st.integers(1, count - 2), max_size=3))
    order = [each for each in range(count) if each not in skipped]
    elsewhere = {data.draw(st.integers(1, len(order) - 1)): np.array([60.0, 45.0, 45.0])}
    dwells = find_dwells(visits(phantom, order, spread_mm=0.3, extra=elsewhere, seed=data.draw(st.integers(0, 99))))
    assert [each.hole for each in matched(phantom, dwells)] == order


def test_errors_come_out_as_they_went_in(phantom: Phantom) -> None:
    offset = np.array([0.3, -0.2, 0.1])
    order = list(range(len(phantom.holes))) * 3
    result = phantom_errors(phantom, [("a", visits(phantom, order, offset=offset, spread_mm=0.1, seed=4))])
    # three visits a hole with 0.1 mm along each axis: the mean of 54 is known to 0.014 mm along an axis
    assert np.abs(result.bias - offset).max() < 0.06
    # 36 spare visits know a spread of 0.1 * sqrt(3) to 7 %; a dwell's own noise of 0.05 / sqrt(16) hardly adds
    assert result.random_mm == pytest.approx(0.1 * np.sqrt(3.0), rel=0.3)
    assert result.within_mm == pytest.approx(0.05 * np.sqrt(3.0), rel=0.15)
    # a rigid alignment takes up what is the same everywhere
    assert result.moved_mm == pytest.approx(float(np.linalg.norm(offset)), abs=0.1)
    assert result.rows[0].aligned_mean < 0.6 * result.rows[0].mean
    assert [each.region for each in result.rows] == ["all", "near", "middle", "far"]
    assert sum(each.visits for each in result.rows[1:]) == result.rows[0].visits == len(order)
    assert result.notes == ()
    assert phantom_png(result, example_rig().roi).startswith(b"\x89PNG")


def test_departures_from_the_protocol_are_named(phantom: Phantom) -> None:
    order = [0, 1, 1, 2, 4, 5, 6, 7]
    result = phantom_errors(phantom, [("a", visits(phantom, order, extra={3: np.array([60.0, 45.0, 45.0])}))])
    told = " ".join(result.notes)
    assert "never rested in holes 4, 9, 10" in told
    assert "in no hole" in told


def test_a_visit_twice_running_is_named(phantom: Phantom) -> None:
    # the tip leaves the hole and comes back to it
    away = {2: np.array([60.0, 45.0, 45.0])}
    result = phantom_errors(phantom, [("a", visits(phantom, [0, 1, 1, 2, 3, 4], extra=away))])
    assert any("hole 2 was visited twice running" in each for each in result.notes)


def test_too_few_holes_is_a_sentence(phantom: Phantom) -> None:
    with pytest.raises(CalibrationError, match="in only 2 holes"):
        phantom_errors(phantom, [("a", visits(phantom, [0, 1]))])
    with pytest.raises(CalibrationError, match="in only 0 holes"):
        phantom_errors(phantom, [("a", [])])


def test_a_rig_of_another_box_is_told_as_such(phantom: Phantom) -> None:
    lost = [Track(seq=each, t_ns=each, status=Status.LOST, reason="the views disagree") for each in range(5)]
    with pytest.raises(CalibrationError, match=r"0 of 5 Tracks are tracked \(the views disagree\): calibrate the rig"):
        phantom_errors(phantom, [("a", lost)])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("cathxr-phantom/1", "cathxr-phantom/9"), "schema"),
        (("position_std_mm = 0.05", ""), "position_std_mm"),
        (("position_std_mm = 0.05", "position_std_mm = -1"), "position_std_mm"),
        (('name = "2"', 'name = "1"'), "twice"),
        (("[35.00, 0.00, 0.00]", "[35.00, 0.00]"), "3 finite numbers"),
        (("[35.00, 0.00, 0.00]", "[44.00, 7.0, 7.0]"), "apart"),
        (('region = "near"', 'zone = "near"'), "unknown"),
        (("[[holes]]", "[[hole]]"), "holes"),
        (("catheter_diameter_mm = 3.0", "catheter_diameter_mm = 300.0"), "catheter_diameter_mm"),
    ],
)
def test_a_wrong_file_is_one_sentence(change: tuple[str, str], words: str) -> None:
    text = example_phantom_text()
    assert change[0] in text
    with pytest.raises(ConfigError, match=words):
        phantom_from_text(text.replace(*change))


def test_two_holes_are_too_few() -> None:
    with pytest.raises(ValueError, match="at least three"):
        Phantom("p", (Hole("1", np.zeros(3)), Hole("2", np.ones(3))), 0.1)
    holes = 'holes = [{name = "1", position_mm = [1, 2, 3]}]'
    text = f'schema = "cathxr-phantom/1"\nname = "p"\nposition_std_mm = 0.1\n{holes}'
    with pytest.raises(ConfigError, match="at least 3 holes"):
        phantom_from_text(text)


def test_the_command_reports_from_a_session(phantom: Phantom, tmp_path: Path) -> None:
    folder, path = tmp_path / "session", tmp_path / "phantom.toml"
    path.write_text(example_phantom_text(), encoding="utf-8")
    assert read_phantom(path).name == phantom.name
    write_rig(tmp_path / "rig.toml", example_rig())
    writer = SessionWriter(folder, rig=example_rig(), config={}, clock_pair=(0, "2025-05-08T10:00:00Z"), videos=False)
    for track in visits(phantom, list(range(len(phantom.holes)))):
        writer.write_track(track)
    writer.close()
    result = CliRunner().invoke(
        check, ["--phantom", str(path), "--session", str(folder), "--report", str(tmp_path / "out")]
    )
    assert result.exit_code == 0, result.output
    assert "18 visits" in result.output
    rows = (tmp_path / "out" / "phantom_errors.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + len(phantom.holes)
    assert (tmp_path / "out" / "phantom_errors.png").is_file()


@pytest.mark.proof
def test_the_twin_does_it_by_itself(tmp_path: Path) -> None:
    """Real detection and tracking of the twin's visits: with the box's true rig the tip is within 0.1 mm."""
    from cathxr.app.calibrate_check_phantom import twin_tracks

    phantom = example_phantom()
    _, named = twin_tracks(None, phantom, seed=3)
    result = phantom_errors(phantom, named)
    assert result.notes == ()
    assert result.rows[0].visits == 2 * len(phantom.holes)
    assert result.rows[0].mean < 0.1
