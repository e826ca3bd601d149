"""The table that shows what the checks of `cathxr doctor` found."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from cathxr.runtime.setup_nouns import SetupCheck

_STYLES = {"good": "green", "warn": "yellow", "unknown": "blue", "wrong": "red"}


def show(findings: Sequence[SetupCheck]) -> None:
    """Print findings as a table."""
    table = Table("check", "", "found", "what to do")
    for each in findings:
        table.add_row(each.title, f"[{_STYLES[each.verdict]}]{each.verdict}[/]", each.found, each.then)
    Console().print(table)
