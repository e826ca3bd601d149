"""Reads medical data into a `Volume` or a `LabelVolume`. Needs the extra `heart`.

Only `Technical` leaves this package: no name, date, place, identifier or file name of a patient's data.
"""

from cathxr.heart.reading.contrast import require_contrast
from cathxr.heart.reading.labels import read_labels
from cathxr.heart.reading.reader import find_series, read_volume
from cathxr.heart.reading.summary import SeriesSummary

__all__ = ["SeriesSummary", "find_series", "read_labels", "read_volume", "require_contrast"]
