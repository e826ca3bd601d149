"""Metrics of a trial: one small function each, and the catalogue that names them all."""

from cathxr.training.metrics.catalogue import METRICS, catalogue_text, measured, values
from cathxr.training.metrics.measure import Depth, Measure, Metric, Run
from cathxr.training.metrics.motion import Motion, motion_of

__all__ = [
    "METRICS",
    "Depth",
    "Measure",
    "Metric",
    "Motion",
    "Run",
    "catalogue_text",
    "measured",
    "motion_of",
    "values",
]
