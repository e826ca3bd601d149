"""The check of a rig: good ones are called good, knocked ones are found, and nothing is claimed from too little."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cathxr.app.calibrate_check import NOT_GOOD, check
from cathxr.calibration.check_drawing import check_png
from cathxr.calibration.drift import check_markers, check_sessions, verdict
from cathxr.calibration.epipolar import PARAMETERS, Geometry, Pairs, gap_noise, session_pairs, signed_gaps
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import CalibrationError, Rig
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import read_rig, write_rig
from cathxr.storage.session import SessionWriter


@pytest.fixture(scope="module")
def good_pairs(make_pairs: Callable[..., Pairs], box: Rig) -> Pairs:
    return make_pairs(box, box, seed=5)


def test_a_right_rig_is_good(good_pairs: Pairs, box: Rig) -> None:
    checked = check_sessions(
        box, [("a", good_pairs.where(good_pairs.session == 0)), ("b", good_pairs.where(good_pairs.session == 1))]
    )
    told = verdict(checked, [])
    assert told.good, told.sentence
    assert checked.judgement.probability["none"] > 0.9
    assert len(checked.sessions) == 2
    assert checked.tip_shift_mm < 0.05
    assert check_png(checked, box.roi).startswith(b"\x89PNG")


def test_gaps_have_the_noise_that_is_stated(good_pairs: Pairs, box: Rig) -> None:
    # Independent pixel noise of a known size goes in: the normalised gaps of a right rig have a standard deviation of
    # 1 within the sampling error of some 500 pairs (3 %), with room for the small motion between neighbours.
    gaps = Geometry(box).gaps(np.zeros(PARAMETERS), good_pairs)
    assert 0.9 < (gaps / gap_noise(box, good_pairs)).std() < 1.1


@pytest.mark.parametrize("camera", ["top", "front"])
def test_a_knocked_camera_is_found_and_named(
    make_pairs: Callable[..., Pairs], knock: Callable[..., Rig], box: Rig, camera: str
) -> None:
    used = knock(box, camera, turn_deg=0.3, shift_mm=0.5, seed=1)
    checked = check_sessions(used, [("a", make_pairs(box, used, seed=6))])
    told = verdict(checked, [])
    other = "front" if camera == "top" else "top"
    assert not told.good
    assert "Drifted" in told.sentence
    assert checked.judgement.probability[camera] > checked.judgement.probability[other]
    assert checked.judgement.p_value < 1e-6


def test_a_delay_is_not_taken_for_a_knock(make_pairs: Callable[..., Pairs], box: Rig) -> None:
    checked = check_sessions(box, [("a", make_pairs(box, box, seed=6, front_late_s=0.006))])
    delay, std = checked.judgement.delay_s
    assert delay == pytest.approx(0.006, abs=max(5 * std, 0.0006))
    told = verdict(checked, [])
    assert not told.good
    assert "calibrate timing" in told.sentence


def test_pairs_judge_a_rig_other_than_the_recordings(
    make_pairs: Callable[..., Pairs], knock: Callable[..., Rig], box: Rig
) -> None:
    used = knock(box, "front", turn_deg=0.3, shift_mm=0.5, seed=1)
    by_right = check_sessions(used, [("a", make_pairs(box, box, seed=6))])
    by_wrong = check_sessions(used, [("a", make_pairs(box, used, seed=6))])
    assert by_right.tip_shift_mm == pytest.approx(by_wrong.tip_shift_mm, rel=0.3)


def test_too_few_pairs_is_a_sentence(good_pairs: Pairs, box: Rig) -> None:
    with pytest.raises(CalibrationError, match="Only 5 picture pairs"):
        check_sessions(box, [("a", good_pairs.where(np.arange(5)))])
    still = replace(good_pairs, tip_box=np.zeros_like(good_pairs.tip_box))
    with pytest.raises(CalibrationError, match=r"in only [12] places"):
        check_sessions(box, [("a", still)])


def test_no_tracks_give_no_pairs(box: Rig) -> None:
    assert len(session_pairs(box, [], [])) == 0


def test_rays_that_meet_have_no_gap(box: Rig) -> None:
    points = np.array([[50.0, 10.0, -20.0], [90.0, -30.0, 15.0]])
    top, front = (CameraModel.of(box.cameras[name]) for name in ("top", "front"))
    assert np.abs(signed_gaps(top, front, top.project(points), front.project(points))).max() < 1e-9


def seen_markers(box: Rig, camera: str, *, seed: int) -> Sighting:
    """Return all eight markers as the box's camera sees them, with 0.1 px of noise."""
    rng = np.random.default_rng(seed)
    model = CameraModel.of(box.cameras[camera])
    markers = [each for group in box.markers.values() for each in group]
    found = tuple(
        FoundMarker(each.name, each.colour, model.project(each.position_mm) + rng.normal(0.0, 0.1, 2), 0.1)
        for each in markers
    )
    return Sighting(camera, box.cameras[camera].size_px, found)


