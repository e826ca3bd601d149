"""Involute spur gears: outline, membership, play, contact ratio. Plane geometry in mm and rad; no undercut is modelled.

Formulae: the involute of a circle and the play of a pair at another centre distance than the nominal one, as in any
textbook of machine elements (for example DIN 3960, now ISO 21771).
"""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.parameters import EncoderChoice, GearChoice

_DEDENDUM = 1.25


@dataclass(frozen=True)
class SpurGear:
    """One gear. thinning_mm: taken off the tooth's width at the pitch circle, for play."""

    teeth: int
    module_mm: float
    pressure_rad: float
    thinning_mm: float = 0.0

    @property
    def pitch_mm(self) -> float:
        """The pitch radius."""
        return 0.5 * self.module_mm * self.teeth

    @property
    def base_mm(self) -> float:
        """The base circle's radius."""
        return self.pitch_mm * float(np.cos(self.pressure_rad))

    @property
    def tip_mm(self) -> float:
        """The tip circle's radius."""
        return self.pitch_mm + self.module_mm

    @property
    def root_mm(self) -> float:
        """The root circle's radius."""
        return self.pitch_mm - _DEDENDUM * self.module_mm

    @property
    def tooth_rad(self) -> float:
        """The angle from one tooth to the next."""
        return 2.0 * float(np.pi) / self.teeth

    def half_tooth_rad(self, radius_mm: FloatArray) -> FloatArray:
        """Return half the angle that a tooth takes at each radius; below the base circle its flanks are radial."""
        width = 0.5 * np.pi * self.module_mm - self.thinning_mm
        cosine = np.minimum(1.0, self.base_mm / np.maximum(radius_mm, 1e-9))
        return np.asarray(
            0.5 * width / self.pitch_mm + involute(self.pressure_rad) - involute(np.arccos(cosine)), dtype=np.float64
        )

    def flank(self, points: int = 12) -> FloatArray:
        """Return one tooth's right flank (points, 2) as radius and angle from the tooth's middle, root to tip."""
        start = max(self.root_mm, self.base_mm)
        radii = np.linspace(start, self.tip_mm, points)
        if self.root_mm < start:
            radii = np.concatenate([[self.root_mm], radii])
        return np.column_stack([radii, self.half_tooth_rad(radii)])

    def outline(self, points: int = 8) -> FloatArray:
        """Return the closed outline (N, 2), anticlockwise, with a tooth's middle on the x axis."""
        flank = self.flank(points)
        tooth = np.concatenate([flank * (1.0, -1.0), flank[::-1]])
        turned = tooth[None] + np.arange(self.teeth)[:, None, None] * np.array([0.0, self.tooth_rad])
        radius, angle = turned.reshape(-1, 2).T
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])

    def depth_inside(self, points: FloatArray) -> FloatArray:
        """Return how far points (N, 2) are inside the gear, mm along the circle; negative outside."""
        radius = np.hypot(points[:, 0], points[:, 1])
        angle = np.arctan2(points[:, 1], points[:, 0])
        off = np.abs(angle - self.tooth_rad * np.round(angle / self.tooth_rad))
        depth = (self.half_tooth_rad(radius) - off) * radius
        depth = np.where(radius > self.tip_mm, self.tip_mm - radius, depth)
        return np.asarray(np.where(radius < self.root_mm, self.root_mm - radius + np.abs(depth), depth))


@dataclass(frozen=True)
class Mesh:
    """How a pair runs at one centre distance. play_deg: at the catheter; clearance_mm: from tips to roots."""

    centre_mm: float
    play_deg: float
    contact_ratio: float
    clearance_mm: float


def involute(angle_rad: float | FloatArray) -> FloatArray:
    """Return the involute function tan a - a."""
    return np.asarray(np.tan(angle_rad) - angle_rad, dtype=np.float64)


def gear_pair(choice: GearChoice) -> tuple[SpurGear, SpurGear]:
    """Return the catheter's gear and the encoder's."""
    pressure = float(np.deg2rad(choice.pressure_deg))
    first, second = (
        SpurGear(teeth, choice.module_mm, pressure, choice.thinning_mm)
        for teeth in (choice.catheter_teeth, choice.encoder_teeth)
    )
    return first, second


def centre_mm(choice: GearChoice) -> float:
    """Return the nominal centre distance."""
    return 0.5 * choice.module_mm * (choice.catheter_teeth + choice.encoder_teeth)


