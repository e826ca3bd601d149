"""Who may command: the six-digit code that turns a viewer into an operator, and the limit on guessing it."""

import hmac
import re
import secrets
from collections import deque

from cathxr.core import Clock, ProtocolError

ATTEMPTS = 5
"""Wrong codes that one address may give within `LOCK_S`."""
LOCK_S = 60.0
TOTAL_ATTEMPTS = 30
"""Wrong codes from all addresses within `LOCK_S`: a guesser with many addresses needs weeks on average."""
_ADDRESSES_KEPT = 1024


def new_code() -> str:
    """Return a fresh code: six digits from the system's random source."""
    return f"{secrets.randbelow(10**6):06d}"


class Pairing:
    """Checks codes. For one thread only."""

    def __init__(self, code: str, clock: Clock) -> None:
        if not re.fullmatch(r"[0-9]{6}", code):
            raise ValueError(f"code: expected six digits, got {len(code)} characters")
        self.code = code
        self._clock = clock
        self._wrong: dict[str, deque[float]] = {}
        self._all_wrong: deque[float] = deque(maxlen=TOTAL_ATTEMPTS)

    def check(self, address: str, code: object) -> None:
        """Return when `code` is the right one.

        Raises:
            ProtocolError: it is not, or `address` must wait after too many wrong ones; the sentence says which.
        """
        now_s = self._clock.now_ns() * 1e-9
        wrong = self._wrong.get(address, deque())
        locked_s = max(_locked_s(wrong, now_s, ATTEMPTS), _locked_s(self._all_wrong, now_s, TOTAL_ATTEMPTS))
        if locked_s > 0:
            # Said of the right code too, else the answer would tell it.
            raise ProtocolError(f"Too many wrong pairing codes: wait {locked_s:.0f} s and try again.")
        given = re.sub(r"[\s-]", "", code) if isinstance(code, str) else ""
        if hmac.compare_digest(given.encode(), self.code.encode()):
            self._wrong.pop(address, None)
            return
        self._note(address, now_s)
        raise ProtocolError("That is not the pairing code: enter the six digits that the server's console shows.")

    def _note(self, address: str, now_s: float) -> None:
        if address not in self._wrong and len(self._wrong) >= _ADDRESSES_KEPT:
            self._wrong.pop(next(iter(self._wrong)))
        self._wrong.setdefault(address, deque(maxlen=ATTEMPTS)).append(now_s)
        self._all_wrong.append(now_s)


def _locked_s(wrong: deque[float], now_s: float, limit: int) -> float:
    """Return for how long no code is taken: until fewer than `limit` wrong ones lie within the last LOCK_S."""
    return 0.0 if len(wrong) < limit else max(0.0, wrong[-limit] + LOCK_S - now_s)
