"""Pictures of slices with the structures' outlines, for the proofs' pages."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.segmentation.images import box_of
from cathxr.heart.volume import LabelVolume, Volume

_DPI, _COLOURS = 80, 200
_HU = (-150.0, 900.0)
_MARGIN_MM = 12.0
_OUTLINES = {
    "left_ventricle": "#ff3b30", "right_ventricle": "#2f7bff", "left_atrium": "#ff9f0a", "right_atrium": "#00d5ff",
    "aorta": "#ff5fd2", "pulmonary_artery": "#a07bff", "superior_vena_cava": "#36e05a",
    "inferior_vena_cava": "#0fa968", "pulmonary_veins": "#ffe14d", "left_atrial_appendage": "#c98a4b",
}  # fmt: skip
"""Stronger than the catalogue's colours, which are made for surfaces that one looks through."""


def slices(
    path: Path,
    volume: Volume,
    labels: LabelVolume,
    *,
    beside: npt.NDArray[np.bool_] | None = None,
    shares: Sequence[float] = (0.3, 0.5, 0.7),
) -> None:
    """Write three slices along each axis through what is labelled. beside: a mask whose outline is drawn in white."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from PIL import Image

    box = _about(labels)
    hu, found = volume.hu[box], labels.labels[box]
    mask = None if beside is None else beside[box]
    spacing = volume.grid.spacing_mm[::-1]
    figure = Figure(figsize=(3.0 * len(shares), 9.6), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    panels = figure.subplots(3, len(shares))
    for axis, row in enumerate(panels):
        rest = [each for each in range(3) if each != axis]
        for panel, share in zip(row, shares, strict=True):
            at = round(share * (hu.shape[axis] - 1))
            # Slices along j and i are shown with the head up.
            turn = slice(None) if axis == 0 else slice(None, None, -1)
            picture, layer = np.take(hu, at, axis)[turn], np.take(found, at, axis)[turn]
            panel.imshow(picture, cmap="gray", vmin=_HU[0], vmax=_HU[1], aspect=spacing[rest[0]] / spacing[rest[1]])
            for each in CATALOGUE.values():
                if (layer == each.label).any():
                    panel.contour(
                        layer == each.label, [0.5], colors=[_OUTLINES.get(each.key, each.colour)], linewidths=1.1
                    )
            if mask is not None and (outline := np.take(mask, at, axis)[turn]).any():
                panel.contour(outline, [0.5], colors=["white"], linewidths=0.6)
            panel.set_axis_off()
    shown = [each for each in CATALOGUE.values() if (found == each.label).any()]
    figure.legend(
        [Line2D([], [], color=_OUTLINES.get(each.key, each.colour), linewidth=2.5) for each in shown],
        [each.name for each in shown],
        loc="lower center",
        ncols=4,
        frameon=False,
        fontsize=8,
    )
    figure.subplots_adjust(0.01, 0.07, 0.99, 0.99, 0.02, 0.02)
    path.parent.mkdir(exist_ok=True)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    # Few colours, or noise makes files of half a megabyte.
    few = (
        Image.open(buffer)
        .convert("RGB")
        .quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    )
    few.save(path, optimize=True)


def _about(labels: LabelVolume) -> tuple[slice, ...]:
    """Return the box about what is labelled, with a margin."""
    near = box_of(labels.labels > 0)
    margins = np.ceil(_MARGIN_MM / labels.grid.spacing_mm[::-1]).astype(int)
    return tuple(
        slice(max(each.start - margin, 0), min(each.stop + margin, size))
        for each, margin, size in zip(near, margins, labels.labels.shape, strict=True)
    )
