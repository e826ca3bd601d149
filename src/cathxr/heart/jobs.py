"""Independent jobs: one after another here; side by side where the caller, who may have threads, says how."""

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

T = TypeVar("T")


class Together(Protocol):
    """How independent jobs are run."""

    def __call__(self, jobs: Sequence[Callable[[], T]]) -> list[T]:
        """Return the jobs' results in the order of the jobs. The first job that fails makes all of them fail."""
        ...


def one_after_another(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """Return the jobs' results, each job run when the one before it is done."""
    return [job() for job in jobs]
