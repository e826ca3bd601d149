"""The wiring diagram as SVG, from the parameters: supply and light, cameras, encoder and Nano, pins and colours."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cathxr.hardware.layout import Layout
from cathxr.hardware.purchase import front_strip_m, strip_m, supply_watt

_WIDE, _TALL = 1080, 860
_RED, _BLACK, _WHITE_WIRE, _GREEN, _BLUE, _GREY = "#c62828", "#111111", "#9e9e9e", "#2e7d32", "#1565c0", "#757575"


@dataclass(frozen=True)
class _Box:
    """A device: its corner, size, name, and a second line."""

    x: float
    y: float
    wide: float
    tall: float
    name: str
    more: str = ""
    fill: str = "#f4f6f8"


def wiring_svg(layout: Layout) -> str:
    """Return the diagram."""
    bodies = [*_light(layout), *_usb(layout), *_encoder(layout)]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDE}" height="{_TALL}" viewBox="0 0 {_WIDE} {_TALL}">\n'
        f"<title>Wiring</title>\n"
        f'<rect width="{_WIDE}" height="{_TALL}" fill="#ffffff"/>\n'
        f'<g font-family="sans-serif" fill="none">\n{"".join(bodies)}</g>\n</svg>\n'
    )


def _light(layout: Layout) -> Iterator[str]:
    back, front = strip_m(layout), 0.5 * front_strip_m(layout)
    yield _heading(40, 36, "Light: 24 V")
    supply = _Box(40, 90, 190, 120, "Supply", f"24 V DC, {supply_watt(layout):g} W or more", "#fff4e0")
    dimmers = [_Box(330, 60 + 110 * index, 170, 80, name) for index, name in
               enumerate(("Dimmer 1: back light", "Dimmer 2: front light"))]  # fmt: skip
    loads = (
        (_Box(660, 50, 380, 44, f"LED plate below the box: {back:.2f} m of strip", fill="#fffbe0"), 0),
        (_Box(660, 106, 380, 44, f"LED plate behind the box: {back:.2f} m of strip", fill="#fffbe0"), 0),
        (_Box(660, 162, 380, 44, f"around the window of the upper mask: {front:.2f} m", fill="#fffbe0"), 1),
        (_Box(660, 218, 380, 44, f"around the window of the front mask: {front:.2f} m", fill="#fffbe0"), 1),
    )
    for each in (supply, *dimmers, *(box for box, _ in loads)):
        yield from _box(each)
    for index, dimmer in enumerate(dimmers):
        y = dimmer.y + 28
        yield _wire(
            [(230, 125 + 40 * index), (270 + 16 * index, 125 + 40 * index), (270 + 16 * index, y), (330, y)], _RED
        )
        yield _wire([(230, 140 + 40 * index), (300 - 16 * index, 140 + 40 * index), (300 - 16 * index, y + 24),
                     (330, y + 24)], _BLACK)  # fmt: skip
    for box, index in loads:
        y, low = box.y + 15, dimmers[index].y + 28
        yield _wire([(500, low), (560, low), (560, y), (660, y)], _RED)
        yield _wire([(500, low + 24), (590, low + 24), (590, y + 14), (660, y + 14)], _BLACK)
    yield from _key(40, 245, ((_RED, "+24 V"), (_BLACK, "0 V")))


def _usb(layout: Layout) -> Iterator[str]:
    camera = layout.parameters.camera
    yield _heading(40, 330, "Computer: USB")
    pc = _Box(700, 360, 340, 190, "Computer", fill="#e8f0fa")
    yield from _box(pc, low_name=True)
    told = f"{camera.width_px} x {camera.height_px}, {camera.rate_hz:g} pictures/s"
    ports = (
        ("Top camera", told, "port on one controller", 370),
        ("Front camera", told, "port on another, where there is one", 430),
    )
    for name, more, port, y in ports:
        yield from _box(_Box(40, y, 250, 48, name, more))
        yield _wire([(290, y + 24), (700, y + 24)], _BLUE)
        yield _text(495, y + 18, port, 13, anchor="middle", fill=_BLUE)
    yield _wire([(560, 700), (600, 700), (600, 516), (700, 516)], _BLUE)
    yield _text(608, 600, "data cable", 13, fill=_BLUE)


def _encoder(layout: Layout) -> Iterator[str]:
    encoder = layout.parameters.encoder
    yield _heading(40, 540, "Roll encoder")
    yield from _box(_Box(40, 565, 190, 230, "Encoder", f"{encoder.pulses} pulses a turn, 5 V"), top_name=True)
    yield from _box(_Box(430, 565, 130, 230, "Nano", "", "#e3f2ec"), top_name=True)
    rows: Sequence[tuple[str, str, str, float]] = (
        ("GND, black", "GND", _BLACK, 636), ("VCC, red", "5V", _RED, 662), ("A, white", "D2", _WHITE_WIRE, 715),
        ("B, green", "D3", _GREEN, 742), ("screen", "GND", _GREY, 772),
    )  # fmt: skip
    for left, right, colour, y in rows:
        yield _wire([(230, y), (430, y)], colour, dashed=left == "screen")
        yield _text(222, y + 5, left, 14, anchor="end")
        yield _text(438, y + 5, right, 14)
    for x, y, colour in ((300, 715, _WHITE_WIRE), (360, 742, _GREEN)):
        yield _wire([(x, 662), (x, 672)], _RED)
        yield f'<rect x="{x - 6}" y="672" width="12" height="30" stroke="#111111" stroke-width="1.6" fill="#ffffff"/>\n'
        yield _wire([(x, 702), (x, y)], colour)
        for dot, shade in ((662, _RED), (y, colour)):
            yield f'<circle cx="{x}" cy="{dot}" r="4" fill="{shade}"/>\n'
    yield _text(330, 652, "2 x 4.7 kOhm", 13, anchor="middle")
    yield _text(
        40,
        822,
        "The resistors only where the encoder's outputs are open collectors. The screen at the Nano's end only.",
        14,
    )
    yield _text(
        40,
        843,
        "Wire colours differ between makers: go by the label. Never swap A and B: rig.toml has the sense.",
        14,
    )
    yield _text(640, 700, "The count on D2 and D3 comes as USB serial, 115200 baud.", 13)


def _box(box: _Box, *, top_name: bool = False, low_name: bool = False) -> Iterator[str]:
    yield (
        f'<rect x="{box.x}" y="{box.y}" width="{box.wide}" height="{box.tall}" rx="8" fill="{box.fill}" '
        'stroke="#37474f" stroke-width="1.6"/>\n'
    )
    middle = box.x + 0.5 * box.wide
    y = box.y + 0.5 * box.tall + (0 if box.more else 5)
    if top_name:
        y = box.y + 24
    if low_name:
        y = box.y + box.tall - 14
    yield _text(middle, y, box.name, 15, anchor="middle", bold=True)
    if box.more:
        yield _text(middle, y + 18, box.more, 13, anchor="middle")


def _heading(x: float, y: float, text: str) -> str:
    return _text(x, y, text, 19, bold=True)


def _key(x: float, y: float, entries: Sequence[tuple[str, str]]) -> Iterator[str]:
    for index, (colour, text) in enumerate(entries):
        left = x + 100 * index
        yield _wire([(left, y), (left + 30, y)], colour)
        yield _text(left + 38, y + 5, text, 13)


def _wire(places: Sequence[tuple[float, float]], colour: str, *, dashed: bool = False) -> str:
    points = " ".join(f"{x:g},{y:g}" for x, y in places)
    dash = ' stroke-dasharray="6 4"' if dashed else ""
    return f'<polyline points="{points}" stroke="{colour}" stroke-width="2.6"{dash}/>\n'


def _text(
    x: float, y: float, text: str, size: float, *, anchor: str = "start", bold: bool = False, fill: str = "#111111"
) -> str:
    weight = ' font-weight="bold"' if bold else ""
    return (
        f'<text x="{x:g}" y="{y:g}" font-size="{size:g}" text-anchor="{anchor}" fill="{fill}"{weight}>{text}</text>\n'
    )
