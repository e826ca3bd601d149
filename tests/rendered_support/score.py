"""How far a track table is from the truth of a rendered recording."""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from cathxr.core import FloatArray, Status
from cathxr.storage.track_csv import TrackRow, read_track_csv

WRONG_MM = 2.0
"""A tip of a tracked pair that is farther off than this is a confident wrong answer."""


@dataclass(frozen=True)
class Score:
    """A recording's pairs by status, errors of the tracked ones, and why others are not; mm and degrees."""

    pairs: int
    reasons: Counter[str]
    tip_mm: FloatArray
    normalised: FloatArray
    shape_mm: FloatArray
    shape_max_mm: FloatArray
    direction_deg: FloatArray

    @property
    def tracked(self) -> float:
        return len(self.tip_mm) / self.pairs

    @property
    def wrong(self) -> int:
        return int((self.tip_mm > WRONG_MM).sum())

    @property
    def normalised_rms(self) -> float:
        return float(np.sqrt(np.mean(self.normalised**2)))


def scored(folder: Path, table: Path) -> Score:
    """Compare a table with folder/truth.jsonl."""
    truth = [json.loads(line) for line in (folder / "truth.jsonl").read_text(encoding="utf-8").splitlines()]
    rows = read_track_csv(table)
    tracked = [row for row in rows if row.status is Status.TRACKED]
    errors = [_errors(row, truth[row.seq]) for row in tracked]
    tip, normalised, shape, shape_max, direction = np.array(errors).reshape(-1, 5).T
    reasons = Counter(row.reason for row in rows if row.status is not Status.TRACKED)
    return Score(len(truth), reasons, tip, normalised, shape, shape_max, direction)


def _errors(row: TrackRow, truth: dict[str, list[float]]) -> tuple[float, ...]:
    assert row.tip_box is not None
    assert row.direction_box is not None
    assert row.shape_box is not None
    assert row.sigma_mm is not None
    tip = float(np.linalg.norm(row.tip_box - truth["tip"]))
    curve = np.array(truth["curve"])
    to_truth, _ = cKDTree(_dense(curve)).query(row.shape_box)
    to_found, _ = cKDTree(_dense(row.shape_box)).query(curve[curve[:, 0] > 1.0])
    angle = np.degrees(np.arccos(np.clip(np.dot(row.direction_box, truth["direction"]), -1.0, 1.0)))
    shape = 0.5 * float(to_truth.mean() + to_found.mean())
    return tip, tip / row.sigma_mm, shape, float(max(to_truth.max(), to_found.max())), float(angle)


def _dense(curve: FloatArray) -> FloatArray:
    """Return eight points for each of a curve's (N, 3)."""
    at = np.arange(0.0, len(curve) - 1, 0.125)
    return np.column_stack([np.interp(at, np.arange(len(curve)), each) for each in curve.T])
