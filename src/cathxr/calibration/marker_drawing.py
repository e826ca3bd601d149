"""The picture that shows what was found of the fiducials, what was not, and what was taken for something else."""

import cv2
import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from cathxr.calibration.drawing import BAD, GOOD, INK, WARN, new_figure, png
from cathxr.calibration.sighting import Sighting
from cathxr.core import FloatArray, PixelArray

_DIMMED, _DIMMED_DN = 1.4, 120.0
"""How much a picture is made brighter at most, and the level that its brightest parts get."""
_WIDTH_IN, _DPI = 9.6, 150
_PAPER, _GREY = "#f7f8fa", "#d8d8d8"
_SHOWN_REJECTED = 24
_LINE_CHARACTERS = 150
_LINES = {
    "red": "#ff4d4d",
    "orange": "#ff9a2e",
    "yellow": "#ffe23d",
    "green": "#3ddc5f",
    "cyan": "#35e0e6",
    "blue": "#5aa2ff",
    "magenta": "#ff62e0",
}


def sighting_png(pixels: PixelArray, sighting: Sighting) -> bytes:
    """Return a PNG: the picture (H, W, 3) BGR or (H, W), dimmed, with rings and names, and a sentence below it.

    A solid ring in the marker's colour: found. Dashed: missing, where it was expected. Dotted: likely, but not sure.
    Thin grey: looked at and left, with the reason where there is room.
    """
    height, width = pixels.shape[:2]
    shown = cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB if pixels.ndim == 3 else cv2.COLOR_GRAY2RGB).astype(np.float32)
    shown *= min(_DIMMED, _DIMMED_DN / max(float(np.percentile(shown[::4, ::4], 99.0)), 1.0) if shown.size else 1.0)
    verdict = _wrapped(sighting.problem or "Enough markers for the camera's pose.", _LINE_CHARACTERS)
    tall, foot = _WIDTH_IN * height / width, 0.46 + 0.145 * len(verdict)
    figure = new_figure(_WIDTH_IN, tall + foot)
    figure.set_layout_engine("none")
    figure.set_facecolor(_PAPER)
    axes = figure.add_axes((0.0, foot / (tall + foot), 1.0, tall / (tall + foot)))
    axes.imshow(np.clip(shown, 0.0, 255.0).astype(np.uint8), interpolation="nearest", aspect="equal")
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    axes.axis("off")
    _draw_rings(axes, sighting, 0.011 * width)
    figure.text(
        0.012, (foot - 0.18) / (tall + foot), _summary(sighting), color=INK, fontsize=10.5, weight="bold", va="center"
    )
    colour = BAD if sighting.problem else WARN if sighting.missing or sighting.ambiguous else GOOD
    place = (0.012, (foot - 0.34) / (tall + foot))
    figure.text(*place, "\n".join(verdict), color=colour, fontsize=8.0, va="top", linespacing=1.2)
    return png(figure, dpi=_DPI)


