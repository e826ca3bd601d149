"""Slices at one position: dropped where they are the same picture, told apart or refused where they are not."""

import numpy as np

from cathxr.core import DataError
from cathxr.heart.reading.phases import Phase, by_instance
from cathxr.heart.reading.pixels import PixelSource
from cathxr.heart.reading.stack import Stack, repeated, stack_of, without

_FEW = 0.1


def told_apart(phases: tuple[Phase, ...], pixels: PixelSource) -> tuple[Phase, ...]:
    """Return the phases, or times by instance number where one phase holds different pictures at every position."""
    if len(phases) != 1:
        return phases
    stack = stack_of(phases[0].frames)
    pairs = repeated(stack)
    if not pairs or _is_same(stack, pairs[len(pairs) // 2], pixels):
        return phases
    times = by_instance(phases[0].frames)
    return tuple(times) if len(times) > 1 else phases


def single(stack: Stack, pixels: PixelSource) -> tuple[Stack, tuple[str, ...]]:
    """Return the stack with one slice at each position, and remarks on what was left out.

    Raises:
        DataError: many positions hold several different pictures, and nothing tells which belong together.
    """
    pairs = repeated(stack)
    if not pairs:
        return stack, ()
    differing = [pair for pair in pairs if not _is_same(stack, pair, pixels)]
    if len(differing) > _FEW * len(stack.frames):
        raise DataError(
            f"At {len(differing)} positions there are several different slices, and nothing tells which belong "
            "together; export one series, or one phase, at a time."
        )
    remarks = []
    if same := len(pairs) - len(differing):
        remarks.append(f"{same} slice{'s' * (same > 1)} came twice: left out once.")
    if differing:
        remarks.append(f"At {len(differing)} positions there were two different slices: the first one was taken.")
    return without(stack, [second for _, second in pairs]), tuple(remarks)


def _is_same(stack: Stack, pair: tuple[int, int], pixels: PixelSource) -> bool:
    first, second = (pixels.hu(stack.frames[each]) for each in pair)
    return bool(np.array_equal(first, second))
