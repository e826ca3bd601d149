"""Nouns, verbs, errors. Imports nothing of the project's."""

from cathxr.core.arrays import FloatArray, PixelArray
from cathxr.core.errors import (
    CalibrationError,
    CathxrError,
    ConfigError,
    DataError,
    DeviceError,
    DeviceLost,
    DeviceNotFound,
    EndOfStream,
    ProtocolError,
    RegistrationError,
)
from cathxr.core.pose import Pose
from cathxr.core.protocols import Clock, Detector, Sink, Source, Tracker, Zeroed
from cathxr.core.rig import (
    LONGEST_READOUT_S,
    Catheter,
    Intrinsics,
    Marker,
    Provenance,
    Rig,
    RigCamera,
    Roi,
    Roll,
    Timing,
)
from cathxr.core.signals import Detection, Image, Observation, Reading, RollStatus
from cathxr.core.track import Event, Health, Status, Track

__all__ = [
    "LONGEST_READOUT_S",
    "CalibrationError",
    "Catheter",
    "CathxrError",
    "Clock",
    "ConfigError",
    "DataError",
    "Detection",
    "Detector",
    "DeviceError",
    "DeviceLost",
    "DeviceNotFound",
    "EndOfStream",
    "Event",
    "FloatArray",
    "Health",
    "Image",
    "Intrinsics",
    "Marker",
    "Observation",
    "PixelArray",
    "Pose",
    "ProtocolError",
    "Provenance",
    "Reading",
    "RegistrationError",
    "Rig",
    "RigCamera",
    "Roi",
    "Roll",
    "RollStatus",
    "Sink",
    "Source",
    "Status",
    "Timing",
    "Track",
    "Tracker",
    "Zeroed",
]