def test_markers_in_their_places_are_good(box: Rig) -> None:
    checks = [check_markers(box, seen_markers(box, camera, seed=4)) for camera in ("top", "front")]
    assert verdict(None, checks).good
    assert all(each.p_value > 1e-3 for each in checks)


def test_markers_name_the_camera_that_moved(knock: Callable[..., Rig], box: Rig) -> None:
    used = knock(box, "front", turn_deg=0.3, shift_mm=0.5, seed=2)
    checks = [check_markers(used, seen_markers(box, camera, seed=4)) for camera in ("top", "front")]
    told = verdict(None, checks)
    assert not told.good
    assert "the front camera" in told.sentence
    assert "the top camera" not in told.sentence
    # 0.3 degrees were turned; 0.1 px of marker noise leaves the turn to some hundredths
    assert checks[1].turned_deg == pytest.approx(0.3, abs=0.06)


def test_three_markers_do_not_suffice(box: Rig) -> None:
    seen = seen_markers(box, "top", seed=1)
    with pytest.raises(CalibrationError, match="only 3"):
        check_markers(box, replace(seen, markers=seen.markers[:3]))


@pytest.mark.proof
def test_p_values_of_markers_are_even(box: Rig) -> None:
    """A right rig with a stated covariance: p-values spread evenly, so that one in a thousand is one in a thousand."""
    from cathxr.calibration.epipolar_fit import prior_covariance

    values = []
    for seed in range(200):
        spread = prior_covariance(box)[:6, :6]
        moved = np.random.default_rng(seed).multivariate_normal(np.zeros(6), spread)
        from cathxr.geometry.pose import perturbed

        old = box.cameras["top"]
        used = replace(
            box, cameras={**box.cameras, "top": replace(old, camera_from_box=perturbed(old.camera_from_box, moved))}
        )
        values.append(check_markers(used, seen_markers(box, "top", seed=seed)).p_value)
    # the largest gap between 200 even values and their ranks is below 0.115 in 99 of 100 cases (Kolmogorov)
    assert np.abs(np.sort(values) - (np.arange(200) + 0.5) / 200).max() < 0.115


@pytest.fixture
def session_folder(tmp_path: Path, record_session: Callable[..., object], box: Rig) -> Callable[[Rig], Path]:
    def make(used: Rig) -> Path:
        made = record_session(box, used, seconds=40.0, seed=5, manoeuvre="smooth")
        folder = tmp_path / "session"
        writer = SessionWriter(folder, rig=used, config={}, clock_pair=(0, "2025-05-08T10:00:00Z"), videos=False)
        for observation, track in zip(made.observations, made.tracks, strict=True):  # type: ignore[attr-defined]
            writer.write_observation(observation)
            writer.write_track(track)
        writer.close()
        return folder

    return make


def test_the_command_tells_good_from_bad_and_refines(
    tmp_path: Path,
    session_folder: Callable[[Rig], Path],
    knock: Callable[..., Rig],
    tip_error: Callable[[Rig, Rig], float],
    box: Rig,
) -> None:
    used = knock(box, "front", turn_deg=0.3, shift_mm=0.5, seed=1)
    path = tmp_path / "rig.toml"
    write_rig(path, used)
    before = path.read_bytes()
    arguments = ["--rig", str(path), "--session", str(session_folder(used))]
    bad = CliRunner().invoke(check, arguments)
    assert bad.exit_code == NOT_GOOD, bad.output
    assert "Drifted" in bad.output
    assert (tmp_path / "rig_calibration" / "check_agreement.png").is_file()
    dry = CliRunner().invoke(check, [*arguments, "--refine", "--dry-run"])
    assert dry.exit_code == 0, dry.output
    assert path.read_bytes() == before
    refined = CliRunner().invoke(check, [*arguments, "--refine"])
    assert refined.exit_code == 0, refined.output
    assert (tmp_path / "rig.toml.bak").read_bytes() == before
    assert tip_error(box, read_rig(path)) < tip_error(box, used)
    good = CliRunner().invoke(check, arguments)
    assert good.exit_code == 0, good.output
    again = CliRunner().invoke(check, [*arguments, "--refine"])
    assert again.exit_code == 1
    assert "left as it is" in again.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "--rig"),
        (["--rig", "rig.toml"], "nothing to check"),
        (["--rig", "rig.toml", "--refine", "--top", "a.png"], "--refine needs recorded sessions"),
        (["--rig", "rig.toml", "--session", "nowhere"], "no such file"),
        (["--rig", "rig.toml", "--source", "twin"], "belongs to --phantom"),
        (["--phantom", "example"], "--session"),
        (["--phantom", "example", "--refine"], "of its own"),
    ],
)
def test_wrong_options_are_one_sentence(arguments: list[str], words: str) -> None:
    result = CliRunner().invoke(check, arguments)
    assert result.exit_code == 1
    assert words in result.output
    assert result.output.count("Error:") == 1
