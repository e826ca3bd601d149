"""The real firmware, built as the Arduino IDE would, on a simulated ATmega328P behind a pseudo-terminal."""

import os
import select
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
import pytest
import serial
from numpy.typing import NDArray

HZ = 16_000_000
GRAY = np.array([0, 1, 3, 2], dtype=np.uint64)
UNDER_CI = os.environ.get("CI", "").lower() in ("1", "true", "yes")
OLD_LOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex")


@dataclass(frozen=True)
class Built:
    """Where the built things are, and what of the firmware the linker says."""

    simulator: Path
    firmware: Path

    def symbol(self, name: str) -> int:
        """Return a variable's address in the board's memory."""
        listing = subprocess.run(["avr-nm", "-C", self.firmware], capture_output=True, text=True, check=True).stdout
        line = next(each for each in listing.splitlines() if each.endswith(name))
        return int(line.split()[0], 16) - 0x800000

    def sections(self) -> dict[str, int]:
        """Return the sizes of the sections, bytes."""
        listing = subprocess.run(["avr-size", "-A", self.firmware], capture_output=True, text=True, check=True).stdout
        rows = [each.split() for each in listing.splitlines() if each.startswith(".")]
        return {row[0]: int(row[1]) for row in rows}


@pytest.fixture(scope="session")
def built(repo_root: Path, require_tool: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> Built:
    """The firmware and its simulator, built once; skips (fails under CI=true) where a tool is absent."""
    for tool in ("make", "cc", "avr-gcc", "arduino-builder"):
        require_tool(tool)
    for needed in ("/usr/include/simavr/sim_avr.h", "/usr/include/libelf.h", "/usr/share/arduino/hardware/arduino/avr"):
        if not Path(needed).exists():
            sentence = f"{needed} is not there: the packages are named in firmware/roll_encoder/README.md"
            pytest.fail(sentence, pytrace=False) if UNDER_CI else pytest.skip(sentence)
    out = tmp_path_factory.mktemp("firmware")
    command = ["make", "-C", str(repo_root / "firmware" / "simulation"), f"OUT={out}", "firmware", "simulator"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return Built(out / "simulator", out / "firmware" / "roll_encoder.ino.elf")


class Board:
    """The simulated board. A context manager; `ask` gives the simulator a command and returns its answer."""

    def __init__(self, built: Built, folder: Path, loader: str = "none") -> None:
        self._folder, self.port_name = folder, ""
        command = [built.simulator, built.firmware, "--loader", loader]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self.port_name = self._answer().split()[0]
        self._played = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        self._process.wait(10)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()

    def ask(self, command: str) -> str:
        """Return the answer to a command, without its "ok"."""
        assert self._process.stdin is not None
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        # One line for one command: nothing waits in Python's own buffer when this is called.
        assert select.select([self._process.stdout], [], [], 60.0)[0], "the simulator does not answer"
        answer = self._process.stdout.readline().strip()
        assert answer.startswith("ok"), f"the simulator says {answer!r}"
        return answer.removeprefix("ok").strip()

    def run(self, seconds: float) -> None:
        """Run for so long of the board's time, as fast as it goes."""
        self.ask(f"run {round(seconds * HZ)}")

    def play(self, cycles: NDArray[np.uint64], inputs: NDArray[np.uint64]) -> int:
        """Have the channels change at these cycles; return the cycle from which they count."""
        path = self._folder / f"edges_{self._played}.bin"
        self._played += 1
        (cycles.astype("<u8") * 4 + inputs.astype("<u8")).tofile(path)
        return int(self.ask(f"play {path}"))

    def serial(self) -> serial.Serial:
        """Return the port, opened by pyserial as a program of anyone's would."""
        return serial.Serial(self.port_name, 115200, timeout=0.05, exclusive=True)


class Dialogue:
    """Talks with a board that only runs when told to: what it says between two looks, line by line."""

    def __init__(self, board: Board) -> None:
        self.board, self.port = board, board.serial()
        self.board.ask("state")
        time.sleep(0.05)  # until the simulator has seen it open
        self._rest = b""
        self._missing = -self._sent()

    def _sent(self) -> int:
        return int(self.board.ask("state").split()[1])

    def close(self) -> None:
        self.port.close()

    def run(self, seconds: float) -> list[bytes]:
        """Run and return the lines that came meanwhile."""
        data = self._rest
        pieces = max(1, round(seconds / 0.1))  # what is not fetched in time would not fit into the terminal
        for _ in range(pieces):
            self.board.run(seconds / pieces)
            # The system hands it over when it comes to it: what was sent is waited for.
            until = time.monotonic() + 20.0
            wanted, before = self._missing + self._sent(), len(data)
            while len(data) - before < wanted and time.monotonic() < until:
                data += self.port.read(max(1, self.port.in_waiting))
            self._missing -= len(data) - before
        *lines, self._rest = data.split(b"\n")
        return lines

    def say(self, line: bytes, seconds: float = 0.02) -> list[bytes]:
        self.port.write(line)
        return self.run(seconds)


@pytest.fixture
def board(built: Built, tmp_path: Path) -> Iterator[Board]:
    """A board without a boot loader, under power, not yet running."""
    with Board(built, tmp_path) as made:
        yield made


def quadrature(
    steps: NDArray[np.int64],
    rate: float,
    *,
    phase_error: float = 0.0,
    jitter: float = 0.0,
    seed: int = 0,
    start: int = 0,
) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """Return cycles and inputs of an encoder turned by these steps (1 or -1) at `rate` edges a second.

    phase_error: by how much of an edge's interval channel B is late; jitter: every edge's own, uniform, of the same.
    start: the position before.
    """
    rng = np.random.default_rng(seed)
    position = start + np.cumsum(steps)
    inputs = GRAY[position % 4]
    before = GRAY[(position - steps) % 4]
    is_b = (inputs ^ before) == 2
    interval = HZ / rate
    when = (np.arange(len(steps)) + phase_error * is_b + rng.uniform(0.0, jitter, len(steps))) * interval
    return np.maximum.accumulate(np.round(when)).astype(np.uint64), inputs
