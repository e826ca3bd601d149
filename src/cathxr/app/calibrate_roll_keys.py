"""Single keys from the console without their echo; whole lines where the input is no terminal."""

import os
import queue
import sys
import threading
import time
from types import TracebackType
from typing import Any, Self

ENTER = "\n"
END = "\x04"
"""The input has ended."""


class Keys:
    """A context manager; `poll` gives a key, ENTER, END, or "" when nothing was pressed. Ctrl-C works as ever."""

    def __init__(self) -> None:
        self._lines: queue.Queue[str] = queue.Queue()
        self._before: Any = None
        self._terminal = sys.stdin is not None and sys.stdin.isatty()

    def __enter__(self) -> Self:
        if not self._terminal:
            threading.Thread(target=self._read_lines, name="keys", daemon=True).start()
        elif os.name != "nt":
            import termios

            number = sys.stdin.fileno()
            self._before = termios.tcgetattr(number)
            quiet = termios.tcgetattr(number)
            quiet[3] &= ~(termios.ECHO | termios.ICANON)
            termios.tcsetattr(number, termios.TCSADRAIN, quiet)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None:
            import termios

            termios.tcsetattr(sys.stdin.fileno(), termios.TCSADRAIN, self._before)
            self._before = None

    def poll(self, timeout_s: float) -> str:
        """Return the next key, in lower case."""
        if not self._terminal:
            try:
                return self._lines.get(timeout=timeout_s)
            except queue.Empty:
                return ""
        return _windows_key(timeout_s) if os.name == "nt" else _posix_key(timeout_s)

    def _read_lines(self) -> None:
        for line in sys.stdin or ():
            self._lines.put(line.strip()[:1].lower() or ENTER)
        self._lines.put(END)


def _posix_key(timeout_s: float) -> str:
    import select

    ready, _, _ = select.select([sys.stdin], [], [], timeout_s)
    if not ready:
        return ""
    key = os.read(sys.stdin.fileno(), 1).decode("ascii", errors="replace")
    return END if key == "" else ENTER if key in "\r\n" else key.lower()


def _windows_key(timeout_s: float) -> str:
    import msvcrt

    until_s = time.monotonic() + timeout_s
    while not msvcrt.kbhit():  # type: ignore[attr-defined,unused-ignore]
        left_s = until_s - time.monotonic()
        if left_s <= 0.0:
            return ""
        time.sleep(min(left_s, 0.02))
    key = str(msvcrt.getwch())  # type: ignore[attr-defined,unused-ignore]
    if key == "\x03":
        raise KeyboardInterrupt
    return ENTER if key in "\r\n" else key.lower()
