"""In which order targets are offered: fixed, random by seed, or a row of a Latin square balanced for carry-over."""

import numpy as np

from cathxr.core.latin_square import williams_orders
from cathxr.training.task import Task


def order_of(task: Task, *, seed: int = 0, row: int = 0) -> tuple[str, ...]:
    """Return the keys of the targets in the order in which they are offered, as many as the task draws.

    seed: of a random order (NumPy's PCG64). row: which order of the Williams design a "latin" task takes, counted on
    from the last after the first (the participant's number, or the trial's).
    """
    keys = [each.key for each in task.targets]
    if task.order == "random":
        places = np.random.default_rng(seed).permutation(len(keys)).tolist()
    elif task.order == "latin":
        orders = williams_orders(len(keys))
        places = list(orders[row % len(orders)])
    else:
        places = list(range(len(keys)))
    return tuple(keys[each] for each in places)[: task.draw]
