"""The text of a heart's quality page: one HTML file with its pictures inside and no scripts."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.made import Made
from cathxr.heart.quality_checks import Check
from cathxr.heart.quality_ranges import SOURCES, USUAL

_STYLE = """
:root { color-scheme: light; --line: #dfe3ea; --ink: #1b2330; --soft: #5b6675; --good: #1d7a46; --bad: #b3261e; }
* { box-sizing: border-box; }
body { margin: 0; background: #f4f6f9; color: var(--ink); font: 15px/1.5 system-ui, "Segoe UI", Roboto, sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 28px 22px 60px; }
h1 { font-size: 25px; line-height: 1.25; margin: 0 0 4px; }
h2 { font-size: 17px; margin: 0 0 10px; }
p { margin: 0 0 10px; }
section { background: #fff; border: 1px solid var(--line); border-radius: 10px; padding: 18px 20px; margin: 16px 0; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 6px 12px 6px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
th { font-weight: 600; color: var(--soft); font-size: 13px; }
tr:last-child td { border-bottom: 0; }
td.n, th.n { text-align: right; white-space: nowrap; }
img { width: 100%; height: auto; display: block; border-radius: 6px; margin: 0 0 10px; }
ul { margin: 0; padding-left: 20px; }
li { margin: 0 0 6px; }
.soft { color: var(--soft); font-size: 13.5px; }
.verdict { font-weight: 600; font-size: 16px; }
.good { color: var(--good); } .bad { color: var(--bad); }
.mark { white-space: nowrap; font-weight: 600; }
.dot { display: inline-block; width: 11px; height: 11px; border-radius: 3px; margin-right: 8px; }
.scroll { overflow-x: auto; }
@media print { body { background: #fff; } section { break-inside: avoid; } }
"""


def page(made: Made, checks: Sequence[Check], pictures: Mapping[str, bytes]) -> str:
    """Return the page's HTML. pictures: PNG by name: "surfaces", and one for each plane of slices."""
    slices = {name: content for name, content in pictures.items() if name != "surfaces"}
    over = "the CT" if made.volume is not None else "the labels (no CT was given)"
    sections = [
        _section("In plain words", _findings(made)),
        _section("Surfaces", _image("The surfaces from four sides", pictures["surfaces"])),
        _section("Volumes", _volumes(made)),
        _section("Checks", _checks(checks)),
        _section(
            f"Slices over {over}",
            f'<p class="soft">Each line is where the final surface crosses the slice, in its structure\'s colour; '
            f"dotted white is a cap: a valve's plane, or where a vessel was cut. {_agree(made)}</p>"
            + "".join(_image(f"Slices: {name}", content) for name, content in slices.items()),
        ),
        _section("Openings and landmarks", _places(made)),
        _section("What it was made from", _source(made)),
    ]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(made.name)}: quality</title>\n<style>{_STYLE}</style></head>\n<body><main>\n"
        f"<h1>{escape(made.name)}</h1>\n{_verdict(made, checks)}\n" + "\n".join(sections) + "\n</main></body></html>\n"
    )


def _verdict(made: Made, checks: Sequence[Check]) -> str:
    failed = [check for check in checks if check.met is False]
    passed = sum(check.met is True for check in checks)
    if failed:
        what = "; ".join(check.what.lower() for check in failed)
        told = f'<span class="bad">{len(failed)} of {passed + len(failed)} checks failed</span>: {escape(what)}.'
    else:
        told = f'<span class="good">All {passed} checks of the surfaces passed.</span>'
    extra = (
        f" {len(made.findings) + len(made.places.findings)} remarks below say what the scan or the labels did not give."
        if made.findings or made.places.findings
        else ""
    )
    return (
        f'<p class="verdict">{told}</p><p class="soft">{_phase(made)} The checks are about shape and fidelity to the '
        f"labels; whether the labels are right is for a person to judge, from the slices.{extra} For training and "
        "research; not a medical device.</p>"
    )


def _phase(made: Made) -> str:
    """Return which phase of the heartbeat this is, as far as anything tells it."""
    if made.volume is None:
        return "Made from labels alone: the cardiac phase is not known."
    if made.volume.technical.phase:
        return f"Cardiac phase: {escape(made.volume.technical.phase)}."
    return "The scan does not state its cardiac phase: the volumes may not be called end-diastolic."


def _findings(made: Made) -> str:
    remarks = list(made.volume.technical.remarks) if made.volume is not None else []
    sentences = [*made.findings, *made.places.findings, *remarks]
    if not sentences:
        return "<p>Nothing to remark.</p>"
    return "<ul>" + "".join(f"<li>{escape(each)}</li>" for each in sentences) + "</ul>"


def _volumes(made: Made) -> str:
    rows = []
    for part in made.parts:
        anatomy, usual, checks = CATALOGUE[part.key], USUAL.get(part.key), part.checks
        rows.append(
            (
                f'<span class="dot" style="background:{anatomy.colour}"></span>{escape(anatomy.name)}',
                f"{checks.labels_ml:.1f}",
                f"{checks.surface_ml:.1f}",
                _per_cent(checks.volume_change),
                f"{checks.distance_p95_mm:.3f}",
                f"{len(part.caps):,}",
                f"{usual.men} · {usual.women}" if usual else "",
                f"{usual.when} [{usual.source}]" if usual else "",
            )
        )
    head = (
        "structure", "labels, mL", "surface, mL", "change", "95 % within, mm", "triangles",
        "healthy men · women", "of these",
    )  # fmt: skip
    sources = "<br>".join(f"[{number}] {escape(text)}" for number, text in enumerate(SOURCES, 1))
    return (
        _table(head, rows, numbers=(1, 2, 3, 4, 5))
        + '<p class="soft">Usual volumes are for comparison, not a judgement: they hold for their phase and for the '
        "way in which papillary muscles, appendage and veins were counted there. "
        f"“95 % within” is the distance of the light surface from the one before decimation.<br>{sources}</p>"
    )


def _checks(checks: Sequence[Check]) -> str:
    marks = {
        True: '<span class="mark good">✓ met</span>',
        False: '<span class="mark bad">✕ not met</span>',
        None: '<span class="mark soft">– stated</span>',
    }
    rows = [(marks[each.met], escape(each.what), escape(each.required), escape(each.measured)) for each in checks]
    return _table(("", "what", "required", "measured"), rows)


def _places(made: Made) -> str:
    openings = [
        (escape(each.name), escape(CATALOGUE[each.structure].name), _point(each.centroid_mm), f"{each.diameter_mm:.1f}")
        for each in made.places.openings.values()
    ]
    landmarks = [(escape(each.name), _point(each.position_mm)) for each in made.places.landmarks.values()]
    told = ""
    if openings:
        told += _table(("opening", "of", "centre in ct (LPS), mm", "diameter, mm"), openings, numbers=(3,))
    if landmarks:
        told += "<br>" + _table(("landmark", "in ct (LPS), mm"), landmarks)
    return told or "<p>None were found.</p>"


def _source(made: Made) -> str:
    grid, source = made.labels.grid, made.source
    spacing = " × ".join(f"{each:.3g}" for each in grid.spacing_mm)
    rows = [
        ("source", ". ".join(escape(each) for each in (source.title, source.authors) if each)),
        ("licence", escape(source.licence)),
        ("changes", escape(source.changes)),
        ("grid", f"{' × '.join(str(n) for n in grid.shape[::-1])} voxels of {spacing} mm"),
    ]
    if made.volume is not None:
        technical = made.volume.technical
        contrast = {True: "yes", False: "no", None: "not stated"}[technical.contrast]
        rows += [
            ("modality", escape(technical.modality)),
            ("contrast", contrast),
            ("kernel", escape(technical.kernel) or "not stated"),
            ("slice thickness", _or_not(technical.slice_thickness_mm, "mm")),
            ("tube voltage", _or_not(technical.tube_voltage_kv, "kV")),
        ]
    return _table(("", ""), [row for row in rows if row[1]])


def _agree(made: Made) -> str:
    return "" if made.volume is None else "Where a line does not follow the bright blood, correct it with seeds."


def _or_not(value: float | None, unit: str) -> str:
    return "not stated" if value is None else f"{value:g} {unit}"


def _per_cent(share: float) -> str:
    return f"{share:+.2%}".replace("%", " %") if abs(share) >= 5e-5 else "0.00 %"


def _point(position: Iterable[float]) -> str:
    return ", ".join(f"{each:.1f}" for each in position)


def _section(title: str, content: str) -> str:
    return f"<section><h2>{title}</h2>{content}</section>"


def _image(text: str, png: bytes) -> str:
    return f'<img alt="{escape(text)}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], *, numbers: Sequence[int] = ()) -> str:
    """Return a table; `numbers`: the columns that are set to the right."""

    def cells(tag: str, row: Sequence[str]) -> str:
        return "".join(f"<{tag}{' class=n' if at in numbers else ''}>{each}</{tag}>" for at, each in enumerate(row))

    top = f"<tr>{cells('th', [escape(each) for each in head])}</tr>" if any(head) else ""
    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="scroll"><table>{top}{body}</table></div>'
