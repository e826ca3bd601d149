"""What goes into the waist: pictures, encoder readings, and the measurements made from them."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from cathxr.core.arrays import NONE, NONE_PAIRS, FloatArray, PixelArray, checked


@dataclass(frozen=True, eq=False)
class Image:
    """One picture. `pixels` uint8 (H, W) grey or (H, W, 3) BGR; `t_ns` mid-exposure, host's monotonic clock."""

    camera: str
    seq: int
    t_ns: int
    pixels: PixelArray

    def __post_init__(self) -> None:
        shape = self.pixels.shape
        if self.pixels.dtype != np.uint8 or not (len(shape) == 2 or (len(shape) == 3 and shape[2] == 3)):
            raise ValueError(f"pixels: expected uint8 (H, W) or (H, W, 3), got {self.pixels.dtype} {shape}")
        if self.pixels.size == 0:
            raise ValueError("pixels: expected a picture, got an empty array")

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return int(self.pixels.shape[1]), int(self.pixels.shape[0])


@dataclass(frozen=True)
class Reading:
    """One encoder report.

    `count` after x4 decoding; `illegal` counts impossible transitions; `flags` are the board's.
    """

    seq: int
    t_ns: int
    count: int
    illegal: int = 0
    flags: int = 0


@dataclass(frozen=True)
class RollStatus:
    """Whether the roll can be trusted, and what a person has to do where it cannot.

    present: an encoder is connected. valid: its count gives the rig's roll now. needs: "confirm", a person's word that
    roll is right; "jig", setting roll zero with the jig; "" where nobody needs to do either. sentence: why it is not
    valid and what to do; empty when valid, and where there is no encoder at all.
    """

    present: bool
    valid: bool
    needs: Literal["", "confirm", "jig"] = ""
    sentence: str = ""

    def __post_init__(self) -> None:
        if self.valid and (not self.present or self.needs or self.sentence):
            raise ValueError("RollStatus: expected a valid roll to be present and to need nothing")


def _none_px() -> FloatArray:
    return NONE_PAIRS


def _none() -> FloatArray:
    return NONE


@dataclass(frozen=True, eq=False)
class Detection:
    """Every measurement the fit consumes from one picture, in that picture's raw (distorted) pixels.

    curve_px (N, 2): points of the silhouette's midline, tip first, ending where the tube leaves the inlet.
    normal_px (N, 2): unit normals of the midline, along which each point was measured.
    sigma_px (N,): standard deviation of each point along its normal.
    half_width_px (N,): half of the silhouette's width along the normal.
    tip_px (2,): the silhouette's most distal point, on the midline's continuation; None where nothing was found.
    tip_sigma_px: standard deviation of tip_px along the midline.
    end_px (M, 2), end_sigma_px (M,): points of the silhouette's outline around its end, with their standard deviation
    across it; empty where a method does not measure them.
    rim_px (R, 2), rim_sigma_px (R,): the whole silhouette's outline likewise, where the whole picture was read: closed
    rings one after the other, each ending with its first point again. A point that only closes a ring, at the inlet,
    has a sigma of 1000 px. A rim may be there without a curve.
    reason: None when found, else why not, as a short phrase ("no catheter", "black picture", ...).
    repeats: how many pictures before this one from the same camera were the same to the last bit.
    predicted: whether only pixels near the curve that the last Tracks predict were read.
    """

    camera: str
    seq: int
    t_ns: int
    curve_px: FloatArray = field(default_factory=_none_px)
    normal_px: FloatArray = field(default_factory=_none_px)
    sigma_px: FloatArray = field(default_factory=_none)
    half_width_px: FloatArray = field(default_factory=_none)
    tip_px: FloatArray | None = None
    tip_sigma_px: float | None = None
    end_px: FloatArray = field(default_factory=_none_px)
    end_sigma_px: FloatArray = field(default_factory=_none)
    rim_px: FloatArray = field(default_factory=_none_px)
    rim_sigma_px: FloatArray = field(default_factory=_none)
    reason: str | None = None
    repeats: int = 0
    predicted: bool = False

    def __post_init__(self) -> None:
        for name, shape in (
            ("curve_px", (None, 2)),
            ("normal_px", (None, 2)),
            ("sigma_px", (None,)),
            ("half_width_px", (None,)),
            ("end_px", (None, 2)),
            ("end_sigma_px", (None,)),
            ("rim_px", (None, 2)),
            ("rim_sigma_px", (None,)),
        ):
            object.__setattr__(self, name, checked(name, getattr(self, name), shape))
        count = len(self.curve_px)
        if not (len(self.normal_px) == len(self.sigma_px) == len(self.half_width_px) == count):
            raise ValueError(f"Detection: expected {count} normals, sigmas and half widths, one for each point")
        if len(self.end_px) != len(self.end_sigma_px):
            raise ValueError(f"Detection: expected {len(self.end_px)} sigmas of the end's outline, one for each point")
        if len(self.rim_px) != len(self.rim_sigma_px):
            raise ValueError(f"Detection: expected {len(self.rim_px)} sigmas of the rim, one for each point")
        if self.tip_px is not None:
            object.__setattr__(self, "tip_px", checked("tip_px", self.tip_px, (2,)))
        if self.tip_sigma_px is not None and not (np.isfinite(self.tip_sigma_px) and self.tip_sigma_px >= 0):
            raise ValueError(f"tip_sigma_px: expected a finite number of at least 0, got {self.tip_sigma_px}")
        sizes = (self.sigma_px, self.half_width_px, self.end_sigma_px, self.rim_sigma_px)
        if any(len(each) and each.min() < 0 for each in sizes):
            raise ValueError("Detection: expected sigmas and half widths of at least 0")
        found = self.reason is None
        given = (self.tip_px is not None, self.tip_sigma_px is not None, count > 0)
        if any(each != found for each in given) or count == 1:
            raise ValueError("Detection: expected either a curve with its tip, or a reason why there is none")

    @property
    def found(self) -> bool:
        """Whether a catheter was found."""
        return self.reason is None


@dataclass(frozen=True, eq=False)
class Observation:
    """One matched set of detections, at the top picture's instant.

    skew_ns: the front picture's instant minus the top picture's. roll_rad: unwrapped roll at t_ns, None without a valid
    one; roll_predicted: it is the encoder's motion carried on for up to one of its sample periods. `seq` is the 0-based
    index of the pair.
    """

    seq: int
    t_ns: int
    detections: tuple[Detection, ...]
    skew_ns: int = 0
    roll_rad: float | None = None
    roll_predicted: bool = False

    def __post_init__(self) -> None:
        if self.roll_rad is not None and not np.isfinite(self.roll_rad):
            raise ValueError(f"roll_rad: expected a finite number or None, got {self.roll_rad}")
        if self.roll_predicted and self.roll_rad is None:
            raise ValueError("Observation: expected a roll where one was predicted")

    @property
    def predicted(self) -> bool:
        """Whether a view was read only near the curve that the last Tracks predict."""
        return any(each.predicted for each in self.detections)

    def detection(self, camera: str) -> Detection | None:
        """Return the named camera's detection, None where it gave none."""
        return next((each for each in self.detections if each.camera == camera), None)
