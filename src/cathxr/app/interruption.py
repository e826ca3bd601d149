"""Ctrl-C that is not lost: the exception may be raised inside a library's callback, which swallows it."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def heeded_ctrl_c() -> Iterator[Callable[[], None]]:
    """Give a check to be called now and then: it raises KeyboardInterrupt when Ctrl-C was pressed and came to nothing.

    Ctrl-C itself raises at once, as always.
    """
    pressed = threading.Event()

    def press(_number: int, _frame: FrameType | None) -> None:
        pressed.set()
        raise KeyboardInterrupt

    def check() -> None:
        if pressed.is_set():
            raise KeyboardInterrupt

    before = signal.getsignal(signal.SIGINT)
    # elsewhere than in the main thread, or where somebody else heeds the signal, it is left as it is
    if threading.current_thread() is not threading.main_thread() or before is not signal.default_int_handler:
        yield check
        return
    signal.signal(signal.SIGINT, press)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
