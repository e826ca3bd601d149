"""The Rig: everything that was measured about one vision box, as read from rig.toml."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from cathxr.core.arrays import FloatArray, checked
from cathxr.core.pose import UNIT_ROUNDING, Pose


@dataclass(frozen=True, eq=False)
class Provenance:
    """How a group of values was measured. Every field is optional: what is unknown is absent.

    std: standard deviation of each named value of the group (same shape and unit as the value).
    covariance: of a pose a_from_b (6, 6), for rotation (rad) then translation (mm) in frame a: R' = exp(rotation) R,
    t' = t + translation; of intrinsics (9, 9), for focal x y, centre x y, k1 k2 p1 p2 k3.
    covariance_with_intrinsics (6, 9): of a camera's pose with its intrinsics. A pose found through a lens that is not
    exactly known carries the lens's error along, so that where the fiducials were the two cancel.
    """

    std: Mapping[str, FloatArray] = field(default_factory=lambda: MappingProxyType({}))
    covariance: FloatArray | None = None
    covariance_with_intrinsics: FloatArray | None = None
    rms_px: float | None = None
    n: int | None = None
    date: str | None = None
    method: str | None = None

    def __post_init__(self) -> None:
        if self.covariance is not None:
            size = 9 if np.shape(self.covariance) == (9, 9) else 6
            object.__setattr__(self, "covariance", checked("covariance", self.covariance, (size, size)))
        if self.covariance_with_intrinsics is not None:
            cross = checked("covariance_with_intrinsics", self.covariance_with_intrinsics, (6, 9))
            object.__setattr__(self, "covariance_with_intrinsics", cross)


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """OpenCV's pinhole camera. focal_px (2,), centre_px (2,), distortion (5,) = k1 k2 p1 p2 k3."""

    focal_px: FloatArray
    centre_px: FloatArray
    distortion: FloatArray = field(default_factory=lambda: np.zeros(5))
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        object.__setattr__(self, "focal_px", checked("focal_px", self.focal_px, (2,)))
        object.__setattr__(self, "centre_px", checked("centre_px", self.centre_px, (2,)))
        object.__setattr__(self, "distortion", checked("distortion", self.distortion, (5,)))
        if (self.focal_px <= 0).any():
            raise ValueError(f"focal_px: expected positive focal lengths, got {self.focal_px.tolist()}")

    @property
    def matrix(self) -> FloatArray:
        """OpenCV's (3, 3) camera matrix."""
        (fx, fy), (cx, cy) = self.focal_px, self.centre_px
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class RigCamera:
    """One camera: size_px (width, height), nominal rate, intrinsics, and its pose in the box."""

    name: str
    size_px: tuple[int, int]
    rate_hz: float
    intrinsics: Intrinsics
    camera_from_box: Pose
    pose_provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        if len(self.size_px) != 2 or min(self.size_px) < 16 or max(self.size_px) > 16384:
            raise ValueError(f"size_px: expected width and height from 16 to 16384, got {self.size_px}")
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0):
            raise ValueError(f"rate_hz: expected a positive rate, got {self.rate_hz}")


@dataclass(frozen=True, eq=False)
class Marker:
    """One fiducial: position (3,) mm in `box`, and its colour's name."""

    name: str
    position_mm: FloatArray
    colour: str
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_mm", checked("position_mm", self.position_mm, (3,)))


@dataclass(frozen=True, eq=False)
class Roi:
    """The region of interest: an axis-aligned block in `box`, min and max corners (3,) mm."""

    min_mm: FloatArray
    max_mm: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "min_mm", checked("min_mm", self.min_mm, (3,)))
        object.__setattr__(self, "max_mm", checked("max_mm", self.max_mm, (3,)))
        if not (self.max_mm > self.min_mm).all():
            raise ValueError("roi: expected max_mm greater than min_mm on every axis")

    @property
    def corners_mm(self) -> FloatArray:
        """The eight corners (8, 3), mm in `box`."""
        grid = np.stack(np.meshgrid(*zip(self.min_mm, self.max_mm, strict=True), indexing="ij"), axis=-1)
        return np.asarray(grid.reshape(8, 3), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Catheter:
    """The catheter in use.

    transducer_offset_mm: from the tip to the transducer's centre; sector_deg: the ICE sector.
    """

    name: str
    diameter_mm: float
    transducer_offset_mm: float | None = None
    sector_deg: float | None = None
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.diameter_mm) and 0.1 <= self.diameter_mm <= 20.0):
            raise ValueError(f"diameter_mm: expected 0.1 to 20 mm, got {self.diameter_mm}")


