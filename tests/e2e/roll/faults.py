"""Minutes of turning with everything going wrong that can, and a person who confirms only what is right."""

from collections import Counter
from collections.abc import Callable

from cathxr.core import DeviceError
from cathxr.devices.encoder_stream import INVALID

from .conftest import SECOND, START_NS, RollLine

WRONG_DEG = 1.0
_PICTURE_NS = SECOND // 30
_BETWEEN_S = (3.0, 10.0)


class FaultyLine:
    """A RollLine that has faults, and someone who sees to them. worst_deg: of the angles that were given as valid."""

    def __init__(self, seed: int, seconds: float) -> None:
        self.line = RollLine(seed, seconds)
        self.rng = self.line.rng
        self.kinds: Counter[str] = Counter()
        self.pictures = self.valid = self.wrong = 0
        self.worst_deg = 0.0
        self._until_ns = START_NS + round(seconds * SECOND)
        self._is_open = False
        self._faults: dict[str, Callable[[], None]] = {
            "damaged bytes": lambda: self._noisy(0.02, 2.0),
            "much damage": lambda: self._noisy(0.3, 0.7),
            "stall": lambda: self._for_a_while("held", self.rng.uniform(0.1, 1.5)),
            "loss": lambda: self._for_a_while("dropped", self.rng.uniform(0.1, 1.0)),
            "silence": lambda: self._for_a_while("dropped", 3.0),
            "reset": lambda: self._restart("external", 0.0),
            "reset in a boot loader": lambda: self._restart("external", 1.0),
            "watchdog": lambda: self._restart("watchdog", 0.0),
            "brownout": lambda: self._restart("brownout", 0.0),
            "unplugged": self._unplugged,
            "disturbed signal": self._slip,
        }

    @property
    def faults(self) -> int:
        """How many there were."""
        return sum(self.kinds.values())

    def run(self) -> None:
        """Let the time pass."""
        while self.line.clock.now_ns() < self._until_ns:
            self._pass(float(self.rng.uniform(*_BETWEEN_S)))
            name = str(self.rng.choice(sorted(self._faults)))
            self.kinds[name] += 1
            self._faults[name]()
            self._pass(float(self.rng.uniform(0.5, 2.0)))
            self._see_to_it()
        self._close()

    def _pass(self, seconds: float) -> None:
        """Take pictures for so long, opening the encoder again when it has gone."""
        clock = self.line.clock
        end_ns = clock.now_ns() + round(seconds * SECOND)
        while clock.now_ns() < end_ns:
            try:
                if not self._is_open:
                    self.line.encoder.__enter__()
                    self._is_open = True
                for looked in self.line.looks(clock.now_ns() + _PICTURE_NS, end_ns):
                    self.pictures += 1
                    off_deg = self.line.error_deg(looked)
                    if off_deg is not None and looked.sample is not None and not looked.sample.flags & INVALID:
                        self.valid += 1
                        self.wrong += abs(off_deg) > WRONG_DEG
                        self.worst_deg = max(self.worst_deg, abs(off_deg))
                if end_ns - clock.now_ns() <= _PICTURE_NS:
                    return
            except DeviceError:
                self._close()
                clock.wait_until_ns(clock.now_ns() + SECOND // 4)

    def _close(self) -> None:
        if self._is_open:
            self.line.encoder.__exit__(None, None, None)
            self._is_open = False
            self.line.history.clear()

    def _see_to_it(self) -> None:
        """Hold the handle still, look whether the angle is right, and confirm it or set the zero in the jig."""
        line = self.line
        state = line.encoder.state
        if state is None or state.valid:
            return
        line.hand.move(line.clock.now_ns(), False)
        self._pass(0.5)
        state = line.encoder.state
        if state is not None:
            right = line.geared.count(line.clock.now_ns())
            if state.needs_jig or state.miscounted or abs(line.readings[-1].count - right) > 1:
                line.encoder.set_zero(right)
            else:
                line.encoder.confirm()
        self._pass(1.0)
        line.hand.move(line.clock.now_ns(), True)

    def _noisy(self, share: float, seconds: float) -> None:
        self.line.port.faults.noise = share
        self._pass(seconds)
        self.line.port.faults.noise = 0.0

    def _for_a_while(self, fault: str, seconds: float) -> None:
        setattr(self.line.port.faults, fault, True)
        self._pass(float(seconds))
        setattr(self.line.port.faults, fault, False)

    def _restart(self, cause: str, waits_s: float) -> None:
        now_ns = self.line.clock.now_ns()
        self.line.board.transmit(now_ns)
        self.line.board.restart(now_ns, cause, waits_s=waits_s)

    def _unplugged(self) -> None:
        """Pull the plug for two seconds: the board has no power meanwhile."""
        self.line.port.faults.unplugged = True
        self._pass(2.0)
        self.line.port.faults.unplugged = False
        self._restart("power", 0.0)

    def _slip(self) -> None:
        """Lose 30 counts, as the board notices by impossible transitions."""
        self.line.slipped += 30
        self.line.board.illegal += 15
