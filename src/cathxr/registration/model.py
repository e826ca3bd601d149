"""The Registration: how the box lies in the heart's `ct`, and how well that is known."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from cathxr.core import FloatArray, Pose
from cathxr.core.arrays import checked


class Kind(StrEnum):
    """What the transform is: chosen without measuring, or fitted to landmarks as a rigid motion or a similarity."""

    PLACEMENT = "placement"
    RIGID = "rigid"
    SIMILARITY = "similarity"


@dataclass(frozen=True, eq=False)
class LandmarkPair:
    """One point, mm: box_mm (3,) in `box`, ct_mm (3,) in `ct`. residual_mm: the distance left after the fit."""

    name: str
    box_mm: FloatArray
    ct_mm: FloatArray
    residual_mm: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "box_mm", checked("box_mm", self.box_mm, (3,)))
        object.__setattr__(self, "ct_mm", checked("ct_mm", self.ct_mm, (3,)))


@dataclass(frozen=True, eq=False)
class Registration:
    """Where the box is in the heart: point_ct = scale * R(ct_from_box) point_box + t(ct_from_box).

    fre_mm: root mean square residual of the landmarks. tre_mm: root mean square held-out (leave-one-out) target error.
    predicted_tre_mm: Fitzpatrick's prediction at the landmarks' centroid. None where unknown.
    A placement has no errors, for it measures nothing.
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

    def __post_init__(self) -> None:
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale: expected a positive number, got {self.scale}")
        if self.kind is not Kind.SIMILARITY and self.scale != 1.0:
            raise ValueError(f"scale: expected 1 with kind {self.kind.value!r}, got {self.scale}")
        errors = {"fre_mm": self.fre_mm, "tre_mm": self.tre_mm, "predicted_tre_mm": self.predicted_tre_mm}
        for name, value in errors.items():
            if value is not None and not (np.isfinite(value) and value >= 0):
                raise ValueError(f"{name}: expected a number of at least 0, got {value}")
            if value is not None and self.kind is Kind.PLACEMENT:
                raise ValueError(f"{name}: expected no error with kind 'placement', which measures nothing")
        object.__setattr__(self, "landmarks", tuple(self.landmarks))

    @property
    def is_measured(self) -> bool:
        """Whether landmarks were measured, so that positions in the heart mean something."""
        return self.kind is not Kind.PLACEMENT

    @property
    def matrix(self) -> FloatArray:
        """The (4, 4) homogeneous matrix of ct_from_box, scale included."""
        result = self.ct_from_box.matrix
        result[:3, :3] *= self.scale
        return result

    def ct(self, points_box: FloatArray) -> FloatArray:
        """Return points (..., 3) of `box`, mm, in `ct`."""
        turned = self.ct_from_box.turn(np.asarray(points_box, dtype=np.float64))
        return np.asarray(self.scale * turned + self.ct_from_box.translation_mm)

    def box(self, points_ct: FloatArray) -> FloatArray:
        """Return points (..., 3) of `ct`, mm, in `box`."""
        offset = np.asarray(points_ct, dtype=np.float64) - self.ct_from_box.translation_mm
        return np.asarray(self.ct_from_box.inverse().turn(offset) / self.scale)
