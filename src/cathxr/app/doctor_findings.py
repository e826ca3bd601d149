"""What a check of `cathxr doctor` found, and the table that shows it."""

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

_STYLES = {"good": "green", "missing": "yellow", "wrong": "red"}


@dataclass(frozen=True)
class Finding:
    """What one check found. level: "good", "missing" (not needed for everything) or "wrong"."""

    what: str
    level: str
    found: str
    then: str = ""


def show(findings: Sequence[Finding]) -> None:
    """Print findings as a table."""
    table = Table("check", "", "found", "what to do")
    for each in findings:
        table.add_row(each.what, f"[{_STYLES[each.level]}]{each.level}[/]", each.found, each.then)
    Console().print(table)
