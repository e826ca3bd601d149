"""Where the transducer is. The frame `transducer`: the axes of `tip`, its origin in the middle of the array's face.

z: the catheter's axis, pointing distally. x: the beam's direction, the sector's centre line. y: right-handed. The
sector lies in the x-z plane, which contains the catheter's axis; a line's angle is measured from x towards z, so that
distal is positive.
"""

import numpy as np

from cathxr.core import FloatArray
from cathxr.core.arrays import checked


def ct_from_transducer(ct_from_tip: FloatArray, *, offset_mm: float = 0.0, radius_mm: float = 0.0) -> FloatArray:
    """Return the transducer's matrix (4, 4) in `ct`, mm, from the tip's.

    ct_from_tip (4, 4): rotation, translation and maybe a common scale. offset_mm: from the tip back to the array's
    middle. radius_mm: from the catheter's axis to the array's face.
    """
    face = np.eye(4)
    face[:3, 3] = (radius_mm, 0.0, -offset_mm)
    return checked_pose("ct_from_tip", ct_from_tip) @ face


def checked_pose(name: str, matrix: FloatArray) -> FloatArray:
    """Return a matrix (4, 4) of rotation, translation and a common scale.

    Raises:
        ValueError: it is of another shape, not finite, mirrored or sheared.
    """
    pose = checked(name, matrix, (4, 4))
    scale = float(np.linalg.norm(pose[:3, 0]))
    if scale < 1e-6 or not np.allclose(pose[:3, :3].T @ pose[:3, :3], scale * scale * np.eye(3), atol=1e-3 * scale**2):
        raise ValueError(f"{name}: expected a rotation with a common scale, got columns that are not orthogonal")
    if np.linalg.det(pose[:3, :3]) < 0.0 or not np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0)):
        raise ValueError(f"{name}: expected a right-handed pose with 0 0 0 1 as its last row")
    return pose
