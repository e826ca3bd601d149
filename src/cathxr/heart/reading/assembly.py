"""Makes the voxels of a volume of its slices, one plane after another."""

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import FloatArray
from cathxr.heart.reading.pixels import FILL_HU, PixelSource
from cathxr.heart.reading.plan import Plan
from cathxr.heart.reading.stack import Stack
from cathxr.heart.volume import Grid, Progress

Plane = npt.NDArray[np.int16]


def assemble(stack: Stack, plan: Plan, pixels: PixelSource, progress: Progress) -> tuple[npt.NDArray[np.int16], Grid]:
    """Return the volume's voxels, HU, and its grid. Only two slices are held beside it."""
    slides_px = _slides_px(stack)
    layout = stack.frames[0].layout
    low_px = np.zeros(2, int)
    shape = np.array([layout.columns, layout.rows])
    if plan.is_sheared:
        low_px = np.floor(slides_px.min(axis=0)).astype(int)
        shape = shape + np.ceil(slides_px.max(axis=0)).astype(int) - low_px
    hu = np.full((len(plan.below), shape[1], shape[0]), FILL_HU, np.int16)
    held: dict[int, Plane] = {}
    for k, (below, above, weight) in enumerate(zip(plan.below, plan.above, plan.weight, strict=True)):
        progress("Reading slices", k / len(plan.below))
        needed = [int(each) for each, share in ((below, 1.0 - weight), (above, weight)) if share > 0.0]
        held = {
            each: held[each] if each in held else _plane(stack, each, plan, pixels, low_px, hu[k].shape)
            for each in needed
        }
        planes = [held[each] for each in needed]
        if len(planes) == 1:
            hu[k] = planes[0]
        else:
            hu[k] = np.rint(planes[0] * (1.0 - weight) + planes[1] * weight)
    return hu, _grid(stack, plan, low_px, hu.shape)


def _plane(
    stack: Stack, index: int, plan: Plan, pixels: PixelSource, low_px: npt.NDArray[np.int_], shape: tuple[int, ...]
) -> Plane:
    """Return a slice on the volume's columns and rows."""
    plane = pixels.hu(stack.frames[index])
    if not plan.is_sheared:
        return plane
    column_px, row_px = _slides_px(stack)[index] - low_px
    whole = int(np.floor(row_px)), int(np.floor(column_px))
    out = np.full(shape, FILL_HU, np.int16)
    # A whole number of pixels is a copy; only the rest is interpolated, by splines, so that edges stay sharp.
    rest = row_px - whole[0], column_px - whole[1]
    if max(rest) > 1e-3:
        padded = np.pad(plane, ((0, 1), (0, 1)), constant_values=FILL_HU)
        moved = ndimage.shift(padded.astype(np.float32), rest, order=3, mode="nearest", prefilter=True)
        plane = np.clip(np.rint(moved), plane.min(), plane.max()).astype(np.int16)
    rows, columns = (min(size, have - at) for size, have, at in zip(plane.shape, shape, whole, strict=True))
    out[whole[0] : whole[0] + rows, whole[1] : whole[1] + columns] = plane[:rows, :columns]
    return out


def _slides_px(stack: Stack) -> FloatArray:
    """Return the slides (N, 2) in columns and rows, without the last digits' noise, which `floor` would see."""
    return np.asarray(np.round(stack.slide_mm / np.array(stack.spacing_mm), 4))


def _grid(stack: Stack, plan: Plan, low_px: npt.NDArray[np.int_], shape: tuple[int, ...]) -> Grid:
    matrix: FloatArray = np.eye(4)
    matrix[:3, :3] = stack.axes * np.array([*stack.spacing_mm, plan.pitch_mm])
    matrix[:3, 3] = stack.origin + stack.axes[:, :2] @ (low_px * np.array(stack.spacing_mm))
    depth, rows, columns = shape
    return Grid((depth, rows, columns), matrix)
