"""The simulated ICE image: what an intracardiac transducer would show of an acoustic volume (docs/ultrasound.md)."""

from cathxr.ultrasound.fan import FanPicture, fan_picture
from cathxr.ultrasound.field import AcousticField, Scales
from cathxr.ultrasound.image import PolarImage, simulate
from cathxr.ultrasound.probe import ct_from_transducer
from cathxr.ultrasound.settings import IceSettings, Resolved

__all__ = [
    "AcousticField",
    "FanPicture",
    "IceSettings",
    "PolarImage",
    "Resolved",
    "Scales",
    "ct_from_transducer",
    "fan_picture",
    "simulate",
]
