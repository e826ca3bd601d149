"""Parameter sets that the manual and the tests speak of: three that can be built, three that cannot."""

from dataclasses import replace
from typing import Any

from cathxr.hardware.parameters import CatheterChoice, Parameters, RoiChoice


def good_examples() -> tuple[Parameters, ...]:
    """Return three rigs that pass every check: a small one, the default, and one for whole hearts and large sheaths."""
    default = Parameters()
    small = changed(default, camera={"distance_mm": 300.0})
    large = changed(default, camera={"distance_mm": 430.0})
    return (
        replace(small, name="ROI of 100 mm", roi=RoiChoice(100.0)),
        replace(default, name="ROI of 120 mm"),
        replace(large, name="1:1 box for 14F", roi=RoiChoice(140.0), catheter=CatheterChoice("14F sheath", 14)),
    )


def refused_examples() -> tuple[tuple[str, Parameters], ...]:
    """Return three rigs that are refused, each with what was changed of the default."""
    default = Parameters()
    return (
        (
            "cameras 260 mm away with a 3 mm lens",
            changed(default, camera={"distance_mm": 260.0, "focal_mm": 3.0}),
        ),
        ("gears without thinned teeth", changed(default, gear={"thinning_mm": 0.0})),
        ("beams of 16 mm", changed(default, frame={"section_mm": 16.0})),
    )


def changed(parameters: Parameters, **groups: dict[str, Any]) -> Parameters:
    """Return parameters with some values of some groups changed."""
    return replace(
        parameters, **{name: replace(getattr(parameters, name), **values) for name, values in groups.items()}
    )
