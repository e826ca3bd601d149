"""Where the box lies in a heart: what was measured, else by the venae cavae."""

from cathxr.core import ConfigError
from cathxr.heart import HeartFolder
from cathxr.registration import Registration, caval_placement, read_registration


def registration_of(heart: HeartFolder) -> Registration:
    """Return a heart's registration; without one, the inlet sits before the mouth of the inferior vena cava.

    Raises:
        ConfigError: there is none, and the heart names no caval openings to place it by.
    """
    if heart.registration is not None:
        return read_registration(heart.registration)
    placed = caval_placement(heart.points_ct, method="inlet before the inferior vena cava's mouth")
    if placed is None:
        raise ConfigError(
            f"The heart {heart.path} has no registration.toml, and no openings inferior_vena_cava and "
            "superior_vena_cava to place it by: add one of them."
        )
    return placed
