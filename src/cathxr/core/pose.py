"""Rigid poses: a unit quaternion (w, x, y, z) and a translation in mm."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from cathxr.core.arrays import FloatArray, checked

_UNIT_TOLERANCE = 1e-3
"""How far from 1 a quaternion's length may be before it is taken for a mistake (rig.toml's rule)."""


UNIT_ROUNDING = 1e-15
"""A vector whose computed length is this close to 1 has been normalised already."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid transform `a_from_b`: maps points of frame b to frame a.

    `rotation_wxyz` (4,) unit quaternion; lengths within 1e-3 of one are normalised, others refused.
    `translation_mm` (3,) the origin of b seen in a.
    """

    rotation_wxyz: FloatArray
    translation_mm: FloatArray

    def __post_init__(self) -> None:
        quaternion = checked("rotation_wxyz", self.rotation_wxyz, (4,))
        length = float(np.linalg.norm(quaternion))
        if abs(length - 1.0) > _UNIT_TOLERANCE:
            raise ValueError(f"rotation_wxyz: expected a quaternion of length 1, got length {length:.6g}")
        # A quaternion that is already of unit length is kept to the last bit, so that files give back what was written:
        # after one division the length computed again is within 7 roundings (8e-16) of one.
        unit = quaternion if abs(length - 1.0) <= UNIT_ROUNDING else quaternion / length
        unit.setflags(write=False)
        object.__setattr__(self, "rotation_wxyz", unit)
        object.__setattr__(self, "translation_mm", checked("translation_mm", self.translation_mm, (3,)))

    @classmethod
    def identity(cls) -> Self:
        """Return the pose that changes nothing."""
        return cls(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3))

    @classmethod
    def from_matrix(cls, rotation: FloatArray, translation_mm: FloatArray) -> Self:
        """Return the pose with a (3, 3) rotation matrix and a (3,) translation in mm.

        Raises:
            ValueError: the matrix is not a right-handed rotation (to 1e-3).
        """
        matrix = checked("rotation", rotation, (3, 3))
        off = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
        if off > _UNIT_TOLERANCE or np.linalg.det(matrix) < 0:
            raise ValueError(f"rotation: expected a right-handed rotation matrix, got one {off:.3g} off orthonormal")
        return cls(_quaternion_from_matrix(matrix), translation_mm)

    @property
    def rotation(self) -> FloatArray:
        """The (3, 3) rotation matrix."""
        w, x, y, z = self.rotation_wxyz
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    @property
    def matrix(self) -> FloatArray:
        """The (4, 4) homogeneous matrix."""
        result = np.eye(4)
        result[:3, :3] = self.rotation
        result[:3, 3] = self.translation_mm
        return result

    def inverse(self) -> "Pose":
        """Return `b_from_a`."""
        w, x, y, z = self.rotation_wxyz
        return Pose(np.array([w, -x, -y, -z]), -self.rotation.T @ self.translation_mm)

    def __matmul__(self, other: "Pose") -> "Pose":
        """Return `a_from_c` for `a_from_b @ b_from_c`."""
        w1, x1, y1, z1 = self.rotation_wxyz
        w2, x2, y2, z2 = other.rotation_wxyz
        product = np.array(
            [
                w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
                w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
                w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
                w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
            ]
        )
        return Pose(product, self.rotation @ other.translation_mm + self.translation_mm)

    def apply(self, points_mm: FloatArray) -> FloatArray:
        """Return points (..., 3) of frame b, in mm, in frame a."""
        return np.asarray(points_mm @ self.rotation.T + self.translation_mm, dtype=np.float64)

    def turn(self, vectors: FloatArray) -> FloatArray:
        """Return directions (..., 3) of frame b in frame a: rotation only."""
        return np.asarray(vectors @ self.rotation.T, dtype=np.float64)


def _quaternion_from_matrix(matrix: FloatArray) -> FloatArray:
    """Return the unit quaternion (w >= 0) of a rotation matrix, by the numerically largest component.

    Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1978.
    """
    trace = float(np.trace(matrix))
    candidates = np.array([trace, matrix[0, 0], matrix[1, 1], matrix[2, 2]])
    best = int(np.argmax(candidates))
    result = np.empty(4)
    if best == 0:
        result[0] = 1 + trace
        result[1:] = (matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1])
    else:
        i = best - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        result[0] = matrix[k, j] - matrix[j, k]
        result[1 + i] = 1 + 2 * matrix[i, i] - trace
        result[1 + j] = matrix[j, i] + matrix[i, j]
        result[1 + k] = matrix[k, i] + matrix[i, k]
    result /= np.linalg.norm(result)
    return -result if result[0] < 0 else result
