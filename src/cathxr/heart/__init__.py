"""The heart: the folder that holds one, and the built-in one."""

from pathlib import Path

from cathxr.heart.folder import heart_toml, read_heart
from cathxr.heart.model import AcousticFile, HeartFolder, HeartSource, Landmark, Opening, Structure

__all__ = [
    "AcousticFile",
    "HeartFolder",
    "HeartSource",
    "Landmark",
    "Opening",
    "Structure",
    "builtin_path",
    "heart_toml",
    "read_heart",
]


def builtin_path() -> Path:
    """Return the folder of the built-in heart, which comes with the package."""
    return Path(__file__).resolve().parent / "builtin"
