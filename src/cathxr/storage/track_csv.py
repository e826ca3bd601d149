"""The track CSV: one row for each picture pair. Written whole or not at all, and read back with checks."""

import csv
import os
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from cathxr.core import DataError, FloatArray, Status, Track
from cathxr.storage.atomic import AtomicFile, os_reason
from cathxr.storage.track_columns import LEADING, MOST_POINTS, cells, header, is_lost


class TrackCsvWriter:
    """Writes Tracks as rows. A context manager: leaving it well puts the file in place, by an error removes it."""

    def __init__(self, path: str | os.PathLike[str], *, points: int = 50) -> None:
        """Take the path and the number of points (2 to 200) that every Track has.

        Raises:
            ValueError: another number of points.
        """
        self._header = header(points)
        self._points = points
        self._file = AtomicFile(Path(path))
        self._text: TextIOWrapper | None = None
        self.rows = 0

    def __enter__(self) -> Self:
        """Open the file.

        Raises:
            DataError: the operating system refuses.
        """
        try:
            self._text = self._file.part.open("x", encoding="utf-8", newline="")
            self._csv = csv.writer(self._text, lineterminator="\n")
            self._csv.writerow(self._header)
        except OSError as error:
            raise self._refused(error) from error
        return self

    def write(self, track: Track) -> None:
        """Append a row.

        Raises:
            DataError: the disk refuses; ValueError: the Track has another number of points.
        """
        try:
            self._csv.writerow(cells(track, self._points))
        except OSError as error:
            raise self._refused(error) from error
        self.rows += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the file in place, or remove it after an error."""
        assert self._text is not None
        try:
            self._text.close()
        except OSError as refusal:
            self._file.abort()
            raise self._refused(refusal) from refusal
        if kind is None:
            self._file.commit()
        else:
            self._file.abort()

    def discard(self) -> None:
        """Remove what is not in place yet; after a good end there is nothing to remove."""
        self._file.abort()

    def _refused(self, error: OSError) -> DataError:
        return DataError(f"{self._file.target}: cannot write it ({os_reason(error)}); check the folder and the disk.")


@dataclass(frozen=True, eq=False)
class TrackRow:
    """One row. Lost: all after `reason` is None. shape_box (K, 3) mm, tip first; angles in degrees, as in the file."""

    seq: int
    t_s: float
    status: Status
    reason: str
    tip_box: FloatArray | None = None
    direction_box: FloatArray | None = None
    yaw_deg: float | None = None
    pitch_deg: float | None = None
    roll_deg: float | None = None
    sigma_mm: float | None = None
    length_mm: float | None = None
    shape_box: FloatArray | None = None


def read_track_csv(path: str | os.PathLike[str]) -> list[TrackRow]:
    """Return the rows of a track CSV.

    Raises:
        DataError: one sentence with the file, the line, what was expected, and what to do.
    """
    place = Path(path)
    result = []
    try:
        with place.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            points = _points_of(next(reader, []), place)
            for row in reader:
                if len(row) != len(LEADING) + 3 * points:
                    raise DataError(
                        f"{place}: line {reader.line_num}: expected {len(LEADING) + 3 * points} values, "
                        f"got {len(row)}; the file is damaged: make it again."
                    )
                result.append(_row(row, place, reader.line_num))
    except OSError as error:
        raise DataError(f"{place}: cannot read the track table ({os_reason(error)}); check the path.") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{place}: expected a track table, got something else; check the path.") from error
    return result


def _points_of(names: list[str], place: Path) -> int:
    points = (len(names) - len(LEADING)) // 3
    if not 2 <= points <= MOST_POINTS or names != header(points):
        raise DataError(
            f"{place}: expected the columns of a track table (seq,t_s,status,...), got others; "
            "give the file that `cathxr track` wrote."
        )
    return points


def _row(row: list[str], place: Path, line: int) -> TrackRow:
    try:
        seq, t_s, status, reason = int(row[0]), float(row[1]), Status(row[2]), row[3]
        if is_lost(row[2]):
            if any(row[4:]):
                raise ValueError("a lost row with values")
            return TrackRow(seq, t_s, status, reason)
        roll = None if row[12] == "" else float(row[12])
        numbers = np.array([float(each) for each in row[4:12] + row[13:]])
        if not np.isfinite(numbers).all():
            raise ValueError("a number that is not finite")
    except ValueError as error:
        raise DataError(
            f"{place}: line {line}: expected a row of a track table, got {error}; make it again."
        ) from error
    yaw, pitch, sigma, length = (float(each) for each in (*numbers[6:8], *numbers[8:10]))
    shape = numbers[10:].reshape(-1, 3)
    return TrackRow(seq, t_s, status, reason, numbers[0:3], numbers[3:6], yaw, pitch, roll, sigma, length, shape)
