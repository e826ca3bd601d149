from dataclasses import replace

import numpy as np
import pytest

from cathxr.hardware.gears import backlash_deg, degrees_per_count, gear_pair, measured_play_deg, mesh
from cathxr.hardware.parameters import EncoderChoice, GearChoice


@pytest.mark.parametrize("off_mm", [-0.15, 0.0, 0.15])
@pytest.mark.parametrize("teeth", [(48, 24), (45, 27), (60, 20)])
def test_the_formula_of_play_agrees_with_gears_turned_to_contact(teeth: tuple[int, int], off_mm: float) -> None:
    choice = GearChoice(catheter_teeth=teeth[0], encoder_teeth=teeth[1])
    least, most = measured_play_deg(choice, off_mm=off_mm, steps=8)
    # 60 points on a flank of 2.2 mm leave a contact between two of them off by under a micrometre.
    assert least == pytest.approx(mesh(choice, off_mm=off_mm).play_deg, abs=0.003)
    assert most == pytest.approx(least, abs=0.003)


def test_gears_without_thinning_have_no_play_and_jam_when_nearer() -> None:
    choice = replace(GearChoice(), thinning_mm=0.0)
    assert backlash_deg(choice) == pytest.approx(0.0, abs=1e-9)
    assert measured_play_deg(choice, off_mm=-0.1, steps=4)[0] < 0


def test_counts_and_ratio() -> None:
    assert degrees_per_count(GearChoice(), EncoderChoice()) == pytest.approx(0.075)


def test_an_outline_is_one_tooths_width_at_the_pitch_circle() -> None:
    gear = gear_pair(GearChoice())[0]
    width = 2.0 * float(gear.half_tooth_rad(np.array([gear.pitch_mm]))[0]) * gear.pitch_mm
    assert width == pytest.approx(0.5 * np.pi * gear.module_mm - gear.thinning_mm)
    radii = np.hypot(*gear.outline().T)
    assert radii.min() == pytest.approx(gear.root_mm)
    assert radii.max() == pytest.approx(gear.tip_mm)