def _draw_rings(axes: Axes, sighting: Sighting, least: float) -> None:
    """Draw what was found, missed and left, the most important first: a label that has no room is left out."""
    labels: list[tuple[float, float, float, float]] = []
    rings = [(marker.centre_px, marker.radius_px) for marker in sighting.markers]
    rings += [(blob.centre_px, blob.radius_px) for blob in sighting.blobs if blob.name and blob.why]
    for (x, y), radius in rings:
        reach = radius + 0.5 * least
        labels.append((x - reach, y - reach, x + reach, y + reach))
    for marker in sighting.markers:
        note = "placed" if marker.placed else f"±{marker.sigma_px:.2f} px"
        ring = _LINES.get(marker.colour, "white")
        _ring(axes, marker.centre_px, max(marker.radius_px, 0.4 * least) + 0.4 * least, ring, width=1.9)
        x, y = marker.centre_px
        tick = 0.25 * least
        axes.plot([x - tick, x + tick], [y, y], color="white", linewidth=0.7)
        axes.plot([x, x], [y - tick, y + tick], color="white", linewidth=0.7)
        _label(axes, labels, marker.centre_px, marker.radius_px + least, f"{marker.name}\n{note}", ring, least=least)
    for blob in sighting.blobs:
        if blob.name and blob.why:  # expected, or likely but not sure
            ring, dashes = (
                _LINES.get(blob.colour, "white"),
                (0, (3, 2)) if blob.name in sighting.missing else (0, (1, 1)),
            )
            _ring(axes, blob.centre_px, max(blob.radius_px, 0.4 * least) + 0.5 * least, ring, width=1.7, dashes=dashes)
            text = f"{blob.name}\n{blob.why}"
            _label(axes, labels, blob.centre_px, blob.radius_px + least, text, ring, least=least)
    left = sorted((blob for blob in sighting.blobs if blob.why and not blob.name), key=lambda each: -each.radius_px)
    for blob in left[:_SHOWN_REJECTED]:
        _ring(axes, blob.centre_px, max(blob.radius_px, 0.4 * least), _GREY, width=0.7)
        _label(axes, labels, blob.centre_px, max(blob.radius_px, 0.4 * least), blob.why, _GREY, least=least, small=True)


def _summary(sighting: Sighting) -> str:
    """Return the line that counts."""
    parts = [f"{sighting.camera} camera: {len(sighting.markers)} found"]
    if sighting.missing:
        parts.append("missing " + ", ".join(sighting.missing))
    if sighting.ambiguous:
        parts.append("ambiguous " + ", ".join(sighting.ambiguous))
    return "  ·  ".join(parts)


def _ring(
    axes: Axes,
    centre: FloatArray,
    radius: float,
    colour: str,
    *,
    width: float,
    dashes: tuple[int, tuple[int, int]] | None = None,
) -> None:
    """Draw a ring, a broad one with a dark edge."""
    style, place = "solid" if dashes is None else dashes, (float(centre[0]), float(centre[1]))
    if width > 1.0 and dashes is None:
        axes.add_patch(Circle(place, radius, fill=False, edgecolor="black", linewidth=width + 1.4, linestyle=style))
    axes.add_patch(Circle(place, radius, fill=False, edgecolor=colour, linewidth=width, linestyle=style))


def _label(
    axes: Axes,
    labels: list[tuple[float, float, float, float]],
    centre: FloatArray,
    radius: float,
    text: str,
    colour: str,
    *,
    least: float,
    small: bool = False,
) -> None:
    """Write beside a ring, where there is room: to its right, left, below or above; a small label may be left out."""
    lines = text.split("\n")
    high = least * (0.9 if small else 1.35) * len(lines)
    wide = least * (0.43 if small else 0.68) * max(len(line) for line in lines)
    x, y = centre
    gap = radius + 0.25 * least
    places = [
        (x + gap, y - high / 2),
        (x - gap - wide, y - high / 2),
        (x - wide / 2, y + gap),
        (x - wide / 2, y - gap - high),
    ]
    right, bottom = axes.get_xlim()[1], axes.get_ylim()[0]
    for left, top in places:
        box = (left, top, left + wide, top + high)
        hidden = any(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in labels)
        if not hidden and left >= 0 and top >= 0 and box[2] <= right and box[3] <= bottom:
            break
    else:
        if small:
            return
        left, top = places[0]
        box = (left, top, left + wide, top + high)
    labels.append(box)
    size = 5.5 if small else 8.5
    drawn = axes.text(left, top + high / 2, text, color=colour, fontsize=size, va="center", clip_on=True)
    drawn.set_path_effects([patheffects.withStroke(linewidth=2.2, foreground="black")])


def _wrapped(text: str, most: int) -> list[str]:
    """Return the text in lines of at most `most` characters."""
    lines, line = [], ""
    for word in text.split():
        if line and len(line) + 1 + len(word) > most:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return [*lines, line]
