"""Parameter sets that can be built, and those that cannot."""

from dataclasses import replace

import pytest

from cathxr.hardware.layout import Layout
from cathxr.hardware.parameters import CatheterChoice, Parameters, RoiChoice


def _good(name: str) -> Parameters:
    default = Parameters()
    if name == "ROI of 100 mm":
        camera = replace(default.camera, distance_mm=300.0)
        return replace(default, name=name, roi=RoiChoice(100.0), camera=camera)
    if name == "1:1 box for 14F":
        camera = replace(default.camera, distance_mm=430.0)
        return replace(
            default, name=name, roi=RoiChoice(140.0), camera=camera, catheter=CatheterChoice("14F sheath", 14)
        )
    return replace(default, name=name)


GOOD = ("ROI of 100 mm", "ROI of 120 mm", "1:1 box for 14F")


@pytest.fixture(params=GOOD)
def good(request: pytest.FixtureRequest) -> Layout:
    """Each of the three rigs that must pass every check."""
    return Layout(_good(request.param))


@pytest.fixture(scope="session")
def default() -> Layout:
    """The default rig."""
    return Layout(Parameters())
