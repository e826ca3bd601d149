"""A report as a PDF on A4 with its fonts inside. The same document gives the same file, byte for byte."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import matplotlib
from reportlab.lib.colors import HexColor
from reportlab.lib.enums import TA_LEFT, TA_RIGHT
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    BaseDocTemplate,
    Flowable,
    Frame,
    HRFlowable,
    Image,
    KeepTogether,
    ListFlowable,
    ListItem,
    PageTemplate,
    Spacer,
)
from reportlab.platypus import Paragraph as Text
from reportlab.platypus import Table as Grid

from cathxr.study.report.document import (
    Bullets,
    Document,
    Figure,
    Heading,
    Numbered,
    Paragraph,
    Table,
    kept_together,
    numbered,
)

_INK, _SOFT, _LINE = HexColor("#1b2330"), HexColor("#586273"), HexColor("#d9dee6")
_BACK = {"reading": (HexColor("#eef4fb"), HexColor("#0b5cad")), "warning": (HexColor("#fff4e0"), HexColor("#a85b00"))}
_MARGIN = 20 * mm
_WIDTH = A4[0] - 2 * _MARGIN
_KEPT_ROWS = 18  # a table this short is not torn by the end of a page
_LEAST = 4.5
_FONT, _BOLD = "CathxrSans", "CathxrSans-Bold"


def pdf(document: Document) -> bytes:
    """Return the document as a PDF file."""
    _register_fonts()
    out = io.BytesIO()
    template = BaseDocTemplate(
        out,
        pagesize=A4,
        leftMargin=_MARGIN,
        rightMargin=_MARGIN,
        topMargin=19 * mm,
        bottomMargin=19 * mm,
        title=document.title,
        subject=document.subtitle,
        author="cathxr",
        invariant=1,
    )
    frame = Frame(
        _MARGIN, 19 * mm, _WIDTH, A4[1] - 38 * mm, leftPadding=0, rightPadding=0, topPadding=0, bottomPadding=0
    )

    def foot(canvas: Canvas, _document: BaseDocTemplate) -> None:
        canvas.saveState()
        canvas.setFont(_FONT, 7.5)
        canvas.setFillColor(_SOFT)
        canvas.drawString(_MARGIN, 11 * mm, document.title[:90])
        canvas.drawRightString(A4[0] - _MARGIN, 11 * mm, str(canvas.getPageNumber()))
        canvas.restoreState()

    template.addPageTemplates([PageTemplate(id="page", frames=[frame], onPage=foot)])
    template.build(_story(document))
    return out.getvalue()


def _told(text: str) -> str:
    """Return a text as reportlab takes it."""
    return escape(kept_together(text))


def _register_fonts() -> None:
    """Make the fonts known that matplotlib brings: they have every sign that the texts use."""
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    for name, file in ((_FONT, "DejaVuSans.ttf"), (_BOLD, "DejaVuSans-Bold.ttf")):
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, str(folder / file)))
    pdfmetrics.registerFontFamily(_FONT, normal=_FONT, bold=_BOLD, italic=_FONT, boldItalic=_BOLD)


def _style(
    size: float, *, bold: bool = False, soft: bool = False, after: float = 5.0, right: bool = False
) -> ParagraphStyle:
    return ParagraphStyle(
        f"{size}{bold}{soft}{after}{right}",
        fontName=_BOLD if bold else _FONT,
        fontSize=size,
        leading=size * 1.42,
        textColor=_SOFT if soft else _INK,
        spaceAfter=after,
        alignment=TA_RIGHT if right else TA_LEFT,
    )


def _story(document: Document) -> list[Flowable]:
    story: list[Flowable] = [
        Text(_told(document.title), _style(18, bold=True, after=3)),
        Text(_told(document.subtitle), _style(10.5, soft=True, after=9)),
    ]
    facts = [
        [Text(_told(label), _style(8.5, soft=True, after=0)), Text(_told(value), _style(8.5, after=0))]
        for label, value in document.facts
    ]
    if facts:
        story.append(Grid(facts, colWidths=[36 * mm, _WIDTH - 36 * mm], style=[("LEFTPADDING", (0, 0), (-1, -1), 0),
                     ("TOPPADDING", (0, 0), (-1, -1), 1), ("BOTTOMPADDING", (0, 0), (-1, -1), 1)]))  # fmt: skip
    held: list[Flowable] = []  # headings wait for what follows them, so that none stands alone at a page's end
    for each in numbered(document.blocks):
        parts = _parts(each)
        if isinstance(each.block, Heading):
            held += parts[0]
            continue
        if held:
            parts = [[*held, *parts[0]], *parts[1:]]
            held = []
        story += [KeepTogether(group) if len(group) > 1 else group[0] for group in parts]
    return [*story, *held]


def _parts(each: Numbered) -> list[list[Flowable]]:
    """Return groups of what no end of a page may part."""
    block = each.block
    if isinstance(block, Heading):
        if block.level == 1:
            line = HRFlowable(width="100%", thickness=1.1, color=_INK, spaceBefore=13, spaceAfter=5)
            return [[line, Text(_told(block.text), _style(13, bold=True, after=5))]]
        return [[Spacer(1, 5), Text(_told(block.text), _style(10, bold=True, after=4))]]
    if isinstance(block, Paragraph):
        return [[_paragraph(block)]]
    if isinstance(block, Bullets):
        style = _style(9.2, after=2)
        items: list[Any] = [ListItem(Text(_told(text), style), leftIndent=11) for text in block.items]
        return [[ListFlowable(items, bulletType="bullet", start="•", bulletFontSize=8, leftIndent=11)], [Spacer(1, 5)]]
    if isinstance(block, Figure):
        scale = min(1.0, _WIDTH / (block.width_mm * mm))
        image = Image(io.BytesIO(block.png), width=block.width_mm * mm * scale, height=block.height_mm * mm * scale)
        return [[Spacer(1, 6), image, _caption(each.label, block.caption, 9)]]
    return _table(block, each.label)


def _paragraph(block: Paragraph) -> Flowable:
    if block.kind not in _BACK:
        return Text(_told(block.text), _style(8.2, soft=True) if block.kind == "small" else _style(9.2))
    back, line = _BACK[block.kind]
    style: list[Any] = [
        ("BACKGROUND", (0, 0), (-1, -1), back),
        ("LINEBEFORE", (0, 0), (0, -1), 2, line),
        ("LEFTPADDING", (0, 0), (-1, -1), 8),
        ("TOPPADDING", (0, 0), (-1, -1), 4),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 5),
    ]
    return Grid([[Text(_told(block.text), _style(9.2, after=0))]], colWidths=[_WIDTH], style=style,
                spaceBefore=3, spaceAfter=7)  # fmt: skip


def _caption(label: str, caption: str, after: float) -> Text:
    return Text(
        f'<font name="{_BOLD}" color="#1b2330">{label}.</font> {_told(caption)}', _style(8.2, soft=True, after=after)
    )


def _fitting(text: str, size: float, width: float) -> float:
    """Return the size, of `size` or below, at which no word of a bold text must be broken."""
    longest = max((pdfmetrics.stringWidth(word, _BOLD, size) for word in text.split()), default=0.0)
    return size if longest <= width else max(_LEAST, 0.99 * size * width / longest)


def _table(block: Table, label: str) -> list[list[Flowable]]:
    wide = len(block.head) > 7
    size = 6.9 if wide else 8.2

    padding = 5 if wide else 10
    shares = block.widths or tuple(1.0 for _ in block.head)
    widths = [_WIDTH * each / sum(shares) for each in shares]

    def cells(row: Sequence[str], *, bold: bool, sizes: Sequence[float]) -> list[Flowable]:
        return [
            Text(_told(cell), _style(sizes[at], bold=bold, after=0, right=at in block.numbers))
            for at, cell in enumerate(row)
        ]

    heads = [_fitting(cell, size, width - padding) for cell, width in zip(block.head, widths, strict=True)]
    plain = [size] * len(block.head)
    rows = [cells(block.head, bold=True, sizes=heads)]
    rows += [cells(row, bold=at in block.strong, sizes=plain) for at, row in enumerate(block.rows)]
    last = len(rows) - 1
    style: list[Any] = [
        ("LINEABOVE", (0, 0), (-1, 0), 1.0, _INK),
        ("LINEBELOW", (0, 0), (-1, 0), 0.6, _INK),
        ("LINEBELOW", (0, 1), (-1, max(1, last - 1)), 0.3, _LINE),
        ("LINEBELOW", (0, last), (-1, last), 1.0, _INK),
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("LEFTPADDING", (0, 0), (-1, -1), 0),
        ("RIGHTPADDING", (0, 0), (-1, -1), padding),
        ("TOPPADDING", (0, 0), (-1, -1), 2),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 2.5),
    ]
    grid = Grid(rows, colWidths=widths, repeatRows=1, style=style, spaceAfter=4)
    note: list[Flowable] = [Text(_told(block.note), _style(7.8, soft=True, after=9))] if block.note else [Spacer(1, 6)]
    caption = _caption(label, block.caption, 3)
    if len(block.rows) <= _KEPT_ROWS:
        return [[Spacer(1, 4), caption, grid, *note]]
    return [[Spacer(1, 4)], [caption], [grid], *([each] for each in note)]
