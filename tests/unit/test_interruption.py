"""A Ctrl-C that a callback swallowed still ends the work."""

import contextlib
import signal

import pytest

from cathxr.app.interruption import heeded_ctrl_c


def test_a_swallowed_ctrl_c_is_raised_at_the_next_check() -> None:
    before = signal.getsignal(signal.SIGINT)
    with heeded_ctrl_c() as check:
        check()
        with contextlib.suppress(KeyboardInterrupt):  # as a library's callback does
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            check()
    assert signal.getsignal(signal.SIGINT) is before


def test_without_ctrl_c_nothing_happens() -> None:
    with heeded_ctrl_c() as check:
        check()
