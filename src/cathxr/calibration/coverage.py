"""Where the board has been, and where it should go next: what a person follows while taking pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cathxr.calibration.board_views import BoardView, same_view
from cathxr.core import FloatArray

COLUMNS, ROWS = 8, 5
WANTED = 15
_SEEN = 4
"""So many corners in a cell make it count as seen: two columns of two, enough to bend the lens there."""
_FILLED = 0.85
"""Share of the cells to fill. A board that must be seen whole does not reach the outermost ones."""
_TILTED = 0.1
"""Change of scale across a board that counts as tilted: 25 degrees when it fills half of a narrow lens's picture."""
_MOVED = 0.06
"""A view differs from another when the board's outline has moved by this share of the picture's width in the mean, or
when its tilt differs by half of `_TILTED`."""
_DIRECTIONS = ("left", "right", "top", "bottom")


@dataclass(frozen=True, eq=False)
class _Glance:
    """What is kept of a view: outline (4, 2) as shares of the picture's width, tilt (2,): as `BoardView.tilt`."""

    outline: FloatArray
    tilt: FloatArray


@dataclass(frozen=True, eq=False)
class CoverageMap:
    """The picture in `columns` x `rows` cells, how often each was seen, and how the board was tilted.

    counts (rows, columns): views that had corners there. Frozen: `with_view` returns a new one.
    """

    columns: int = COLUMNS
    rows: int = ROWS
    wanted: int = WANTED
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros((ROWS, COLUMNS), dtype=np.int64))
    glances: tuple[_Glance, ...] = ()

    @classmethod
    def of(cls, views: Sequence[BoardView]) -> Self:
        """Return the map of several views."""
        result = cls()
        for view in views:
            result = result.with_view(view)
        return result

    def with_view(self, view: BoardView) -> Self:
        """Return the map with one more view."""
        counts = self.counts + (self._cells(view) >= _SEEN)
        return replace(self, counts=counts, glances=(*self.glances, _glance(view)))

    @property
    def kept(self) -> int:
        """How many views are in the map."""
        return len(self.glances)

    @property
    def filled(self) -> float:
        """Share of the cells that were seen, 0 to 1."""
        return float((self.counts > 0).mean())

    @property
    def complete(self) -> bool:
        """Whether the views make a good calibration: enough, over the whole picture, tilted in every direction."""
        return self.kept >= self.wanted and self.filled >= _FILLED and not self._missing_tilts()

    def is_new(self, view: BoardView) -> bool:
        """Return whether a view shows what none before did: cells, a tilt, or another place or distance."""
        fresh = int(((self._cells(view) >= _SEEN) & (self.counts == 0)).sum())
        if fresh >= 2 or (fresh == 1 and self.filled > 0.7):
            return True
        glance = _glance(view)
        if any(_alike(each, glance) for each in self.glances):
            return False
        # While cells or tilts are missing, a view must bring one of them nearer, or count as one of the first few.
        missing = self._missing_tilts()
        if any(_is_tilted(glance.tilt, way) for way in missing):
            return True
        return self.kept < 4 or (self.filled >= _FILLED and not missing)

    def advice(self) -> str:
        """Return one sentence: where to hold the board next."""
        if self.kept == 0:
            return "Hold the board before the camera so that it fills about half of the picture, and keep it still."
        if self.complete:
            return "The views suffice."
        missing = self._missing_tilts()
        if missing and (self.filled >= 0.6 or self.kept % 2 == 1):
            return f"Tilt the board so that its {missing[0]} edge comes nearer to the camera."
        if self.filled < _FILLED:
            return f"Move the board to the {self._emptiest()} of the picture, close enough to reach its edge."
        return "Hold the board at another distance or turn it, and keep it still."

    def _cells(self, view: BoardView) -> NDArray[np.int64]:
        """Return how many corners each cell has, (rows, columns)."""
        width, height = view.size_px
        column = np.clip((view.corners_px[:, 0] + 0.5) / width * self.columns, 0, self.columns - 1).astype(np.int64)
        row = np.clip((view.corners_px[:, 1] + 0.5) / height * self.rows, 0, self.rows - 1).astype(np.int64)
        counts = np.zeros((self.rows, self.columns), dtype=np.int64)
        np.add.at(counts, (row, column), 1)
        return counts

    def _missing_tilts(self) -> tuple[str, ...]:
        """Return which edges of the board have not yet been nearer to the camera than the opposite ones."""
        return tuple(way for way in _DIRECTIONS if not any(_is_tilted(each.tilt, way) for each in self.glances))

    def _emptiest(self) -> str:
        """Return, in words, the part of the picture with the largest share of empty cells."""
        empty = self.counts == 0
        down = {"upper": empty[:2], "lower": empty[-2:], "": empty[1:-1]}
        shares = {}
        for vertical, band in down.items():
            for horizontal, part in (("left", band[:, :3]), ("right", band[:, -3:]), ("", band[:, 2:-2])):
                name = {"": "middle"}.get(f"{vertical}{horizontal}", f"{vertical} {horizontal}".strip())
                corner = bool(vertical and horizontal)
                shares[_place(name, is_corner=corner)] = float(part.mean()) + (0.05 if corner else 0.0)
        return max(shares, key=lambda each: shares[each])


def still(previous: BoardView, view: BoardView, *, limit_px: float = 0.5) -> bool:
    """Return whether the board rests: its corners are where they were in the picture before, to `limit_px`."""
    return previous.size_px == view.size_px and same_view(previous, view, limit_px=limit_px)


def _place(name: str, *, is_corner: bool) -> str:
    if name == "middle":
        return name
    if is_corner:
        return f"{name} corner"
    return {"upper": "upper edge", "lower": "lower edge", "left": "left edge", "right": "right edge"}[name]


def _glance(view: BoardView) -> _Glance:
    width = float(view.size_px[0])
    low, high = view.corners_px.min(axis=0) / width, view.corners_px.max(axis=0) / width
    outline = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    return _Glance(outline, np.asarray(view.tilt, dtype=np.float64))


def _is_tilted(tilt: FloatArray, way: str) -> bool:
    sign, axis = {"left": (-1.0, 0), "right": (1.0, 0), "top": (-1.0, 1), "bottom": (1.0, 1)}[way]
    return bool(sign * tilt[axis] > _TILTED)


def _alike(first: _Glance, second: _Glance) -> bool:
    moved = float(np.linalg.norm(first.outline - second.outline, axis=1).mean())
    return moved < _MOVED and float(np.linalg.norm(first.tilt - second.tilt)) < 0.5 * _TILTED
