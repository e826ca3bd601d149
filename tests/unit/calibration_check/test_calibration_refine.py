"""Poses refined from tracked sessions: most of a knock is taken back, with honest errors, and nothing for nothing."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cathxr.calibration.epipolar import CAMERAS, Pairs
from cathxr.calibration.refine import LEAST_SPAN, refined
from cathxr.core import CalibrationError, Rig
from cathxr.geometry.calibration_error import camera_errors
from cathxr.storage.rig_file import rig_from_text, rig_to_text
from cathxr.twin import true_rig


def test_a_knock_is_mostly_taken_back(
    make_pairs: Callable[..., Pairs], knock: Callable[..., Rig], tip_error: Callable[[Rig, Rig], float], box: Rig
) -> None:
    used = knock(box, "top", turn_deg=0.3, shift_mm=0.5, seed=3)
    result = refined(used, make_pairs(box, used, seed=8), date="2025-05-08")
    before, after = tip_error(box, used), tip_error(box, result.rig)
    assert before > 0.5, "this knock is too harmless to show anything"
    assert after < 0.5 * before
    # 0.05 px of noise is about 0.012 mm between the rays: nothing but that is left in pairs that had no part in the fit
    assert result.after_mm < 0.02
    assert result.n_held_out > 0
    stated = result.rig.cameras["top"].pose_provenance
    assert stated.date == "2025-05-08"
    assert stated.method is not None
    assert stated.method.startswith("refined")
    assert stated.covariance is not None
    assert np.linalg.eigvalsh(stated.covariance).min() > 0
    # what is not refined stays to the last bit, and the rig can be written
    assert result.rig.cameras["top"].intrinsics is used.cameras["top"].intrinsics
    assert result.rig.roll is used.roll
    assert rig_from_text(rig_to_text(result.rig)).name == used.name


def test_a_right_rig_is_left_alone(make_pairs: Callable[..., Pairs], box: Rig) -> None:
    with pytest.raises(CalibrationError, match="left as it is"):
        refined(box, make_pairs(box, box, seed=8), date="2025-05-08")


def test_a_badly_covered_region_is_refused(
    make_pairs: Callable[..., Pairs], knock: Callable[..., Rig], box: Rig
) -> None:
    used = knock(box, "top", turn_deg=0.3, shift_mm=0.5, seed=3)
    pairs = make_pairs(box, used, seed=8)
    narrow = pairs.where(np.abs(pairs.tip_box[:, 1]) < 0.4 * LEAST_SPAN * 60.0)
    with pytest.raises(CalibrationError, match="along y"):
        refined(used, narrow, date="2025-05-08")
    with pytest.raises(CalibrationError, match="Only 9"):
        refined(used, pairs.where(np.arange(9)), date="2025-05-08")


def test_many_pairs_of_one_place_do_not_count_as_many(
    make_pairs: Callable[..., Pairs], knock: Callable[..., Rig], box: Rig
) -> None:
    used = knock(box, "top", turn_deg=0.3, shift_mm=0.5, seed=3)
    pairs = make_pairs(box, used, seed=8)
    often = pairs.where(np.repeat(np.arange(len(pairs)), 20))
    once, twenty = (refined(used, each, date="2025-05-08") for each in (pairs, often))
    # ten thousand copies of a few hundred pairs know hardly more: the floor of each place's own error stays
    assert twenty.expected_after_mm > 0.8 * once.expected_after_mm


@pytest.mark.proof
def test_refined_poses_state_honest_errors(
    make_pairs: Callable[..., Pairs], tip_error: Callable[[Rig, Rig], float], knock: Callable[..., Rig]
) -> None:
    """Over random boxes and knocks most of the tip error goes, and the poses are as far off as they say."""
    from cathxr.geometry.pose import rotation_vector_from_quaternion
    from cathxr.storage.rig_file import example_rig

    gains, squares = [], []
    for seed in range(12):
        box = true_rig(example_rig(), 100 + seed)
        camera = CAMERAS[seed % 2]
        used = knock(box, camera, turn_deg=0.3, shift_mm=0.5, seed=seed)
        try:
            result = refined(used, make_pairs(box, used, seed=seed, seconds=60.0), date="2025-05-08")
        except CalibrationError:
            continue  # the catheter did not go to both sides; refusing is right
        gains.append(tip_error(box, result.rig) / tip_error(box, used))
        for name, error in camera_errors(result.rig).items():
            true, found = box.cameras[name].camera_from_box, result.rig.cameras[name].camera_from_box
            turn = rotation_vector_from_quaternion(replace(true @ found.inverse()).rotation_wxyz)
            off = np.concatenate([turn, true.translation_mm - found.translation_mm])
            squares.append(off @ np.linalg.solve(error.covariance[:6, :6], off) / 6.0)
    assert len(gains) >= 6
    assert np.median(gains) < 0.35
    # The camera that stayed is known by its prior alone and was exactly right here, so that the mean lies below one;
    # an over-confident covariance would put it far above.
    assert np.mean(squares) < 2.0
