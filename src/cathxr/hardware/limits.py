"""Between what every parameter must lie, each with its reason. What depends on others is in `rules` and `fits`."""

import dataclasses
from collections.abc import Iterator, Mapping

from cathxr.hardware.parameters import Parameters

LIMITS: Mapping[str, tuple[float, float, str]] = {
    "roi.side_mm": (90.0, 250.0, "the phantom's stairs need that much, and the frame must stand on a table"),
    "camera.distance_mm": (60.0, 1000.0, "the rods that carry the cameras are sold up to 1 m"),
    "camera.width_px": (320, 8192, "cameras of this kind have no other pictures"),
    "camera.height_px": (240, 8192, "cameras of this kind have no other pictures"),
    "camera.rate_hz": (5.0, 1000.0, "a catheter is not followed below, and no such camera is sold above"),
    "camera.pixel_um": (0.8, 20.0, "sensors have no other pixels"),
    "camera.focal_mm": (1.0, 50.0, "M12 lenses have no other focal lengths"),
    "camera.f_number": (1.0, 32.0, "M12 lenses have no other apertures"),
    "camera.board_mm": (15.0, 60.0, "the carrier is made for camera boards"),
    "camera.board_hole_mm": (10.0, 58.0, "the carrier is made for camera boards"),
    "camera.lens_mm": (6.0, 30.0, "the carrier is made for M12 lenses"),
    "camera.lens_ahead_mm": (8.0, 60.0, "the carrier is made for M12 lenses"),
    "frame.section_mm": (10.0, 60.0, "beams are printed"),
    "frame.inlet_length_mm": (30.0, 200.0, "the phantom is pushed over the inlet by 26 mm"),
    "frame.rod_mm": (4.0, 12.0, "threaded rods that hold a camera still are M4 to M12"),
    "frame.rod_play_mm": (0.1, 1.0, "rods must pass the beams' holes, and the frame must not be loose"),
    "panel.thickness_mm": (2.0, 8.0, "thinner sheets sag and thicker ones do not lie in the frame"),
    "panel.plate_mm": (3.0, 12.0, "thinner plates sag under a camera and thicker ones are not cut by a laser"),
    "panel.overlap_mm": (4.0, 30.0, "the panels lie on the frame by so much"),
    "panel.kerf_mm": (0.0, 0.6, "no laser burns away more"),
    "panel.play_mm": (0.0, 1.0, "with more the panels do not lie still"),
    "light.gap_mm": (8.0, 100.0, "LEDs nearer to the diffuser show as spots, and farther ones are weak"),
    "light.pitch_mm": (10.0, 60.0, "a strip is 10 mm wide"),
    "light.watt_per_m": (1.0, 30.0, "a box of PMMA does not carry off more heat"),
    "light.least_share": (0.0, 1.0, "it is a share"),
    "magnet.diameter_mm": (3.0, 15.0, "smaller ones do not hold a panel"),
    "magnet.height_mm": (1.0, 8.0, "thinner ones do not hold a panel"),
    "printer.bed_mm": (100.0, 2000.0, "the parts are made for printers of this kind"),
    "printer.least_wall_mm": (0.4, 3.0, "nozzles of 0.2 to 1.5 mm make walls of two lines"),
    "gear.module_mm": (0.5, 3.0, "finer teeth are not printed well, and coarser ones need a table of their own"),
    "gear.catheter_teeth": (8, 250, "more are not printed well"),
    "gear.encoder_teeth": (8, 250, "more are not printed well"),
    "gear.face_mm": (3.0, 20.0, "the teeth run between the bearings, 22 mm apart"),
    "gear.pressure_deg": (14.5, 30.0, "gears are made with 14.5 to 30 degrees, mostly 20"),
    "gear.thinning_mm": (0.0, 1.0, "more leaves no tooth"),
    "gear.centre_error_mm": (0.0, 0.5, "a printer that is farther off does not make gears"),
    "encoder.pulses": (16, 10_000, "incremental encoders have no other numbers"),
    "encoder.body_mm": (15.0, 60.0, "the encoder's plate is made for such encoders"),
    "encoder.body_length_mm": (5.0, 80.0, "the encoder's plate is made for such encoders"),
    "encoder.boss_mm": (5.0, 50.0, "the encoder's plate is made for such encoders"),
    "encoder.shaft_mm": (3.0, 10.0, "the encoder's gear has a hub of 15 mm"),
    "encoder.bolt_circle_mm": (10.0, 55.0, "the encoder's plate is made for such encoders"),
}  # fmt: skip
"""By "table.key": least, greatest, and why."""


def limit_refusals(parameters: Parameters) -> Iterator[str]:
    """Yield a sentence for every parameter that lies outside what can be made, whatever the others are."""
    for group in dataclasses.fields(Parameters):
        values = getattr(parameters, group.name)
        if isinstance(values, str):
            continue
        for each in dataclasses.fields(values):
            found = LIMITS.get(f"{group.name}.{each.name}")
            if found is None:
                continue
            least, most, why = found
            value = getattr(values, each.name)
            for one in value if isinstance(value, tuple) else (value,):
                if not least <= one <= most:
                    yield f"{group.name}.{each.name}: {one:g} does not lie between {least:g} and {most:g}: {why}."
