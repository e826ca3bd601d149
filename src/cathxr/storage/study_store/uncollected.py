"""Makes many thousands of values without Python's search for cycles among them, which would take half of the time."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """Yield with the cycle collector off; afterwards it is as it was. Only cycles made meanwhile wait for it."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
