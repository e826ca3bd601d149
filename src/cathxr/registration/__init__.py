"""How the box lies in the heart: the registration, its file, its errors, and the placement that needs no landmarks."""

from cathxr.registration.doubts import Doubt
from cathxr.registration.errors import fitzpatrick_tre_mm, predicted_tre_mm
from cathxr.registration.file import (
    read_registration,
    registration_from_table,
    registration_toml,
    write_registration,
)
from cathxr.registration.model import Kind, LandmarkPair, Registration
from cathxr.registration.placement import AXIS, BEFORE_MM, caval_placement, default_placement
from cathxr.registration.solve import Solution, register

__all__ = [
    "AXIS",
    "BEFORE_MM",
    "Doubt",
    "Kind",
    "LandmarkPair",
    "Registration",
    "Solution",
    "caval_placement",
    "default_placement",
    "fitzpatrick_tre_mm",
    "predicted_tre_mm",
    "read_registration",
    "register",
    "registration_from_table",
    "registration_toml",
    "write_registration",
]
