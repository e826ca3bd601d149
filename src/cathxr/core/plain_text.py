"""Texts that people write into files: what may stand in them."""

import unicodedata


def plain_text_fault(text: str, *, longest: int = 2000, lines: bool = False) -> str | None:
    """Return what is wrong with a text that is to be shown, as the end of a sentence; None where it is a good one.

    Good: something other than blanks, at most `longest` characters, none of them a control character (which screens
    obey, and which PostgreSQL refuses); lines: ends of lines and tabs are let through.
    """
    if not text.strip():
        return "expected a text, got none"
    if len(text) > longest:
        return f"expected at most {longest} characters, got {len(text)}"
    let_through = "\n\r\t" if lines else ""
    odd = next((each for each in text if unicodedata.category(each) == "Cc" and each not in let_through), None)
    return None if odd is None else f"expected letters and signs, got the control character U+{ord(odd):04X}"
