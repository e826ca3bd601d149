"""Parameter sets that can be built, and those that cannot."""

import pytest

from cathxr.hardware.examples import good_examples
from cathxr.hardware.layout import Layout
from cathxr.hardware.parameters import Parameters


@pytest.fixture(params=good_examples(), ids=lambda each: each.name)
def good(request: pytest.FixtureRequest) -> Layout:
    """Each of the three rigs that must pass every check."""
    return Layout(request.param)


@pytest.fixture(scope="session")
def default() -> Layout:
    """The default rig."""
    return Layout(Parameters())
