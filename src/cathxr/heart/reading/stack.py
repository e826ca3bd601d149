"""Slices in order: sorted along their own normal, by position alone. File names and numbers say nothing here."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import DataError, FloatArray
from cathxr.heart.reading.frames import Frame

_SAME_MM = 0.01


@dataclass(frozen=True, eq=False)
class Stack:
    """The slices of one volume in order. axes (3, 3): along a row, along a column, their normal, in the columns.

    along_mm (N,): positions on the normal, ascending. origin (3,) mm in `ct`: the first slice's first pixel.
    slide_mm (N, 2): how far a slice's first pixel lies from the first slice's, along a row and along a column.
    """

    frames: tuple[Frame, ...]
    axes: FloatArray
    origin: FloatArray
    along_mm: FloatArray
    slide_mm: FloatArray

    @property
    def spacing_mm(self) -> tuple[float, float]:
        """Distance of columns and of rows, mm."""
        spacing = self.frames[0].spacing_mm
        assert spacing is not None, "frames without spacing are set aside before"
        return spacing

    def named_mm(self, along: float) -> float:
        """Return a position as people know it: with the sign of the `ct` axis that the normal mostly follows."""
        normal = self.axes[:, 2]
        return along * float(np.sign(normal[np.argmax(np.abs(normal))]))


def stack_of(frames: Sequence[Frame]) -> Stack:
    """Return the frames of one phase and orientation, sorted.

    Frames at the same position are all kept, one after another: see `cathxr.heart.reading.copies`.
    """
    first = frames[0]
    assert first.axes is not None, "frames without orientation are set aside before"
    # The mean of axes that agree within rounding; slices of one series need one common normal.
    row, column = np.mean([each.axes for each in frames if each.axes is not None], axis=0).T
    row = row / np.linalg.norm(row)
    column = column - row * (row @ column)
    column = column / np.linalg.norm(column)
    axes = np.column_stack([row, column, np.cross(row, column)])
    positions = np.array([each.position for each in frames]) @ axes
    order = np.argsort(positions[:, 2], kind="stable")
    positions = positions[order]
    return Stack(
        frames=tuple(frames[each] for each in order),
        axes=axes,
        origin=axes @ positions[0],
        along_mm=positions[:, 2],
        slide_mm=positions[:, :2] - positions[0, :2],
    )


def repeated(stack: Stack) -> list[tuple[int, int]]:
    """Return pairs of neighbouring indices whose slices lie at one position."""
    return [(int(each), int(each) + 1) for each in np.flatnonzero(np.diff(stack.along_mm) < _SAME_MM)]


def without(stack: Stack, indices: Sequence[int]) -> Stack:
    """Return the stack without some of its slices."""
    kept = [each for each in range(len(stack.frames)) if each not in set(indices)]
    if not kept:
        raise DataError("No slice is left of the series; choose another one with --series.")
    return stack_of([stack.frames[each] for each in kept])
