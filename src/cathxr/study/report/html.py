"""A report as one HTML file: pictures inside, no scripts, no request to anywhere."""

import base64
from importlib import resources
from typing import Any

from jinja2 import Environment, StrictUndefined

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

_PX_A_MM = 5.0


def html(document: Document) -> str:
    """Return the document's HTML."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, finalize=_kept_together)
    template = environment.from_string(
        resources.files("cathxr.study.report").joinpath("page.html.j2").read_text(encoding="utf-8")
    )
    sections = [each.text for each in document.blocks if isinstance(each, Heading) and each.level == 1]
    blocks: list[dict[str, Any]] = []
    number = 0
    for each in numbered(document.blocks):
        number += isinstance(each.block, Heading) and each.block.level == 1
        blocks.append({"block": each.block, "label": each.label, "number": number, **_shown(each)})
    return template.render(document=document, sections=sections, blocks=blocks)


def _kept_together(value: Any) -> Any:
    return kept_together(value) if isinstance(value, str) else value


def _shown(each: Numbered) -> dict[str, Any]:
    block = each.block
    if isinstance(block, Heading):
        return {"kind": "h1" if block.level == 1 else "h2"}
    if isinstance(block, Paragraph):
        return {"kind": "paragraph"}
    if isinstance(block, Bullets):
        return {"kind": "bullets"}
    if isinstance(block, Figure):
        data = base64.b64encode(block.svg).decode()
        return {"kind": "figure", "data": data, "width_px": round(block.width_mm * _PX_A_MM)}
    assert isinstance(block, Table)
    return {"kind": "table", "shares": [round(100.0 * width / sum(block.widths), 1) for width in block.widths]}
