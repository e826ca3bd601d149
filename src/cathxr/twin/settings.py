"""Everything that can be chosen about the simulated vision box, in one frozen record."""

import math
from dataclasses import dataclass

Colour = tuple[float, float, float]
"""Reflectance in blue, green, red, each 0 to 1."""

BLACK: Colour = (0.075, 0.07, 0.07)
WHITE: Colour = (0.86, 0.88, 0.88)

_BACKGROUNDS = ("back_lit", "coloured")
_PILLARS = ("none", "top", "front", "both")
_FAULTS = ("", "black", "white", "frozen")
_SHARES = (
    "transmission",
    "specular",
    "vignetting",
    "unevenness",
    "flicker",
    "exposure_drift",
    "white_balance_drift",
    "glare_level",
    "drop_share",
    "front_unevenness",
    "occlusion_share",
)
_NOT_NEGATIVE = (
    "back_light",
    "front_light",
    "band_mm",
    "flicker_hz",
    "glare_spots",
    "coloured_clutter",
    "debris",
    "bubbles",
    "exposure_ms",
    "readout_ms",
    "lens_blur_px",
    "read_noise_dn",
    "black_level_dn",
    "encoder_backlash_deg",
)
_FINITE = ("torsion_deg_per_mm", "torsion_deg_per_quarter_bend")
_POSITIVE = ("gain", "electrons_per_dn", "gamma", "encoder_rate_hz")


@dataclass(frozen=True)
class TwinSettings:
    """The choices of one scene. Shares are 0 to 1; levels are in full scales of the sensor (255): over 1 saturates.

    What moves:
        manoeuvre: name of the script that moves the catheter (see `manoeuvres.NAMES`).
        catheter: whether there is a catheter at all.
        entry_tilt_deg: greatest tilt of the catheter in the inlet, by seed. memory_deg_per_mm: its body's own bend.
        torsion_deg_per_mm, torsion_deg_per_quarter_bend: by how much the tip is twisted ahead of the handle, for each
        mm inserted and for each 90 degrees of bend; of the tip's frame only, the shape is what it is without.
    How the catheter looks:
        colours: its bands' reflectances from the tip on, each `band_mm` long (one colour: no bands).
        transmission: the share of the back-light that shines through it. specular: strength of its shine.
    Light:
        back_light, front_light: levels of the diffuser behind the scene and of what falls on a white surface.
        vignetting: loss in the picture's corner. unevenness: slow variation of the diffuser, by seed.
        background: "back_lit", or "coloured" for a static, matt, front-lit wall.
        flicker: amplitude of the lamp's flicker at flicker_hz. exposure_drift, white_balance_drift: slow gain changes.
        front_unevenness: slow variation of the front light over the picture, by seed. cast: gains of all light in blue,
        green, red. glare_spots: reflections on the window, each of strength glare_level.
    Lens and sensor:
        exposure_ms: open time of each row. readout_ms: from the first row to the last (0: global shutter).
        lens_blur_px: standard deviation of the lens's point spread. gain: multiplies the noise; the light is taken to
        be set so that the picture is as bright. electrons_per_dn: at gain 1. gamma: 1 is a linear camera.
        jpeg_quality: 1 to 100 for a camera that sends MJPG, None for raw.
    Things in the box:
        inlet: the block that the catheter comes out of. wall: the dark end wall that carries it. pillars: which
        crosses with the rig's colour fiducials are in, "none", "top", "front" or "both". coloured_clutter: how many
        small things of the fiducials' colours lie about beside the crosses. occluded_markers: names of fiducials with
        a finger on them; occlusion_share: of the diameter, hidden from the cross's own camera (1: from everyone).
        debris, bubbles: how many drift through.
    Delivery:
        drop_share: pictures that never arrive. front_skew_ms: the front camera exposes this much later.
        fault: "", "black", "white" or "frozen" pictures. encoder_backlash_deg: play of the gears, at the catheter.
    """

    manoeuvre: str = "smooth"
    catheter: bool = True
    entry_tilt_deg: float = 2.0
    memory_deg_per_mm: float = 0.12
    colours: tuple[Colour, ...] = (BLACK,)
    band_mm: float = 10.0
    transmission: float = 0.02
    specular: float = 0.03
    back_light: float = 0.82
    front_light: float = 0.35
    vignetting: float = 0.28
    unevenness: float = 0.05
    background: str = "back_lit"
    flicker: float = 0.0
    flicker_hz: float = 100.0
    exposure_drift: float = 0.0
    white_balance_drift: float = 0.0
    front_unevenness: float = 0.0
    cast: Colour = (1.0, 1.0, 1.0)
    glare_spots: int = 0
    glare_level: float = 0.8
    exposure_ms: float = 4.0
    readout_ms: float = 0.0
    lens_blur_px: float = 0.7
    gain: float = 1.0
    electrons_per_dn: float = 40.0
    read_noise_dn: float = 1.0
    black_level_dn: float = 4.0
    gamma: float = 1.0
    jpeg_quality: int | None = None
    inlet: bool = True
    pillars: str = "none"
    coloured_clutter: int = 0
    occluded_markers: tuple[str, ...] = ()
    occlusion_share: float = 1.0
    wall: bool = False
    debris: int = 0
    bubbles: int = 0
    drop_share: float = 0.0
    front_skew_ms: float = 0.0
    fault: str = ""
    encoder_backlash_deg: float = 0.0
    torsion_deg_per_mm: float = 0.0
    torsion_deg_per_quarter_bend: float = 0.0
    encoder_rate_hz: float = 200.0

    def __post_init__(self) -> None:
        for name in _SHARES:
            _check(0.0 <= getattr(self, name) <= 1.0, name, "a share from 0 to 1", getattr(self, name))
        for name in _NOT_NEGATIVE:
            _check(getattr(self, name) >= 0, name, "a number of at least 0", getattr(self, name))
        for name in _POSITIVE:
            _check(getattr(self, name) > 0, name, "a positive number", getattr(self, name))
        for name in _FINITE:
            _check(math.isfinite(getattr(self, name)), name, "a finite number", getattr(self, name))
        _check(self.background in _BACKGROUNDS, "background", f"one of {', '.join(_BACKGROUNDS)}", self.background)
        _check(self.pillars in _PILLARS, "pillars", f"one of {', '.join(_PILLARS)}", self.pillars)
        lit = len(self.cast) == 3 and all(0.1 <= part <= 3.0 for part in self.cast)
        _check(lit, "cast", "three gains from 0.1 to 3 (blue, green, red)", self.cast)
        _check(self.fault in _FAULTS, "fault", "black, white, frozen or nothing", self.fault)
        quality = self.jpeg_quality
        _check(quality is None or 1 <= quality <= 100, "jpeg_quality", "1 to 100, or None for raw pictures", quality)
        _check(len(self.colours) > 0, "colours", "at least one colour", self.colours)
        proper = all(len(each) == 3 and all(0.0 <= part <= 1.0 for part in each) for each in self.colours)
        _check(proper, "colours", "three shares from 0 to 1 (blue, green, red) each", self.colours)


def _check(good: bool, name: str, expected: str, got: object) -> None:
    if not good:
        raise ValueError(f"{name}: expected {expected}, got {got!r}")