@dataclass(frozen=True, eq=False)
class Roll:
    """How encoder counts become roll.

    gear_ratio: encoder turns per catheter turn; zero_direction (3,) unit, in `box`. zero_count: where roll is 0, in the
    middle of the play. backlash_deg: the gears' whole play, at the catheter. torsion_...: how far the tip is twisted
    ahead of the gearbox, for each mm inserted and each 90 degrees of bend; None: taken to be none.
    """

    counts_per_turn: float
    gear_ratio: float = 1.0
    direction: int = 1
    zero_count: float = 0.0
    zero_direction: FloatArray = field(default_factory=lambda: np.array([0.0, -1.0, 0.0]))
    backlash_deg: float | None = None
    torsion_deg_per_mm: float | None = None
    torsion_deg_per_quarter_bend: float | None = None
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        direction = checked("zero_direction", self.zero_direction, (3,))
        length = float(np.linalg.norm(direction))
        if abs(length - 1.0) > 1e-3:
            raise ValueError(f"zero_direction: expected a vector of length 1, got length {length:.6g}")
        unit = direction if abs(length - 1.0) <= UNIT_ROUNDING else direction / length
        unit.setflags(write=False)
        object.__setattr__(self, "zero_direction", unit)
        if not (0 < self.counts_per_turn < np.inf and 0 < self.gear_ratio < np.inf):
            raise ValueError("roll: expected positive counts_per_turn and gear_ratio")
        if not np.isfinite(self.zero_count):
            raise ValueError(f"zero_count: expected a finite number, got {self.zero_count}")
        if self.direction not in (1, -1):
            raise ValueError(f"direction: expected 1 or -1, got {self.direction}")

    def angle_rad(self, count: float) -> float:
        """Return the unwrapped roll for an encoder count, radians, right-handed about the insertion direction."""
        turns = (count - self.zero_count) / (self.counts_per_turn * self.gear_ratio)
        return self.direction * 2.0 * float(np.pi) * turns


LONGEST_READOUT_S = 0.1


@dataclass(frozen=True)
class Timing:
    """Measured latencies, seconds. front_offset_s: the front camera's clock minus the top camera's.

    encoder_latency_s: what the board and the computer add to a report's own time on the wire. top_readout_s,
    front_readout_s: of a rolling shutter, from the picture's first row to its last; 0 for a global one.
    """

    top_latency_s: float = 0.0
    front_latency_s: float = 0.0
    encoder_latency_s: float = 0.0
    front_offset_s: float = 0.0
    provenance: Provenance = field(default_factory=Provenance)
    top_readout_s: float = 0.0
    front_readout_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("top_readout_s", "front_readout_s"):
            if not 0.0 <= getattr(self, name) <= LONGEST_READOUT_S:
                raise ValueError(f"{name}: expected 0 to {LONGEST_READOUT_S} s, got {getattr(self, name)}")


@dataclass(frozen=True, eq=False)
class Rig:
    """One vision box.

    `cameras` has "top" and "front"; `markers` maps a camera's name to its fiducials (may be empty).
    """

    name: str
    roi: Roi
    catheter: Catheter
    cameras: Mapping[str, RigCamera]
    markers: Mapping[str, tuple[Marker, ...]] = field(default_factory=dict)
    roll: Roll | None = None
    timing: Timing = field(default_factory=Timing)

    def __post_init__(self) -> None:
        missing = {"top", "front"} - set(self.cameras)
        if missing:
            raise ValueError(f"cameras: expected top and front, {' and '.join(sorted(missing))} missing")
        object.__setattr__(self, "cameras", MappingProxyType(dict(self.cameras)))
        object.__setattr__(self, "markers", MappingProxyType({key: tuple(each) for key, each in self.markers.items()}))

    @property
    def zero_direction(self) -> FloatArray:
        """Where roll zero points, unit (3,) in `box`; -y where the rig has no encoder."""
        return np.array([0.0, -1.0, 0.0]) if self.roll is None else self.roll.zero_direction
