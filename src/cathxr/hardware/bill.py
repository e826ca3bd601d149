"""The bill of materials as CSV and Markdown, from the parts' masses and the shopping list."""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cathxr.hardware.layout import Layout
from cathxr.hardware.purchase import NOT_DRAWN, sheet_list, shopping_list

_COLUMNS = ("group", "item", "quantity", "unit", "mass_g_each", "mass_g", "specification", "file")


@dataclass(frozen=True)
class MadePart:
    """A part that is made. kind: "printed", "soft" or "cut"; mass_g: of one, full; file: its name without an ending."""

    key: str
    title: str
    kind: str
    quantity: int
    mass_g: float
    note: str = ""


_GROUPS = {"printed": "print", "soft": "print, TPU", "cut": "laser"}
_TITLES = {
    "print": "To print, PETG",
    "print, TPU": "To print, TPU",
    "laser": "To cut",
    "sheet": "Sheets for that",
    "buy": "To buy",
}


_ABOUT = (
    "About: rods, screws, nuts, magnets, balls and pins from their size, the rest as makers state it for such things."
)


def bill_rows(layout: Layout, made: Iterable[MadePart]) -> list[tuple[str, ...]]:
    """Return the bill's rows of texts, in the order of the columns of the CSV."""
    rows: list[tuple[str, ...]] = []
    for each in sorted(made, key=lambda part: (list(_GROUPS).index(part.kind), part.key)):
        total = each.quantity * each.mass_g
        rows.append((_GROUPS[each.kind], each.title, str(each.quantity), "piece", f"{each.mass_g:.1f}", f"{total:.0f}",
                     each.note, each.key))  # fmt: skip
    for group, listed in (("sheet", sheet_list(layout)), ("buy", shopping_list(layout))):
        for bought in listed:
            one, every = (
                ("", "")
                if bought.mass_g is None
                else (f"{bought.mass_g:.1f}", f"{bought.quantity * bought.mass_g:.0f}")
            )
            rows.append((group, bought.item, f"{bought.quantity:g}", bought.unit, one, every, bought.specification, ""))
    return rows


def bill_csv(rows: Sequence[tuple[str, ...]]) -> str:
    """Return the bill as CSV."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(_COLUMNS)
    writer.writerows(rows)
    return buffer.getvalue()


def bill_markdown(layout: Layout, rows: Sequence[tuple[str, ...]]) -> str:
    """Return the bill as Markdown, a table for each group."""
    lines = [f"# Bill of materials: {layout.parameters.name}", ""]
    lines += ["Masses are those of full parts; with a filling of 20 % a thick part weighs about half.", ""]
    for group, title in _TITLES.items():
        own = [row for row in rows if row[0] == group]
        if not own:
            continue
        lines += [f"## {title}", ""]
        together = f"Together {sum(float(row[5] or 0.0) for row in own) / 1000:.2f} kg."
        if group == "sheet":
            lines += ["| what | quantity | specification |", "|---|---:|---|"]
            lines += [f"| {row[1]} | {row[2]} {row[3]} | {row[6]} |" for row in own]
            lines += ["", "Their mass is that of the parts above, and the waste."]
        elif group == "buy":
            lines += ["| what | quantity | g each | g | specification |", "|---|---:|---:|---:|---|"]
            lines += [f"| {row[1]} | {row[2]} {row[3]} | {row[4]} | {row[5]} | {row[6]} |" for row in own]
            lines += ["", f"{together} {_ABOUT}"]
        else:
            lines += ["| part | file | pieces | g each | g | note |", "|---|---|---:|---:|---:|---|"]
            lines += [f"| {row[1]} | `{row[7]}` | {row[2]} | {row[4]} | {row[5]} | {row[6]} |" for row in own]
            lines += ["", together]
        lines.append("")
    lines += [f"Not drawn in the assembly: {', '.join(NOT_DRAWN)}.", ""]
    return "\n".join(lines)
