"""What a person is told of a series before it is read."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import CathxrError, FloatArray
from cathxr.heart.reading.contrast import SAMPLED_SLICES, Contrast, judge_contrast
from cathxr.heart.reading.copies import told_apart
from cathxr.heart.reading.phases import Phase, choose
from cathxr.heart.reading.pixels import PixelSource
from cathxr.heart.reading.plan import plan_of
from cathxr.heart.reading.series import Series, with_phases
from cathxr.heart.reading.stack import Stack, repeated, stack_of, without
from cathxr.heart.volume import Technical

_UPRIGHT = 0.95


@dataclass(frozen=True)
class SeriesSummary:
    """One series. number: what --series takes. problem: why it cannot be read, "" where it can.

    slices: of one phase. size: columns, rows. spacing_mm, extent_mm: along a row, a column, the slices; None where
    unknown. orientation: of the slices. phases: their labels; chosen: what is read without --phase, "" where --phase
    has to be given. contrast: judged from the voxels, None where they were not looked at.
    """

    number: int
    problem: str
    slices: int
    size: tuple[int, int]
    spacing_mm: tuple[float, float, float] | None
    extent_mm: tuple[float, float, float] | None
    orientation: str
    phases: tuple[str, ...]
    chosen: str
    contrast: Contrast | None
    technical: Technical


def summary_of(series: Series, pixels: PixelSource) -> SeriesSummary:
    """Return the summary of a series; a sample of its slices is decoded for the contrast."""
    first = series.frames[0]
    size = first.layout.columns, first.layout.rows
    technical = technical_of(series)
    if series.problem:
        return SeriesSummary(
            series.number, series.problem, len(series.frames), size, None, None, orientation_of(first.axes), (), "",
            None, technical,
        )  # fmt: skip
    try:
        told = with_phases(series, told_apart(series.phases, pixels))
        problem = ""
    except CathxrError as error:
        told, problem = series, str(error)
    phase, chosen = _chosen(told.phases)
    stack = stack_of(phase.frames)
    stack = without(stack, [second for _, second in repeated(stack)])
    remarks: tuple[str, ...] = ()
    pitch, contrast = float(np.median(np.diff(stack.along_mm))), None
    try:
        plan = plan_of(stack)
        pitch, remarks = plan.pitch_mm, plan.remarks
        contrast = None if problem else _contrast(stack, pixels)
    except CathxrError as error:
        problem = problem or str(error)
    spacing = (*stack.spacing_mm, pitch)
    height = float(stack.along_mm[-1] - stack.along_mm[0]) + pitch
    return SeriesSummary(
        number=series.number,
        problem=problem,
        slices=len(stack.frames),
        size=size,
        spacing_mm=spacing,
        extent_mm=(spacing[0] * size[0], spacing[1] * size[1], height),
        orientation=orientation_of(first.axes),
        phases=tuple(each.label for each in told.phases if each.label),
        chosen=chosen,
        contrast=contrast,
        technical=technical_of(series, remarks=remarks, phase=chosen, contrast=contrast),
    )


def technical_of(
    series: Series, *, remarks: tuple[str, ...] = (), phase: str = "", contrast: Contrast | None = None
) -> Technical:
    """Return all that may leave the reader of a series' headers."""
    first = series.frames[0]
    return Technical(
        modality=first.modality,
        phase=phase,
        kernel=first.kernel,
        slice_thickness_mm=first.thickness_mm,
        tube_voltage_kv=first.voltage_kv,
        contrast=None if contrast is None else contrast.is_bright,
        remarks=remarks,
    )


def orientation_of(axes: FloatArray | None) -> str:
    """Return how slices lie in the body: axial, coronal, sagittal, oblique; "unknown" without axes (3, 2)."""
    if axes is None:
        return "unknown"
    normal = np.abs(np.cross(axes[:, 0], axes[:, 1]))
    names = ("sagittal", "coronal", "axial")
    return names[int(np.argmax(normal))] if normal.max() > _UPRIGHT else "oblique"


def _chosen(phases: tuple[Phase, ...]) -> tuple[Phase, str]:
    """Return the phase that is read without --phase and its words, or the first phase and ""."""
    try:
        phase, _ = choose(phases, None)
    except CathxrError:
        return phases[0], ""
    return phase, phase.label


def _contrast(stack: Stack, pixels: PixelSource) -> Contrast | None:
    """Return the contrast of a sample of slices; None where they cannot be decoded."""
    count = len(stack.frames)
    picked = np.unique(np.linspace(0, count - 1, min(count, SAMPLED_SLICES)).round().astype(int))
    height = float(stack.along_mm[-1] - stack.along_mm[0]) / max(len(picked) - 1, 1)
    return judge_contrast([pixels.hu(stack.frames[each]) for each in picked], (*stack.spacing_mm, height))
