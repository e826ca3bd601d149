"""The cardiac phase in a series' free text. The text is looked at in memory and goes nowhere: a number comes out."""

import re

_PERCENT = re.compile(r"(?<![\d.])(\d{1,3}(?:\.\d{1,2})?)\s?%")
_NAMED = re.compile(r"\b(?:phase|ph|rr)[ _:=-]?(\d{1,3}(?:\.\d{1,2})?)\b", re.IGNORECASE)


def described_percent(text: str) -> float | None:
    """Return the per cent of the RR interval that a text gives ("CorCTA 75 %", "phase 40"); None for none or two."""
    for pattern in (_PERCENT, _NAMED):
        found = {float(each) for each in pattern.findall(text)}
        if len(found) == 1 and (percent := found.pop()) <= 100.0:
            return percent
    return None
