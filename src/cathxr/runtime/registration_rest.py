"""Where the tip rests now: followed Track by Track."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray, Status, Track

RADIUS_MM = 1.0
"""A tip that stays within this of its mean rests."""
LEAST_S = 1.0
_LONGEST_S = 3.0
_LONGEST_GAP_S = 0.7
_FEWEST = 8
_STRAYS = 3
_TREMOR_S = 1.0
"""A hand's tremor repeats itself within about this time, however many Tracks there are of it."""


@dataclass(frozen=True, eq=False)
class Rest:
    """The tip at rest: mean_box (3,) mm in `box`, std_mm (3,) of single Tracks, how long, and their stated error."""

    mean_box: FloatArray
    std_mm: FloatArray
    seconds: float
    count: int
    sigma_mm: float

    @property
    def spread_mm(self) -> float:
        """Standard deviation of single Tracks, 3D."""
        return float(np.linalg.norm(self.std_mm))

    @property
    def position_std_mm(self) -> FloatArray:
        """How well mean_box is known, (3,) mm: what the tracker states, which no averaging lessens, and the hand's."""
        hand = np.square(self.std_mm) / max(1.0, self.seconds / _TREMOR_S)
        return np.asarray(np.sqrt(np.maximum(self.sigma_mm, 0.01) ** 2 / 3.0 + hand))

    @property
    def is_enough(self) -> bool:
        """Whether it has lasted long enough to be measured."""
        return self.seconds >= LEAST_S and self.count >= _FEWEST


class RestFinder:
    """Follows the tip. Single wild Tracks and short losses do not end a rest; the last three seconds count."""

    def __init__(self) -> None:
        self._tracks: deque[tuple[float, FloatArray, float]] = deque()
        self._strays: list[tuple[float, FloatArray, float]] = []

    def add(self, track: Track) -> None:
        """Take the next Track."""
        t_s = track.t_ns * 1e-9
        if self._tracks and t_s - self._tracks[-1][0] > _LONGEST_GAP_S:
            self.clear()
        if track.status is not Status.TRACKED or track.tip_box is None:
            return
        item = (t_s, track.tip_box, track.sigma_mm or 0.0)
        if self._tracks and np.linalg.norm(track.tip_box - self._mean()) > RADIUS_MM:
            self._strays.append(item)
            if len(self._strays) >= _STRAYS:  # it has moved
                self._tracks = deque(self._strays)
                self._strays = []
                self._shorten()
            return
        self._strays = []
        self._tracks.append(item)
        while t_s - self._tracks[0][0] > _LONGEST_S:
            self._tracks.popleft()
        self._shorten()

    def clear(self) -> None:
        """Begin anew."""
        self._tracks.clear()
        self._strays.clear()

    @property
    def rest(self) -> Rest | None:
        """The rest so far, None where there is none at all."""
        if len(self._tracks) < 2:
            return None
        tips = np.stack([each[1] for each in self._tracks])
        return Rest(
            mean_box=tips.mean(axis=0),
            std_mm=tips.std(axis=0, ddof=1),
            seconds=self._tracks[-1][0] - self._tracks[0][0],
            count=len(tips),
            sigma_mm=float(np.median([each[2] for each in self._tracks])),
        )

    def _mean(self) -> FloatArray:
        return np.asarray(np.mean([each[1] for each in self._tracks], axis=0))

    def _shorten(self) -> None:
        """Drop the oldest until all that are left lie around one place: a slow tip does not rest."""
        while len(self._tracks) > 1:
            tips = np.stack([each[1] for each in self._tracks])
            if float(np.linalg.norm(tips - tips.mean(axis=0), axis=1).max()) <= RADIUS_MM:
                return
            self._tracks.popleft()
