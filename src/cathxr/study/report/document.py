"""What a report consists of, whatever it is written as. Texts are plain: the writers escape them."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Heading:
    """level: 1 for a section, 2 within one."""

    text: str
    level: int = 1


@dataclass(frozen=True)
class Paragraph:
    """kind: "reading" says in plain words what a result means, "warning" what must not be missed, "small" is a note."""

    text: str
    kind: Literal["plain", "reading", "warning", "small"] = "plain"


@dataclass(frozen=True)
class Bullets:
    """Short sentences, one a line."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """rows: each as long as head. numbers: the columns that are set to the right. strong: rows that are set in bold.

    widths: relative widths of the columns, for paper; equal where empty.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    note: str = ""
    strong: tuple[int, ...] = ()
    widths: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if any(len(row) != len(self.head) for row in self.rows):
            raise ValueError(f"rows: expected {len(self.head)} cells each, as the head has")
        if self.widths and len(self.widths) != len(self.head):
            raise ValueError(f"widths: expected {len(self.head)}, got {len(self.widths)}")


@dataclass(frozen=True)
class Figure:
    """A picture twice: svg for a screen, png for paper. width_mm: as it is printed. alt: what it shows, in words."""

    caption: str
    alt: str
    svg: bytes
    png: bytes
    width_mm: float
    height_mm: float


Block = Heading | Paragraph | Bullets | Table | Figure


@dataclass(frozen=True)
class Document:
    """facts: label and value, shown below the title. blocks: in reading order."""

    title: str
    subtitle: str
    facts: tuple[tuple[str, str], ...]
    blocks: tuple[Block, ...]


def kept_together(text: str) -> str:
    """Return a text in which no line ends between a number and its per cent sign, or within "p = 0.041"."""
    for parted in (" %", "p = ", "p < "):
        text = text.replace(parted, parted.replace(" ", "\u00a0"))
    return text


@dataclass(frozen=True)
class Numbered:
    """A block with the name that captions and texts call it by, such as "Table 2"; "" for what has no caption."""

    block: Block
    label: str


def numbered(blocks: Iterable[Block]) -> tuple[Numbered, ...]:
    """Return the blocks with tables and figures counted from 1, each kind by itself."""
    tables = figures = 0
    found = []
    for block in blocks:
        label = ""
        if isinstance(block, Table):
            tables += 1
            label = f"Table {tables}"
        elif isinstance(block, Figure):
            figures += 1
            label = f"Figure {figures}"
        found.append(Numbered(block, label))
    return tuple(found)
