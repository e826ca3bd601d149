"""Where everything is, from the parameters: the one place in which a length follows from another. mm, frame `box`."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.gears import gear_pair
from cathxr.hardware.parameters import Parameters

MARKER_RADIUS_MM = 3.0
ARM_GAP_MM = 5.0
"""From the plane of a cross's balls to its arms, as the twin has them."""
ARM_WIDTH_MM, ARM_THICK_MM, ARM_BEYOND_MM = 10.0, 3.0, 6.0
INLET_SIDE_MM = 30.0
BORE_PLAY_MM = 0.35
COLOURS = ("red", "green", "blue", "yellow")
NOTCH_MM = 6.0
"""Depth of the beams' notches, along each face, in which the crosses' legs end."""
PANEL_REST_MM = 14.0
"""From the camera panel to the camera board's front: springs, the carrier and its stand-offs."""
CARRIER_MM, STANDOFF_MM = 4.0, 2.0
RAIL_LENGTH_MM = 250.0
HUB_MM = 26.0
"""The catheter gear's hub: what a lock's cone for 14F and a wall around it need."""
HOLDER_FLANGE_MM, HOLDER_SCREW_MM = 56.0, 22.0
"""The inlet holder's flange, and from its middle to its screws, in both directions."""
INSERT_MM = 16.0
JIG_SIDE_MM, JIG_MAGNET_MM = 22.0, 16.0
INSERT_FLANGE_MM = 5.0
HOLDER_PLATE_MM = 6.0
"""Thickness of the inlet holder's flange; an insert's and the jig's are INSERT_FLANGE_MM thick."""
TILT_RADIUS_MM = 31.0
"""From a camera's axis to the three screws by which it is tilted."""
ROLL_BASE_MM, RAIL_STACK_MM = 6.0, 13.0
"""Thickness of the roll unit's base; height of an MGN12 rail with its carriage."""
BEARING_HALF_MM = 0.5 * HUB_MM + 10.0
"""Half the width of the walls that carry the catheter gear."""
SMALL_HUB_MM = 15.0
"""The encoder gear's hub."""
BRACKET_GUSSET_MM = 34.0
"""How far the rail's bracket is stiffened below the rail's plate."""


