from dataclasses import fields, replace

import numpy as np
import pytest

from cathxr.core import ConfigError
from cathxr.geometry import CameraModel
from cathxr.hardware import layout as drawn
from cathxr.hardware.examples import refused_examples
from cathxr.hardware.holes import nominal_phantom
from cathxr.hardware.layout import Layout
from cathxr.hardware.light import advised_distance_mm, least_distance_mm, lit, row_ripple
from cathxr.hardware.limits import LIMITS
from cathxr.hardware.nominal import nominal_rig
from cathxr.hardware.parameters import CatheterChoice, Parameters, RoiChoice
from cathxr.hardware.rules import check
from cathxr.hardware.screws import joints
from cathxr.storage.phantom_file import phantom_from_text
from cathxr.storage.phantom_text import phantom_to_text
from cathxr.storage.rig_file import example_rig, rig_from_text, rig_to_text
from cathxr.twin import pillars, static_scene
from cathxr.twin.phantom import visit


def test_the_three_rigs_can_be_built(good: Layout) -> None:
    found = check(good.parameters)
    assert found.lit.of_places >= 0.99
    assert found.lit.without_inlet == 1.0
    assert min(found.play_deg) > 0


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (
            {"camera": {"distance_mm": 260.0, "focal_mm": 3.0}},
            "of the view rays through the ROI end on the lit diffuser",
        ),
        ({"camera": {"focal_mm": 6.0}}, "take a lens of at most"),
        ({"camera": {"f_number": 1.2}}, "stop it down"),
        ({"camera": {"distance_mm": 150.0}}, "stand in or on the frame"),
        ({"gear": {"encoder_teeth": 12}}, "undercut"),
        ({"gear": {"thinning_mm": 0.0}}, "jam"),
        ({"gear": {"module_mm": 0.5}}, "would touch the catheter gear's hub"),
        ({"printer": {"bed_mm": (180.0, 120.0, 180.0)}}, "the bed is 120 mm deep"),
        ({"frame": {"section_mm": 16.0}}, "make the beams at least"),
        ({"catheter": {"french": 20}}, "an inlet of 20F is not made"),
        ({"magnet": {"diameter_mm": 12.0}}, "do not hold magnets"),
        ({"magnet": {"height_mm": 5.0}}, "through the inlet's flange"),
        ({"camera": {"board_mm": 45.0}}, "touches the carrier's three screws"),
        ({"camera": {"lens_mm": 30.0, "board_hole_mm": 28.0}}, "no room for the board's stand-offs"),
        ({"camera": {"distance_mm": 900.0, "focal_mm": 12.0, "f_number": 16.0}}, "sold up to 1000 mm"),
        ({"light": {"pitch_mm": 40.0}}, "show as stripes of"),
        ({"gear": {"thinning_mm": 0.5}}, "wide at their tips"),
        ({"gear": {"catheter_teeth": 30, "encoder_teeth": 60}}, "beside its hub the T mark needs"),
        ({"gear": {"catheter_teeth": 200, "encoder_teeth": 100}}, "need a base of"),
        ({"gear": {"module_mm": 2.0, "catheter_teeth": 52}}, "too near to the lower beam"),
        ({"encoder": {"boss_mm": 30.0}}, "do not lie within each other"),
        ({"encoder": {"pulses": 40}}, "0.5 or finer"),
        ({"encoder": {"pulses": 5000}}, "the board counts"),
    ],
)
def test_what_cannot_be_built_is_refused_with_the_reason(changes: dict[str, dict[str, object]], reason: str) -> None:
    parameters = Parameters()
    for group, values in changes.items():
        parameters = replace(parameters, **{group: replace(getattr(parameters, group), **values)})
    with pytest.raises(ConfigError, match=reason):
        check(parameters)


def test_every_number_has_limits_and_beyond_them_it_is_refused_by_its_name() -> None:
    parameters = Parameters()
    numbers = {
        f"{group.name}.{each.name}"
        for group in fields(parameters)
        if group.name != "name"
        for each in fields(getattr(parameters, group.name))
    }
    assert numbers - set(LIMITS) == {"catheter.name", "catheter.french"}, "French has its own list"
    assert set(LIMITS) <= numbers
    for key, (least, most, _) in LIMITS.items():
        group, name = key.split(".")
        values = getattr(parameters, group)
        for beyond in (least - 0.5 * abs(least) - 1e-3, 2.0 * most, 1e300):
            value = (beyond, 210.0, 220.0) if isinstance(getattr(values, name), tuple) else beyond
            with pytest.raises(ConfigError, match=f"^{key}: "):
                check(replace(parameters, **{group: replace(values, **{name: value})}))


def test_screws_hold_and_do_not_go_too_deep(good: Layout) -> None:
    for joint in joints(good).values():
        assert joint.length_mm >= joint.least_mm
        assert joint.length_mm - joint.grip_mm <= joint.most_mm, joint.key


def test_rows_of_leds_farther_than_their_gap_show_as_stripes(default: Layout) -> None:
    # Far behind the diffuser many rows add up evenly; right behind it only one is seen.
    assert row_ripple(default) < 0.01
    near = Layout(replace(default.parameters, light=replace(default.parameters.light, gap_mm=2.0)))
    assert row_ripple(near) > 0.9


