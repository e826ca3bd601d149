"""The Registration: how the box lies in the heart's `ct`, and how well that is known."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from cathxr.core import FloatArray, Pose
from cathxr.core.arrays import checked

_AGREEMENT = 1e-6
"""How far the pose and scale beside a linear part may be from those nearest to it; rounding is far less."""


class Kind(StrEnum):
    """What the transform is: chosen without measuring, or fitted to landmarks: rigid, similarity or affine."""

    PLACEMENT = "placement"
    RIGID = "rigid"
    SIMILARITY = "similarity"
    AFFINE = "affine"

    @property
    def parameters(self) -> int:
        """How many numbers are fitted."""
        return _PARAMETERS[self]

    @property
    def fewest_pairs(self) -> int:
        """How many landmarks it takes, at least."""
        return 4 if self is Kind.AFFINE else 3


_PARAMETERS = {Kind.PLACEMENT: 0, Kind.RIGID: 6, Kind.SIMILARITY: 7, Kind.AFFINE: 12}


@dataclass(frozen=True, eq=False)
class LandmarkPair:
    """One point, mm: box_mm (3,) in `box`, ct_mm (3,) in `ct`.

    box_std_mm, ct_std_mm (3,): how well each is known, standard deviation along each axis of its frame; None: unknown.
    residual_mm: the distance left after the fit; held_out_mm: the distance left by a fit to all the others.
    """

    name: str
    box_mm: FloatArray
    ct_mm: FloatArray
    residual_mm: float | None = None
    held_out_mm: float | None = None
    box_std_mm: FloatArray | None = None
    ct_std_mm: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "box_mm", checked("box_mm", self.box_mm, (3,)))
        object.__setattr__(self, "ct_mm", checked("ct_mm", self.ct_mm, (3,)))
        for name in ("box_std_mm", "ct_std_mm"):
            value = getattr(self, name)
            if value is not None:
                std = checked(name, value, (3,))
                if (std <= 0).any():
                    raise ValueError(f"{name}: expected positive numbers, got {std.tolist()}")
                object.__setattr__(self, name, std)


@dataclass(frozen=True, eq=False)
class Registration:
    """Where the box is in the heart: point_ct = L point_box + t(ct_from_box), L = scale * R(ct_from_box).

    An affinity has its own L: linear (3, 3), right-handed; scale and rotation are then those nearest to it, for what
    needs an orientation. fre_mm: root mean square residual of the landmarks, which says little about the error
    elsewhere. tre_mm: root mean square held-out (leave-one-out) target error. predicted_tre_mm: the expected target
    error at the landmarks' centroid; worst_tre_mm: the greatest over the heart. fle_mm: how well one landmark is known
    (3D root mean square). covariance: of the fitted parameters, (6, 6), (7, 7) or (12, 12), see docs/registration.md.
    None where unknown. A placement has no errors, for it measures nothing.
    date: ISO date of the measurement; method: how, in words.
    """

    ct_from_box: Pose
    kind: Kind
    method: str
    scale: float = 1.0
    date: str | None = None
    fre_mm: float | None = None
    tre_mm: float | None = None
    predicted_tre_mm: float | None = None
    landmarks: tuple[LandmarkPair, ...] = field(default_factory=tuple)
    linear: FloatArray | None = None
    worst_tre_mm: float | None = None
    fle_mm: float | None = None
    covariance: FloatArray | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale: expected a positive number, got {self.scale}")
        if self.kind not in (Kind.SIMILARITY, Kind.AFFINE) and self.scale != 1.0:
            raise ValueError(f"scale: expected 1 with kind {self.kind.value!r}, got {self.scale}")
        if (self.linear is not None) != (self.kind is Kind.AFFINE):
            raise ValueError(f"linear: expected with kind 'affine' and with no other, got kind {self.kind.value!r}")
        if self.linear is not None:
            self._check_linear(self.linear)
        for name in ("fre_mm", "tre_mm", "predicted_tre_mm", "worst_tre_mm", "fle_mm"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value >= 0):
                raise ValueError(f"{name}: expected a number of at least 0, got {value}")
            if value is not None and self.kind is Kind.PLACEMENT:
                raise ValueError(f"{name}: expected no error with kind 'placement', which measures nothing")
        if self.covariance is not None:
            size = self.kind.parameters
            object.__setattr__(self, "covariance", checked("covariance", self.covariance, (size, size)))
        object.__setattr__(self, "landmarks", tuple(self.landmarks))

    @property
    def is_measured(self) -> bool:
        """Whether landmarks were measured, so that positions in the heart mean something."""
        return self.kind is not Kind.PLACEMENT

    @property
    def linear_ct_from_box(self) -> FloatArray:
        """The (3, 3) linear part L, scale included."""
        return self.scale * self.ct_from_box.rotation if self.linear is None else self.linear

    @property
    def matrix(self) -> FloatArray:
        """The (4, 4) homogeneous matrix from `box` to `ct`, scale and stretch included."""
        result = self.ct_from_box.matrix
        result[:3, :3] = self.linear_ct_from_box
        return result

    def ct(self, points_box: FloatArray) -> FloatArray:
        """Return points (..., 3) of `box`, mm, in `ct`."""
        points = np.asarray(points_box, dtype=np.float64)
        return np.asarray(points @ self.linear_ct_from_box.T + self.ct_from_box.translation_mm)

    def box(self, points_ct: FloatArray) -> FloatArray:
        """Return points (..., 3) of `ct`, mm, in `box`."""
        offset = np.asarray(points_ct, dtype=np.float64) - self.ct_from_box.translation_mm
        return np.asarray(offset @ np.linalg.inv(self.linear_ct_from_box).T)

    def _check_linear(self, linear: FloatArray) -> None:
        matrix = checked("linear", linear, (3, 3))
        nearest = nearest_similarity(matrix)
        off = max(abs(nearest[0] / self.scale - 1.0), float(np.abs(nearest[1] - self.ct_from_box.rotation).max()))
        if off > _AGREEMENT:
            raise ValueError(
                f"linear: expected the rotation and scale beside it to be those nearest to it, got {off:.2g} off"
            )
        object.__setattr__(self, "linear", matrix)


def nearest_similarity(linear: FloatArray) -> tuple[float, FloatArray]:
    """Return (scale, rotation (3, 3)) nearest to a linear map (3, 3): the polar rotation, the scale of its volume.

    Raises:
        ValueError: the map mirrors or is singular.
    """
    determinant = float(np.linalg.det(linear))
    if not determinant > 0.0:
        raise ValueError(f"linear: expected a map that keeps right-handedness, got determinant {determinant:.3g}")
    left, _, right = np.linalg.svd(linear)
    return determinant ** (1.0 / 3.0), np.asarray(left @ right, dtype=np.float64)
