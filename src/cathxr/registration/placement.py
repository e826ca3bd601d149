"""The placement that needs no landmarks: the inlet before one opening, the insertion axis towards another."""

from collections.abc import Mapping

import numpy as np

from cathxr.core import FloatArray, Pose, RegistrationError
from cathxr.core.arrays import checked
from cathxr.registration.model import Kind, Registration

BEFORE_MM = 35.0
"""How far before the right atrium the inlet is put: so much of the box is the inferior vena cava, and a tip in the
middle of the region of interest is in the middle of the atrium."""
AXIS = ("inferior_vena_cava", "superior_vena_cava")
"""The openings that the default placement goes by."""
_ANTERIOR_CT = (0.0, -1.0, 0.0)
_LEAST_DISTANCE_MM = 1.0
_LEAST_ANGLE_SINE = 0.1


def default_placement(
    inlet_ct: FloatArray, towards_ct: FloatArray, *, method: str, date: str | None = None, before_mm: float = BEFORE_MM
) -> Registration:
    """Return the placement with the box's origin before `inlet_ct`, +x towards `towards_ct`, +z nearest to anterior.

    With the inferior and the superior vena cava this is a patient lying on the back with the feet towards the operator:
    +x is superior, +z anterior and +y the patient's right, so that the front camera looks from the patient's left.
    inlet_ct, towards_ct (3,) mm in `ct` (LPS). before_mm: from the inlet to `inlet_ct`. Nothing is measured, so it
    carries no error.

    Raises:
        RegistrationError: the points are less than 1 mm apart, or their line runs within 6 degrees of anterior.
    """
    inlet = checked("inlet_ct", inlet_ct, (3,))
    offset = checked("towards_ct", towards_ct, (3,)) - inlet
    distance = float(np.linalg.norm(offset))
    if distance < _LEAST_DISTANCE_MM:
        raise RegistrationError(
            f"The inlet and the point to aim at are {distance:.2f} mm apart, too near to give a direction; "
            "choose two openings that lie apart."
        )
    x = offset / distance
    up = np.array(_ANTERIOR_CT) - (x @ np.array(_ANTERIOR_CT)) * x
    length = float(np.linalg.norm(up))
    if length < _LEAST_ANGLE_SINE:
        raise RegistrationError(
            "The line from the inlet to the point to aim at runs along the anterior direction, so that 'up' is not "
            "defined; choose another point to aim at."
        )
    z = up / length
    rotation = np.stack([x, np.cross(z, x), z], axis=1)
    return Registration(Pose.from_matrix(rotation, inlet - before_mm * x), Kind.PLACEMENT, method, date=date)


def caval_placement(points_ct: Mapping[str, FloatArray], *, method: str) -> Registration | None:
    """Return the default placement by a heart's caval openings, None where it names none. Raises as above."""
    if any(key not in points_ct for key in AXIS):
        return None
    return default_placement(points_ct[AXIS[0]], points_ct[AXIS[1]], method=method)