def mesh(choice: GearChoice, *, off_mm: float = 0.0) -> Mesh:
    """Return how the pair runs when its centres are `off_mm` farther apart than nominal (negative: nearer)."""
    first, second = gear_pair(choice)
    nominal = centre_mm(choice)
    centre = nominal + off_mm
    least = first.base_mm + second.base_mm
    working = float(np.arccos(min(1.0, least / centre)))
    scale = centre / nominal
    # Tooth widths and pitch, as angles at the catheter's gear on the working pitch circles.
    grown = float(involute(first.pressure_rad) - involute(working))
    width = 0.5 * np.pi * choice.module_mm - choice.thinning_mm
    widths = sum(2.0 * each.pitch_mm * scale * (0.5 * width / each.pitch_mm + grown) for each in (first, second))
    play = (np.pi * choice.module_mm * scale - widths) / (first.pitch_mm * scale)
    path = sum(np.sqrt(each.tip_mm**2 - each.base_mm**2) for each in (first, second)) - centre * np.sin(working)
    return Mesh(
        centre_mm=centre,
        play_deg=float(np.rad2deg(play)),
        contact_ratio=float(path / (np.pi * choice.module_mm * np.cos(first.pressure_rad))),
        clearance_mm=float(centre - max(first.tip_mm + second.root_mm, second.tip_mm + first.root_mm)),
    )


def tip_width_mm(gear: SpurGear) -> float:
    """Return how wide a tooth is at its tip; negative: its flanks meet below."""
    return 2.0 * gear.tip_mm * float(gear.half_tooth_rad(np.array([gear.tip_mm]))[0])


def backlash_deg(choice: GearChoice) -> float:
    """Return the play at the catheter, degrees, at the nominal centre distance and without the spring."""
    return mesh(choice).play_deg


def degrees_per_count(gear: GearChoice, encoder: EncoderChoice) -> float:
    """Return the catheter's turn for one count after x4 decoding."""
    return 360.0 * gear.encoder_teeth / (4.0 * encoder.pulses * gear.catheter_teeth)


def measured_play_deg(choice: GearChoice, *, off_mm: float = 0.0, steps: int = 24) -> tuple[float, float]:
    """Return (least, greatest) play at the catheter, degrees, over one tooth, found by turning drawn gears to contact.

    Independent of `mesh`: flanks are tested for lying in the other gear, at `steps` positions of the encoder's gear.
    """
    first, second = gear_pair(choice)
    centre = centre_mm(choice) + off_mm
    flank = second.flank(60)
    plays = []
    for step in range(steps):
        turned = step / steps * second.tooth_rad
        points = _flanks(second, flank, turned)
        points[:, 0] += centre
        middle = -turned * second.teeth / first.teeth + _facing(first, second)
        low, high = (_contact(first, points, middle, sign) for sign in (-1.0, 1.0))
        plays.append(float(np.rad2deg(high - low)))
    return min(plays), max(plays)


def _facing(first: SpurGear, second: SpurGear) -> float:
    """Return the turn of the first gear that puts a gap opposite a tooth of the second on the line of centres."""
    # A tooth of the second lies at angle pi (towards the first) only when its number is even.
    shift = 0.0 if second.teeth % 2 == 0 else 0.5 * second.tooth_rad * second.teeth / first.teeth
    return 0.5 * first.tooth_rad + shift


def _flanks(gear: SpurGear, flank: FloatArray, turned: float) -> FloatArray:
    """Return both flanks of the teeth near angle pi, as points (N, 2)."""
    near = np.arange(gear.teeth)
    angles = near * gear.tooth_rad + turned
    near = near[np.abs(np.angle(np.exp(1j * (angles - np.pi)))) < 2.6 * gear.tooth_rad]
    radius = np.tile(flank[:, 0], 2 * len(near))
    signed = np.concatenate([flank[:, 1], -flank[:, 1]])
    angle = (near[:, None] * gear.tooth_rad + turned + signed[None]).ravel()
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def _contact(gear: SpurGear, points: FloatArray, middle: float, sign: float) -> float:
    """Return the first gear's turn, from `middle` towards `sign`, at which points (N, 2) begin to lie inside it."""
    free, blocked = 0.0, 0.5 * gear.tooth_rad
    if _deepest(gear, points, middle) > 0:
        return middle - sign * blocked  # jammed: a negative play
    for _ in range(40):
        half = 0.5 * (free + blocked)
        if _deepest(gear, points, middle + sign * half) > 0:
            blocked = half
        else:
            free = half
    return middle + sign * free


def _deepest(gear: SpurGear, points: FloatArray, turned: float) -> float:
    cosine, sine = np.cos(turned), np.sin(turned)
    x, y = points.T
    return float(gear.depth_inside(np.column_stack([cosine * x + sine * y, cosine * y - sine * x])).max())
