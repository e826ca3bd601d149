"""Named scenes: one for each category of trouble that a tracker must live with."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from cathxr.core import ConfigError
from cathxr.twin.settings import WHITE, TwinSettings

_RED, _BLUE, _YELLOW = (0.12, 0.12, 0.70), (0.65, 0.25, 0.10), (0.10, 0.75, 0.80)
_WALL = TwinSettings(background="coloured", front_light=0.85, transmission=0.0, back_light=0.0)
_FRONT_LIT = TwinSettings(catheter=False, back_light=0.32, front_light=0.85, specular=0.12)

SCENES: Mapping[str, TwinSettings] = MappingProxyType(
    {
        "smooth": TwinSettings(),
        "still": TwinSettings(manoeuvre="still"),
        "rest": TwinSettings(manoeuvre="rest"),
        "fast": TwinSettings(manoeuvre="fast", exposure_ms=8.0),
        "quick": TwinSettings(manoeuvre="quick", exposure_ms=8.0),
        "flexion": TwinSettings(manoeuvre="flexion"),
        "roll": TwinSettings(manoeuvre="roll"),
        "insertion": TwinSettings(manoeuvre="full_range"),
        "curl": TwinSettings(manoeuvre="curl"),
        "crossing": TwinSettings(manoeuvre="crossing"),
        "full_range": TwinSettings(manoeuvre="full_range"),
        "at_a_camera": TwinSettings(manoeuvre="at_a_camera"),
        "timing": TwinSettings(manoeuvre="timing"),
        "low_contrast": TwinSettings(transmission=0.78, specular=0.0),
        "translucent": TwinSettings(transmission=0.45),
        "noisy": TwinSettings(gain=8.0, read_noise_dn=4.0, back_light=0.5),
        "flicker": TwinSettings(flicker=0.12, flicker_hz=101.7, exposure_drift=0.08, white_balance_drift=0.04),
        "vignetting": TwinSettings(vignetting=0.75, unevenness=0.2),
        "saturated": TwinSettings(back_light=1.15, unevenness=0.15),
        "wall": TwinSettings(wall=True),
        "debris": TwinSettings(debris=60, bubbles=14),
        "bubbles": TwinSettings(bubbles=30),
        "glare": TwinSettings(glare_spots=5, specular=0.5),
        "white": replace(_WALL, colours=(WHITE,)),
        "coloured": replace(_WALL, colours=(WHITE, _RED, WHITE, _BLUE, _YELLOW), band_mm=7.0),
        "rolling_shutter": TwinSettings(manoeuvre="fast", exposure_ms=6.0, readout_ms=16.0),
        "mjpg": TwinSettings(jpeg_quality=82),
        "skew": TwinSettings(manoeuvre="fast", front_skew_ms=12.0),
        "dropouts": TwinSettings(drop_share=0.15),
        "empty": TwinSettings(catheter=False),
        "empty_wall": replace(_WALL, catheter=False),
        "pillars": replace(_FRONT_LIT, pillars="both"),
        "pillar_top": replace(_FRONT_LIT, pillars="top"),
        "pillar_front": replace(_FRONT_LIT, pillars="front"),
        "black_picture": TwinSettings(fault="black"),
        "white_picture": TwinSettings(fault="white"),
        "frozen_picture": TwinSettings(fault="frozen"),
    }
)


def scene(name: str) -> TwinSettings:
    """Return the settings of a named scene.

    Raises:
        ConfigError: no such scene.
    """
    if name not in SCENES:
        raise ConfigError(f"There is no scene {name!r} in the twin; it has {', '.join(SCENES)}.")
    return SCENES[name]
