import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cathxr.geometry.fiducial_plane import FiducialPlane
from cathxr.storage.rig_file import example_rig


@pytest.mark.parametrize("camera", ["top", "front"])
@given(x=st.floats(0.0, 120.0), y=st.floats(-60.0, 60.0))
def test_plane_to_pixels_and_back(camera: str, x: float, y: float) -> None:
    plane = FiducialPlane.of(example_rig(), camera)
    point = np.array([[x, y]])
    # Undistortion stops at 1e-12 of the focal length; at 330 mm that is far below a nanometre.
    np.testing.assert_allclose(plane.to_plane(plane.to_pixels(point)), point, atol=1e-7)
