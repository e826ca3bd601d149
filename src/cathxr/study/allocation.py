"""Allocation to sequences: permuted blocks, balanced, in strata; from a seed, so that a log of draws can be checked."""

import itertools
from collections.abc import Callable, Iterable
from hashlib import sha256

from cathxr.core.trials import Draw
from cathxr.study.design import StudyDesign, sequence_text


def drawn_sequence(design: StudyDesign, seed: int, group: str, number: int) -> tuple[str, ...]:
    """Return the sequence of the `number`-th draw (from 1) of a group.

    Blocks of `design.blocks` sets of all sequences follow each other, their sizes drawn and their order shuffled, from
    the seed and the group alone. Each block is balanced, so that two sequences never differ by more than the largest
    block has sets. Who knows all draws so far and not the seed cannot be sure of the next (where there is only one size
    of block, the last places of a block can be told).

    Raises:
        ValueError: number is below 1, or the group is none of the design's.
    """
    if number < 1:
        raise ValueError(f"number: expected at least 1, got {number}")
    if group not in (design.groups or ("",)):
        raise ValueError(f"group: expected one of {design.groups or ('',)}, got {group!r}")
    below = _numbers(seed, design.key, group)
    passed = 0
    while True:
        sets = design.blocks[below(len(design.blocks))]
        block = [sequence for sequence in design.sequences for _ in range(sets)]
        for last in range(len(block) - 1, 0, -1):
            other = below(last + 1)
            block[last], block[other] = block[other], block[last]
        if number <= passed + len(block):
            return block[number - passed - 1]
        passed += len(block)


def draw_faults(design: StudyDesign, seed: int, draws: Iterable[Draw]) -> tuple[str, ...]:
    """Return what is wrong with a log of draws, in sentences: other sequences than the seed's, gaps, doubles."""
    faults = []
    by_group: dict[str, list[Draw]] = {}
    for each in draws:
        by_group.setdefault(each.group, []).append(each)
    for group, logged in by_group.items():
        logged.sort(key=lambda draw: draw.number)
        name = f" of group {group}" if group else ""
        numbers = [each.number for each in logged]
        if numbers != list(range(1, len(numbers) + 1)):
            faults.append(
                f"The draws{name} are numbered {numbers}, not 1 to {len(numbers)}: draws are missing or added."
            )
        for each in logged:
            expected = sequence_text(drawn_sequence(design, seed, group, each.number))
            if each.sequence != expected:
                faults.append(f"Draw {each.number}{name} is {each.sequence}, and the seed gives {expected}.")
    return tuple(faults)


def _numbers(seed: int, study: str, group: str) -> Callable[[int], int]:
    """Return a function that gives the next even-handed whole number from 0 to below its argument.

    From SHA-256 and not from a library's generator, whose streams may differ from version to version.
    """
    start = f"cathxr-allocation/1\n{seed}\n{study}\n{group}\n"
    raw = (int.from_bytes(sha256(f"{start}{count}".encode()).digest()[:8], "big") for count in itertools.count())

    def below(limit: int) -> int:
        fair = 2**64 - 2**64 % limit
        return next(each for each in raw if each < fair) % limit

    return below
