"""Everything that a builder can choose about the rig, in one frozen record. Lengths in mm unless the name says else."""

from dataclasses import dataclass, field

FRENCH_MM = 1.0 / 3.0
"""The diameter of one French."""
INLET_SIZES_FR = (6, 7, 8, 9, 10, 11, 12, 13, 14)
"""The catheters for which an inlet is made, French."""


@dataclass(frozen=True)
class RoiChoice:
    """side_mm: of the cube in which the catheter is tracked; it begins at the inlet (x = 0), centred in y and z."""

    side_mm: float = 120.0


@dataclass(frozen=True)
class CatheterChoice:
    """french: the size that the rig file, the assembly and the phantom are made for. name: as the rig file says it."""

    name: str = "9F ICE"
    french: int = 9

    @property
    def diameter_mm(self) -> float:
        """The catheter's diameter."""
        return self.french * FRENCH_MM


@dataclass(frozen=True)
class CameraChoice:
    """Both cameras. distance_mm: from the lens's optical centre to the ROI's centre.

    pixel_um, focal_mm, f_number: of sensor and lens; board_mm: side of the square camera board; board_hole_mm: side of
    the square of its four screw holes; lens_mm: greatest diameter of lens and holder; lens_ahead_mm: from the board's
    front to the optical centre.
    """

    distance_mm: float = 330.0
    width_px: int = 1280
    height_px: int = 720
    rate_hz: float = 60.0
    pixel_um: float = 3.0
    focal_mm: float = 4.0
    f_number: float = 4.0
    board_mm: float = 38.0
    board_hole_mm: float = 34.0
    lens_mm: float = 16.0
    lens_ahead_mm: float = 18.0


@dataclass(frozen=True)
class FrameChoice:
    """The cubic frame. section_mm: of its beams; inlet_length_mm: the inlet's free length, which sets the size.

    rod_mm: the threaded rods through the beams; rod_play_mm: by how much their holes are wider.
    """

    section_mm: float = 24.0
    inlet_length_mm: float = 40.0
    rod_mm: float = 6.0
    rod_play_mm: float = 0.4


@dataclass(frozen=True)
class PanelChoice:
    """Panels. plate_mm: thickness of those that carry cameras and LEDs; overlap_mm: of a panel on the frame, each side.

    kerf_mm: what the laser burns away.
    """

    thickness_mm: float = 3.0
    plate_mm: float = 5.0
    overlap_mm: float = 10.0
    kerf_mm: float = 0.18
    play_mm: float = 0.3


@dataclass(frozen=True)
class LightChoice:
    """The light boxes. gap_mm: from LEDs to diffuser; pitch_mm: between LED strips; watt_per_m: of a strip."""

    gap_mm: float = 30.0
    pitch_mm: float = 20.0
    watt_per_m: float = 9.6
    least_share: float = 0.99


@dataclass(frozen=True)
class MagnetChoice:
    """Round neodymium magnets, which hold the panels."""

    diameter_mm: float = 6.0
    height_mm: float = 3.0


@dataclass(frozen=True)
class PrinterChoice:
    """What the printer can do. bed_mm: width, depth, height of what it prints; least_wall_mm: thinnest sound wall."""

    bed_mm: tuple[float, float, float] = (250.0, 210.0, 220.0)
    least_wall_mm: float = 1.2


@dataclass(frozen=True)
class GearChoice:
    """The roll unit's gears. thinning_mm: taken off each tooth's width at the pitch circle.

    centre_error_mm: how far the printed centre distance may be off, either way.
    """

    module_mm: float = 1.0
    catheter_teeth: int = 48
    encoder_teeth: int = 24
    face_mm: float = 10.0
    pressure_deg: float = 20.0
    thinning_mm: float = 0.07
    centre_error_mm: float = 0.15


@dataclass(frozen=True)
class EncoderChoice:
    """The encoder. pulses: per turn, before x4; body, boss, shaft: diameters; bolt_circle_mm: of its three M3 holes."""

    pulses: int = 600
    body_mm: float = 38.0
    body_length_mm: float = 36.0
    boss_mm: float = 20.0
    shaft_mm: float = 6.0
    bolt_circle_mm: float = 28.0


@dataclass(frozen=True)
class Parameters:
    """One rig. Groups bear the names of params.toml's tables."""

    name: str = "cathxr box"
    roi: RoiChoice = field(default_factory=RoiChoice)
    catheter: CatheterChoice = field(default_factory=CatheterChoice)
    camera: CameraChoice = field(default_factory=CameraChoice)
    frame: FrameChoice = field(default_factory=FrameChoice)
    panel: PanelChoice = field(default_factory=PanelChoice)
    light: LightChoice = field(default_factory=LightChoice)
    magnet: MagnetChoice = field(default_factory=MagnetChoice)
    printer: PrinterChoice = field(default_factory=PrinterChoice)
    gear: GearChoice = field(default_factory=GearChoice)
    encoder: EncoderChoice = field(default_factory=EncoderChoice)
