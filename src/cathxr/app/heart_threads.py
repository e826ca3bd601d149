"""Runs the independent jobs of the work on a heart side by side, in a few threads."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
_MOST_THREADS = 4
"""More gain little, and every structure that is worked on takes memory."""


def side_by_side(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """Return the jobs' results in their order; the first failure, or Ctrl-C, drops those that have not begun."""
    threads = min(len(jobs), os.cpu_count() or 1, _MOST_THREADS)
    if threads < 2:
        return [job() for job in jobs]
    # A pool of its own for each call: jobs may run jobs, and in one pool they could wait for each other's threads.
    with ThreadPoolExecutor(threads, thread_name_prefix="heart") as pool:
        futures = [pool.submit(job) for job in jobs]
        try:
            return [each.result() for each in futures]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
