"""A person's corrections: points of which somebody has said what structure they lie in."""

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cathxr.core import ConfigError
from cathxr.heart.anatomy import CATALOGUE

NOTHING = "none"
"""The structure of a seed that says: this is not of the heart."""
_COLUMNS = ("structure", "x_mm", "y_mm", "z_mm")
_RADIUS = "radius_mm"


@dataclass(frozen=True)
class Seed:
    """A point (x, y, z) mm in `ct` within a structure (a key of the catalogue of blood, or "none").

    A seed of a chamber moves its border; one of a vessel, or of "none", takes the whole piece of blood that it is in.
    radius_mm: how far round it all blood is that structure in any case; None for 2 mm.
    """

    structure: str
    position_mm: tuple[float, float, float]
    radius_mm: float | None = None

    def __post_init__(self) -> None:
        known = [key for key, each in CATALOGUE.items() if each.blood] + [NOTHING]
        if self.structure not in known:
            raise ValueError(f"structure: expected one of {', '.join(known)}, got {self.structure!r}")
        if self.radius_mm is not None and not 0.0 < self.radius_mm < 100.0:
            raise ValueError(f"radius_mm: expected more than 0 and less than 100, got {self.radius_mm}")
        if len(self.position_mm) != 3 or not all(math.isfinite(each) for each in self.position_mm):
            raise ValueError(f"position_mm: expected three finite numbers, got {self.position_mm}")


def read_seeds(path: Path) -> tuple[Seed, ...]:
    """Return the seeds of a CSV file with the columns structure, x_mm, y_mm, z_mm and, if wanted, radius_mm.

    Raises:
        ConfigError: the file is missing, or a line does not say what it must.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            columns = [each.strip() for each in reader.fieldnames or ()]
            if not set(_COLUMNS) <= set(columns) or not set(columns) <= {*_COLUMNS, _RADIUS}:
                raise ConfigError(
                    f"{path}: the first line must be {','.join(_COLUMNS)} and may add {_RADIUS}; "
                    f"it is {','.join(columns)!r}."
                )
            reader.fieldnames = columns
            return tuple(_seed(row, path, reader.line_num) for row in reader)
    except OSError as error:
        raise ConfigError(f"{path} cannot be read ({error.strerror}); give a file of seeds.") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(f"{path} is not a CSV file of text; write it again as UTF-8.") from error


def write_seeds(path: Path, seeds: Sequence[Seed]) -> None:
    """Write the seeds as CSV, positions to a hundredth of a millimetre."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*_COLUMNS, _RADIUS])
        for seed in seeds:
            radius = "" if seed.radius_mm is None else f"{seed.radius_mm:g}"
            writer.writerow([seed.structure, *(f"{value:.2f}" for value in seed.position_mm), radius])


def _seed(row: dict[str, str | None], path: Path, line: int) -> Seed:
    """Return a line's seed."""
    try:
        x, y, z = (float(row[column] or "") for column in _COLUMNS[1:])
        radius = (row.get(_RADIUS) or "").strip()
        return Seed((row["structure"] or "").strip(), (x, y, z), float(radius) if radius else None)
    except (ValueError, TypeError) as error:
        raise ConfigError(f"{path}, line {line}: {error}; correct the line.") from error
