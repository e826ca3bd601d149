"""Values of DICOM elements by keyword and kind: what is missing or cannot be is None, never an error that quotes it."""

import math
import struct
import zlib
from collections.abc import Sequence

from pydicom.dataset import Dataset

UNREADABLE = (
    ValueError, TypeError, AttributeError, LookupError, ArithmeticError, NotImplementedError, EOFError, struct.error,
    RecursionError, zlib.error,
)  # fmt: skip
"""What pydicom raises over damaged or odd data."""


class Elements:
    """Looks a keyword up in several data sets, the first that has it; functional groups go before the whole."""

    def __init__(self, datasets: Sequence[Dataset]) -> None:
        self._datasets = datasets

    def value(self, keyword: str) -> object | None:
        """Return the raw value, or None."""
        for each in self._datasets:
            try:
                value = each.get(keyword)
            except UNREADABLE:
                continue
            if value is not None and value != "":
                return value  # type: ignore[no-any-return]
        return None

    def numbers(self, keyword: str, count: int) -> tuple[float, ...] | None:
        """Return exactly `count` finite numbers, or None."""
        value = self.value(keyword)
        try:
            several = [value] if isinstance(value, (int, float, str)) else list(value)  # type: ignore[call-overload]
            found = tuple(float(each) for each in several)
        except UNREADABLE:
            return None
        return found if len(found) == count and all(map(math.isfinite, found)) else None

    def number(self, keyword: str, *, low: float = -math.inf, high: float = math.inf) -> float | None:
        """Return one number from low to high, or None."""
        found = self.numbers(keyword, 1)
        return found[0] if found and low <= found[0] <= high else None

    def whole(self, keyword: str, *, low: int = -(2**31), high: int = 2**32) -> int | None:
        """Return one whole number from low to high, or None."""
        found = self.number(keyword, low=low, high=high)
        return int(found) if found is not None and found == int(found) else None

    def words(self, keyword: str) -> tuple[str, ...]:
        """Return the texts of a multi-valued element, stripped; () where it is absent."""
        value = self.value(keyword)
        if value is None:
            return ()
        several = [value] if isinstance(value, str) or not isinstance(value, Sequence) else value
        try:
            return tuple(str(each).strip() for each in several)
        except UNREADABLE:
            return ()

    def text(self, keyword: str) -> str:
        """Return the text, its values joined by a space; "" where it is absent."""
        return " ".join(self.words(keyword))

    def items(self, keyword: str) -> list[Dataset]:
        """Return the items of a sequence; [] where it is absent."""
        value = self.value(keyword)
        return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else []
