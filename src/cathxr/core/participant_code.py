"""Codes of participants: what may stand for a person in a study, and why something may not."""

import re

_SHAPE = re.compile(r"[A-Z0-9]+(?:-[A-Z0-9]+)*\Z")
_USUAL = re.compile(r"[A-Z]{1,3}-?[0-9]{1,3}\Z")
"""What most codes look like, and what passes every test below: stores check many thousands."""
_LONGEST = 12
_MOST_DIGITS = 5
_YEAR = re.compile(r"(?<!\d)(?:19|20)\d\d(?!\d)")
_EXAMPLE = "use a code such as P01 or EXP12 and keep the list of who is who elsewhere"


def participant_code_fault(code: str) -> str | None:
    """Return what is wrong with a participant's code, as the end of a sentence; None where it is a good one.

    Good: 2 to 12 capitals, digits and single hyphens, with a digit, at most three letters in a row, at most five digits
    and no year. So names, dates of birth and the numbers of hospitals and states do not pass. Initials do: nobody can
    tell P01 from them.
    """
    if _USUAL.match(code):
        return None
    if code.upper() != code and participant_code_fault(code.upper()) is None:
        return f"expected capitals, got {code!r}; write {code.upper()}"
    if not 2 <= len(code) <= _LONGEST or not _SHAPE.match(code):
        return f"expected 2 to {_LONGEST} capitals, digits and hyphens, got {code[:40]!r}; {_EXAMPLE}"
    if not any(each.isdigit() for each in code) or re.search(r"[A-Z]{4}", code):
        return f"{code} looks like a name; {_EXAMPLE}"
    if sum(each.isdigit() for each in code) > _MOST_DIGITS or _YEAR.search(code) or len(re.findall(r"\d+", code)) > 2:
        return f"{code} looks like a date or a person's number; {_EXAMPLE}"
    return None
