"""The sector's plane in voxel coordinates."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.ultrasound.field import AcousticField
from cathxr.ultrasound.probe import checked_pose


@dataclass(frozen=True, eq=False)
class Beams:
    """Where a point of the frame `transducer` is in the volume.

    voxel_from_transducer (4, 4): mm to i, j, k. spacing_mm (3,): voxels to mm, for the scatterers' lattice.
    ct_mm_per_mm: mm in `ct` for each mm of the transducer's frame (1 unless the registration scales the heart).
    """

    voxel_from_transducer: FloatArray
    spacing_mm: FloatArray
    ct_mm_per_mm: float

    @classmethod
    def of(cls, field: AcousticField, ct_from_transducer: FloatArray) -> "Beams":
        """Return the plane of a transducer's pose (4, 4) in the volume."""
        pose = checked_pose("ct_from_transducer", ct_from_transducer)
        matrix = np.linalg.inv(field.ct_from_voxel) @ pose
        return cls(matrix, field.spacing_mm, float(np.linalg.norm(pose[:3, 0])))

    @property
    def packed(self) -> FloatArray:
        """For the loops: origin, x, y and z axis in voxels, scale, spacing (3): (16,)."""
        matrix = self.voxel_from_transducer
        return np.concatenate(
            [
                matrix[:3, 3],
                matrix[:3, 0],
                matrix[:3, 1],
                matrix[:3, 2],
                [self.ct_mm_per_mm],
                self.spacing_mm,
            ]
        )
