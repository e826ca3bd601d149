"""The fake board behind a pseudo-terminal: other programs, and pyserial, open it like a port. Not on Windows."""

import contextlib
import os
import select
import threading
from types import TracebackType
from typing import Self

from cathxr.core import Clock, DeviceError
from cathxr.devices.encoder_fake import FakePort

_STEP_S = 0.002


class FakeTerminal:
    """Serves a FakePort on a pseudo-terminal while it is entered. `name`: what to open. `unplug` takes it away.

    A pseudo-terminal has no DTR line: opening it resets nothing; the board's `restart` is there for that.
    """

    def __init__(self, port: FakePort, *, clock: Clock) -> None:
        self.port, self.name = port, ""
        self._clock = clock
        self._master = -1
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        if os.name == "nt":
            raise DeviceError("Windows has no pseudo-terminals: use a FakePort in memory.")
        import pty
        import tty

        self._master, other = pty.openpty()
        tty.setraw(other)
        self.name = os.ttyname(other)
        os.close(other)
        os.set_blocking(self._master, False)
        self._stopping.clear()
        self._thread = threading.Thread(target=self._run, name="fake-encoder", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.unplug()

    def unplug(self) -> None:
        """Take the port away from whoever has it open."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
            os.close(self._master)

    def _run(self) -> None:
        while not self._stopping.wait(_STEP_S):
            data = self.port.read(0.0)
            if self._nobody():
                continue
            # A host that does not read fills the terminal; what finds no room is lost, as on a real port.
            with contextlib.suppress(BlockingIOError, OSError):
                os.write(self._master, data)
            with contextlib.suppress(BlockingIOError, OSError):
                self.port.write(os.read(self._master, 4096))

    def _nobody(self) -> bool:
        """Return whether no program has it open."""
        poll = select.poll()
        poll.register(self._master, select.POLLIN)
        return any(event & select.POLLHUP for _, event in poll.poll(0))