def test_a_refusals_advice_helps() -> None:
    near = replace(Parameters(), camera=replace(Parameters().camera, distance_mm=260.0))
    advice = least_distance_mm(Layout(near))
    assert lit(Layout(replace(near, camera=replace(near.camera, distance_mm=advice)))).without_inlet == 1.0
    # A short inlet hides more than a hundredth of a small ROI: only from farther away it does not.
    short = replace(near, roi=RoiChoice(90.0), frame=replace(near.frame, inlet_length_mm=30.0))
    advice = advised_distance_mm(Layout(short))
    assert advice > least_distance_mm(Layout(short))
    assert lit(Layout(replace(short, camera=replace(short.camera, distance_mm=advice)))).of_places >= 0.99


def test_a_ray_to_a_corner_ends_at_the_diffusers_edge_at_the_least_distance(default: Layout) -> None:
    distance = least_distance_mm(default)
    slope = default.half_mm / (distance - default.half_mm)
    assert slope * (distance + default.ledge_mm) == pytest.approx(default.inner_mm)


def test_lit_shares_agree_with_rays_drawn_at_random(default: Layout) -> None:
    near = Layout(replace(default.parameters, camera=replace(default.parameters.camera, distance_mm=230.0)))
    rng = np.random.default_rng(1)
    places = near.centre + near.half_mm * rng.uniform(-1, 1, (20_000, 3))
    eye = near.centre + np.array([0.0, 0.0, 230.0])
    along = (places - eye) / (eye[2] - places[:, 2:])
    good = np.ones(len(places), dtype=bool)
    for depth in (near.inner_mm, near.ledge_mm):
        at = eye + along * (230.0 + depth)
        good &= (np.abs(at - near.centre)[:, :2] <= near.inner_mm).all(axis=1)
    # 20 000 rays tell a share of 0.93 to 0.002.
    assert lit(near).without_inlet == pytest.approx(good.mean(), abs=0.007)


def test_the_default_is_the_example_rigs_box(default: Layout) -> None:
    rig, example = nominal_rig(default), example_rig()
    assert rig.roi.max_mm.tolist() == example.roi.max_mm.tolist()
    for name, camera in example.cameras.items():
        assert np.allclose(rig.cameras[name].camera_from_box.matrix, camera.camera_from_box.matrix, atol=1e-6)
        for ours, theirs in zip(rig.markers[name], example.markers[name], strict=True):
            assert (ours.name, ours.colour, ours.position_mm.tolist()) == (
                theirs.name, theirs.colour, theirs.position_mm.tolist(),
            )  # fmt: skip


def test_drawing_twin_and_calibration_mean_the_same_things(default: Layout) -> None:
    assert drawn.MARKER_RADIUS_MM == pillars.MARKER_RADIUS_MM
    assert drawn.ARM_GAP_MM == pillars.ARM_GAP_MM
    assert (drawn.ARM_WIDTH_MM, drawn.ARM_THICK_MM, drawn.ARM_BEYOND_MM) == (
        pillars._ARM_WIDTH_MM, pillars._ARM_THICK_MM, pillars._ARM_BEYOND_MM,
    )  # fmt: skip
    assert (default.parameters.frame.inlet_length_mm, *[drawn.INLET_SIDE_MM] * 2) == static_scene.INLET_SIZE_MM
    assert drawn.BORE_PLAY_MM == static_scene.BORE_PLAY_MM


def test_cameras_see_the_whole_roi_and_all_markers(good: Layout) -> None:
    rig = nominal_rig(good)
    places = [rig.roi.corners_mm, *([marker.position_mm] for each in rig.markers.values() for marker in each)]
    for camera in rig.cameras.values():
        model = CameraModel.of(camera)
        assert model.inside(model.project(np.concatenate(places)), margin_px=12.0).all()


def test_rig_and_phantom_come_back_from_their_files(good: Layout) -> None:
    rig = rig_from_text(rig_to_text(nominal_rig(good)))
    assert rig_to_text(rig) == rig_to_text(nominal_rig(good))
    phantom = nominal_phantom(good)
    assert phantom_to_text(phantom_from_text(phantom_to_text(phantom))) == phantom_to_text(phantom)


def test_the_phantoms_holes_lie_where_a_catheter_can_reach(good: Layout) -> None:
    phantom = nominal_phantom(good)
    aside = np.hypot(*phantom.positions_mm[:, 1:].T)
    assert (aside <= 35.0).all()
    assert ((phantom.positions_mm[:, 0] >= 20.0) & (phantom.positions_mm[:, 0] <= 115.0)).all()


@pytest.mark.proof
def test_the_twins_catheter_reaches_every_hole(good: Layout) -> None:
    rig, phantom = nominal_rig(good), nominal_phantom(good)
    assert len(visit(rig, phantom).rests) == len(phantom.holes)


def test_three_rigs_are_refused_each_for_a_reason_of_its_own() -> None:
    told = set()
    for _, parameters in refused_examples():
        with pytest.raises(ConfigError) as refusal:
            check(parameters)
        told.add(str(refusal.value).partition(":")[0])
    assert len(told) == 3


def test_a_small_bed_cuts_the_beams() -> None:
    small = replace(Parameters().printer, bed_mm=(180.0, 180.0, 180.0))
    layout = Layout(replace(Parameters(), printer=small, roi=RoiChoice(100.0), catheter=CatheterChoice("8F", 8)))
    assert layout.segments == 2
