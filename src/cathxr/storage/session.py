"""Sessions: writing, reading, and giving out as a track CSV."""

import os
from itertools import islice
from pathlib import Path

from cathxr.core import Track
from cathxr.geometry import resampled
from cathxr.storage.atomic import check_writable
from cathxr.storage.session_json import Picture
from cathxr.storage.session_reader import SessionItem, SessionReader
from cathxr.storage.session_writer import SessionWriter
from cathxr.storage.track_columns import MOST_POINTS
from cathxr.storage.track_csv import TrackCsvWriter

__all__ = ["Picture", "SessionItem", "SessionReader", "SessionWriter", "export_csv"]

_USUAL_POINTS = 50


def export_csv(session: SessionReader, out: str | os.PathLike[str], *, points: int | None = None) -> int:
    """Write a session's Tracks as a track CSV and return the number of rows. Without `points`: as many as recorded.

    Raises:
        DataError: the session is damaged or the file cannot be written; ValueError: not 2 to 200 points.
    """
    check_writable(Path(out), what="the track table")
    if points is None:
        shapes = (each.shape_box for each in session.tracks() if each.shape_box is not None)
        points = min(MOST_POINTS, next((len(each) for each in islice(shapes, 1)), _USUAL_POINTS))
    with TrackCsvWriter(out, points=points) as writer:
        for track in session.tracks():
            writer.write(_with_points(track, points))
    return writer.rows


def _with_points(track: Track, points: int) -> Track:
    if track.shape_box is None or len(track.shape_box) == points:
        return track
    shape = resampled(track.shape_box, points)
    return Track(
        track.seq, track.t_ns, track.status, track.reason, shape, track.box_from_tip, track.roll_rad, track.sigma_mm
    )
