"""The heart's walls for live training, made in a process of its own: they take seconds that tracking cannot spare."""

import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from pathlib import Path

from cathxr.training.metrics import Depth

_NICENESS = 10


def wall_depth_elsewhere(heart: Path | None) -> Depth | None:
    """Return how deep points of `box` are in the wall of a heart (its folder, None: the built-in one).

    None without labels, or the libraries to read them. Waits for the other process, and lets other threads run.
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_calm) as pool:
        return pool.submit(_made, heart).result()


def _calm() -> None:
    """Let the live system go first, leave Ctrl-C to it, and complain to nobody when it has gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    if hasattr(os, "nice"):
        os.nice(_NICENESS)
    threading.Thread(target=_end_with_parent, name="cathxr-parent", daemon=True).start()


def _end_with_parent() -> None:
    """End this process when the live system has gone, also where that was killed and could not say so."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _made(heart: Path | None) -> Depth | None:
    from cathxr.app.heart_registration import registration_of
    from cathxr.app.register_heart import chosen_heart
    from cathxr.app.score_inputs import wall_depth

    folder = chosen_heart(heart)
    return wall_depth(folder, registration_of(folder))
