"""Slices for looking at a grid: its three planes as a radiologist hangs them, with the letters of their sides."""

import math
from dataclasses import dataclass
from itertools import permutations
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.heart.volume import Grid

PlaneName = Literal["axial", "coronal", "sagittal"]
PLANES: tuple[PlaneName, ...] = ("axial", "coronal", "sagittal")
_LETTERS = (("R", "L"), ("A", "P"), ("F", "H"))  # towards - and + of x, y and z of ct (LPS)
_LEAST_SHARE = math.sin(math.radians(10.0))  # a side that looks less than 10 degrees towards it is not named after it


@dataclass(frozen=True)
class Plane:
    """One of the three planes. All of it as it is seen: left is the screen's left.

    columns, rows, slices: how many. spacing_mm: to the next column, row, slice. letters: of the left, right, upper and
    lower side, each towards R or L, A or P, H or F; several, the strongest first, where the grid is oblique.
    """

    name: PlaneName
    columns: int
    rows: int
    slices: int
    spacing_mm: tuple[float, float, float]
    letters: tuple[str, str, str, str]


@dataclass(frozen=True, eq=False)
class Hanging:
    """How a grid is turned for being looked at, along its own axes: nothing is resampled.

    The coordinates of what is seen are (x, y, z), voxels: x to the patient's left, y to the back, z to the feet, each
    as nearly as one of the grid's axes goes. axes: which of i, j, k (0, 1, 2) each is; flipped: whether it runs the
    other way. shape: (X, Y, Z). ct_from_seen (4, 4): (x, y, z, 1) of a voxel's centre to mm in `ct`.
    tilt_deg: the largest angle between an axis and the patient's own.
    """

    axes: tuple[int, int, int]
    flipped: tuple[bool, bool, bool]
    shape: tuple[int, int, int]
    spacing_mm: tuple[float, float, float]
    ct_from_seen: FloatArray
    tilt_deg: float

    def plane(self, name: PlaneName) -> Plane:
        """Return one plane: axial is seen from the feet, coronal from the front, sagittal from the patient's left."""
        right, down, through = _SEEN[name]
        sides = [letters_of(sign * self.ct_from_seen[:3, axis]) for axis in (right, down) for sign in (-1.0, 1.0)]
        left, right_letters, top, bottom = sides
        x, y, z = self.shape[right], self.shape[down], self.shape[through]
        spacing = (self.spacing_mm[right], self.spacing_mm[down], self.spacing_mm[through])
        return Plane(name, x, y, z, spacing, (left, right_letters, top, bottom))

    def hung(self, voxels: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return a view (Z, Y, X) of voxels (K, J, I)."""
        by_seen = voxels.transpose([2 - axis for axis in reversed(self.axes)])
        steps = tuple(slice(None, None, -1 if flip else 1) for flip in reversed(self.flipped))
        return by_seen[steps]

    def to_ct(self, seen: npt.ArrayLike) -> FloatArray:
        """Return points (…, 3) mm in `ct` of seen coordinates (…, 3)."""
        return np.asarray(np.asarray(seen, float) @ self.ct_from_seen[:3, :3].T + self.ct_from_seen[:3, 3])

    def to_seen(self, points_ct: npt.ArrayLike) -> FloatArray:
        """Return seen coordinates (…, 3) of points (…, 3) mm in `ct`."""
        inverse = np.linalg.inv(self.ct_from_seen)
        return np.asarray(np.asarray(points_ct, float) @ inverse[:3, :3].T + inverse[:3, 3])

    def voxel_at(self, points_ct: npt.ArrayLike) -> tuple[int, int, int] | None:
        """Return the (x, y, z) of the voxel that a point (3,) lies in; None outside the grid."""
        x, y, z = (math.floor(each + 0.5) for each in self.to_seen(points_ct).tolist())
        inside = all(0 <= at < count for at, count in zip((x, y, z), self.shape, strict=True))
        return (x, y, z) if inside else None


_SEEN: dict[PlaneName, tuple[int, int, int]] = {"axial": (0, 1, 2), "coronal": (0, 2, 1), "sagittal": (1, 2, 0)}
"""Which of x, y, z runs to the right, down, and from slice to slice."""


def hanging(grid: Grid) -> Hanging:
    """Return how a grid is hung: the permutation and the signs of its axes that come nearest to the patient's."""
    own = grid.ct_from_voxel[:3, :3] / grid.spacing_mm
    wanted = np.diag([1.0, 1.0, -1.0])  # left, back, feet in LPS
    towards = wanted.T @ own  # (3 of the patient, 3 of the grid)
    a, b, c = max(permutations(range(3)), key=lambda order: sum(abs(towards[n, order[n]]) for n in range(3)))
    axes = (a, b, c)
    shares = [float(towards[n, axis]) for n, axis in enumerate(axes)]
    counts = grid.shape[::-1]  # I, J, K
    voxel_from_seen = np.zeros((4, 4))
    voxel_from_seen[3, 3] = 1.0
    for n, (axis, share) in enumerate(zip(axes, shares, strict=True)):
        voxel_from_seen[axis, n] = 1.0 if share >= 0.0 else -1.0
        voxel_from_seen[axis, 3] = 0.0 if share >= 0.0 else counts[axis] - 1.0
    spacing = grid.spacing_mm
    return Hanging(
        axes=axes,
        flipped=(shares[0] < 0.0, shares[1] < 0.0, shares[2] < 0.0),
        shape=(counts[a], counts[b], counts[c]),
        spacing_mm=(float(spacing[a]), float(spacing[b]), float(spacing[c])),
        ct_from_seen=grid.ct_from_voxel @ voxel_from_seen,
        tilt_deg=math.degrees(math.acos(min(1.0, min(abs(each) for each in shares)))),
    )


def slice_of(hung: npt.NDArray[Any], plane: PlaneName, index: int) -> npt.NDArray[Any]:
    """Return one slice (rows, columns) as it is seen, of voxels (Z, Y, X), in memory row by row.

    Raises:
        ValueError: there is no such slice.
    """
    axis = {"axial": 0, "coronal": 1, "sagittal": 2}[plane]
    if not 0 <= index < hung.shape[axis]:
        raise ValueError(f"index: expected 0 to {hung.shape[axis] - 1} of the {plane} slices, got {index}")
    # Not `take`: that would copy all voxels of a view that is turned.
    return np.ascontiguousarray(hung[(slice(None),) * axis + (index,)])


def letters_of(direction_ct: npt.ArrayLike) -> str:
    """Return where a direction (3,) in `ct` points in the patient: "L", or "LP" for left and a little to the back.

    Letters as DICOM's Patient Orientation (C.7.6.1.1.1): the strongest first. Parts under 10 degrees are left out.
    """
    direction = np.asarray(direction_ct, float)
    shares = direction / np.linalg.norm(direction)
    order = sorted(range(3), key=lambda axis: -abs(shares[axis]))
    named = [axis for axis in order if abs(shares[axis]) >= _LEAST_SHARE]
    return "".join(_LETTERS[axis][int(shares[axis] > 0.0)] for axis in named)