@dataclass(frozen=True)
class Layout:
    """Derived lengths. `Layout(parameters)`; nothing is checked here (see `rules`)."""

    parameters: Parameters

    @cached_property
    def half_mm(self) -> float:
        """Half the ROI's side."""
        return 0.5 * self.parameters.roi.side_mm

    @cached_property
    def centre(self) -> FloatArray:
        """The ROI's and the frame's centre (3,)."""
        return np.array([self.half_mm, 0.0, 0.0])

    @cached_property
    def inner_mm(self) -> float:
        """From the centre to the beams' inner faces."""
        return self.half_mm + self.parameters.frame.inlet_length_mm

    @cached_property
    def outer_mm(self) -> float:
        """From the centre to the frame's outer faces."""
        return self.inner_mm + self.parameters.frame.section_mm

    @cached_property
    def ledge_mm(self) -> float:
        """From the centre to the ledge on which the panels lie: their inner face."""
        return self.outer_mm - self.parameters.panel.thickness_mm - 0.2

    @cached_property
    def beam_mm(self) -> float:
        """The length of a beam, between two corners."""
        return 2.0 * self.inner_mm

    @cached_property
    def rod_hole_mm(self) -> float:
        """The diameter of the holes for the rods."""
        return self.parameters.frame.rod_mm + self.parameters.frame.rod_play_mm

    @cached_property
    def rod_offset_mm(self) -> float:
        """From a beam's middle to its rod, outwards in one direction and inwards in the other; so the rods pass."""
        return 0.5 * (self.rod_hole_mm + 1.6)

    @cached_property
    def rod_out_mm(self) -> float:
        """From the centre to a rod, in the direction in which it lies outwards."""
        return self.inner_mm + 0.5 * self.parameters.frame.section_mm + self.rod_offset_mm

    @cached_property
    def rod_in_mm(self) -> float:
        """From the centre to a rod, in the direction in which it lies inwards."""
        return self.inner_mm + 0.5 * self.parameters.frame.section_mm - self.rod_offset_mm

    @cached_property
    def panel_side_mm(self) -> float:
        """The side of a square panel that lies in the frame's rebate."""
        panel = self.parameters.panel
        return 2.0 * (self.inner_mm + panel.overlap_mm - panel.play_mm)

    @cached_property
    def plate_side_mm(self) -> float:
        """The side of the square plates on the long rods, which carry cameras and LEDs."""
        return 2.0 * (self.rod_out_mm + 10.0)

    @cached_property
    def led_mm(self) -> float:
        """From the centre to the LED plates' inner faces."""
        return self.outer_mm + self.parameters.light.gap_mm

    @cached_property
    def camera_panel_mm(self) -> float:
        """From the centre to the camera panels' inner faces (towards the box)."""
        camera = self.parameters.camera
        return camera.distance_mm + camera.lens_ahead_mm - PANEL_REST_MM - self.parameters.panel.plate_mm

    @cached_property
    def long_rod_mm(self) -> float:
        """The length of a rod that carries a camera and a light box, with nuts at both ends."""
        ends = 2.0 * (self.parameters.panel.plate_mm + 10.0)
        return self.camera_panel_mm + self.led_mm + ends

    @cached_property
    def short_rod_mm(self) -> float:
        """The length of a rod along x, with nuts at both ends."""
        return 2.0 * (self.outer_mm + 10.0)

    @cached_property
    def roll_deck_mm(self) -> float:
        """z of the roll unit's deck, below both gears and the encoder with its pivot."""
        tips = [each.tip_mm for each in gear_pair(self.parameters.gear)]
        return -max(max(tips) + 4.0, 0.5 * self.parameters.encoder.body_mm + 10.0)

    @cached_property
    def rail_plate_mm(self) -> float:
        """z of the underside of the plate under the rail."""
        return self.roll_deck_mm - ROLL_BASE_MM - RAIL_STACK_MM - self.parameters.panel.plate_mm

    @cached_property
    def bracket_screw_mm(self) -> float:
        """z of the two screws by which the rail's bracket holds on the lower beam."""
        return -self.inner_mm - 0.5 * self.parameters.frame.section_mm - self.rod_offset_mm - 1.0

    @cached_property
    def bore_mm(self) -> float:
        """The inlet's bore."""
        return bore_mm(self.parameters.catheter.french)

    @cached_property
    def focal_px(self) -> float:
        """The focal length in pixels."""
        return self.parameters.camera.focal_mm / self.parameters.camera.pixel_um * 1000.0

    @cached_property
    def window_half_mm(self) -> float:
        """Half the window in the masks before the cameras: what the ROI needs there, with a margin."""
        camera = self.parameters.camera
        near = camera.distance_mm - self.half_mm
        return self.half_mm * (camera.distance_mm - self.ledge_mm) / near + 10.0

    @cached_property
    def wall_u_mm(self) -> float:
        """From the centre to the light boxes' walls: their inner faces, just outside the diffuser."""
        return self.inner_mm + self.parameters.panel.overlap_mm + 1.0

    @cached_property
    def arm_reach_mm(self) -> float:
        """From a cross's middle to the end of its one-piece arms."""
        return float(self.half_mm * np.sqrt(2.0)) + ARM_BEYOND_MM

    @cached_property
    def segments(self) -> int:
        """Of how many pieces a beam is printed, so that each fits the bed."""
        return int(np.ceil(self.beam_mm / (max(self.parameters.printer.bed_mm[:2]) - 2.0)))

    @cached_property
    def cross_core_mm(self) -> float:
        """The side of the square around a cross's one-piece middle."""
        return float(np.sqrt(2.0) * self.arm_reach_mm + ARM_WIDTH_MM / np.sqrt(2.0))

    @cached_property
    def marker_places(self) -> dict[str, FloatArray]:
        """The fiducials' places (4, 3) by camera, in the order red, green, blue, yellow."""
        a, b = 2.0 * self.half_mm, self.half_mm
        top = np.array([[0.0, -b, 0.0], [a, -b, 0.0], [a, b, 0.0], [0.0, b, 0.0]])
        return {"top": top, "front": top[:, [0, 2, 1]]}


def bore_mm(french: int) -> float:
    """Return the bore of an inlet for a catheter of so many French."""
    return french / 3.0 + BORE_PLAY_MM
