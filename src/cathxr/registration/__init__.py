"""How the box lies in the heart: the registration, its file, and the placement that needs no landmarks."""

from cathxr.registration.file import read_registration, registration_toml, write_registration
from cathxr.registration.model import Kind, LandmarkPair, Registration
from cathxr.registration.placement import default_placement

__all__ = [
    "Kind",
    "LandmarkPair",
    "Registration",
    "default_placement",
    "read_registration",
    "registration_toml",
    "write_registration",
]
