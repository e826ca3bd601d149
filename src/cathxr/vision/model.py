"""The `model` method's eye: one picture in, the catheter's measured midline out."""

from dataclasses import dataclass

import cv2
import numpy as np

from cathxr.core import Detection, FloatArray, Image, PixelArray, Rig, Track
from cathxr.core.arrays import NONE, NONE_PAIRS
from cathxr.geometry import CameraModel, arc_length
from cathxr.vision.midline import Midline, measured
from cathxr.vision.near import NearDetector
from cathxr.vision.near_matte import NearMatte
from cathxr.vision.profiles import SAMPLE_PX, line_levels, line_samples
from cathxr.vision.repeats import RepeatCounter
from cathxr.vision.rim import Rim, rim_of
from cathxr.vision.segment_choice import SegmenterChoice
from cathxr.vision.segmentation import Coarse, MatteArray, Window, blank_reason
from cathxr.vision.trace import trace

_SEARCH_MM = 45.0
"""How far along the inlet's axis the catheter's beginning is looked for (the inlet block may hide the first part)."""
_SIDE_MM = 9.0
"""How far from the axis: a bent catheter leaves it, and the cameras may sit off their calibration a little."""
_LEAST_LENGTH_WIDTHS = 1.3
_CLEARLY = 0.3
"""A catheter whose width is off by less than this, as a logarithm, is no rim of a shining one."""
_MATTE_PX, _MATTE_END_PX = 0.05, 0.2
"""Where no back-light draws it, a matte's edge is off by about this: by colours, by shade, and alike side by side."""
_NO_RIM = ("more than one", "the catheter leaves")
"""Where a view cannot be used for these reasons, its silhouette cannot either."""
_CORE_WIDTHS = 0.75
"""A shining catheter's bright core is slimmer than this."""


@dataclass(frozen=True, eq=False)
class _Axis:
    """The inlet's axis in the picture: points (N, 2) px from the inlet on, unit directions (N, 2), px per mm (N,)."""

    points: FloatArray
    directions: FloatArray
    scale: FloatArray


class ModelDetector:
    """Finds the catheter from its inlet on, follows it to its tip, and measures its midline to sub-pixel accuracy."""

    def __init__(self, rig: Rig, camera: str, *, background: PixelArray | None = None) -> None:
        rig_camera = rig.cameras[camera]
        self._camera = camera
        self._model = CameraModel.of(rig_camera)
        self._axis = _axis(self._model, rig)
        self._width_px = rig.catheter.diameter_mm * float(self._axis.scale[len(self._axis.scale) // 2])
        self._hull = _roi_hull(self._model, rig)
        self._repeats = RepeatCounter()
        self._near = NearDetector(rig, self._model)
        self._near_matte = NearMatte(self._model.size_px, self._width_px)
        self._segmenters = SegmenterChoice(self._width_px, background)
        self._hollow = False
        self._rim: Rim | None = None

    def reset(self) -> None:
        """Forget the pictures before."""
        self._hollow = False
        self._repeats.reset()
        self._near.reset()

    def detect(self, image: Image, predicted_box: Track | None = None) -> Detection:
        """Return the midline seen in `image`, or why there is none.

        With `predicted_box`, the last Track, only pixels near the curve it predicts are read, as long as they agree.
        """
        repeats = self._repeats.count(image)
        near = None if predicted_box is None else self._found_near(image, predicted_box)
        predicted = near is not None and near[1]
        self._rim = None
        if near is not None and near[1]:
            found: Midline | str = near[0]
        else:
            found = self._found(image.pixels)
            if not isinstance(found, str):
                self._near.learn(found)
            elif near is not None:
                found = near[0]
        rim, rim_sigma = (NONE_PAIRS, NONE) if self._rim is None else (self._rim.points, self._rim.sigma)
        if isinstance(found, str):
            return Detection(
                self._camera, image.seq, image.t_ns, reason=found, repeats=repeats, rim_px=rim, rim_sigma_px=rim_sigma
            )
        if self._segmenters.refreshed is not None:
            found = found.roughened(_MATTE_PX, _MATTE_END_PX)
        return Detection(
            self._camera,
            image.seq,
            image.t_ns,
            curve_px=found.curve_px,
            normal_px=found.normal_px,
            sigma_px=found.sigma_px,
            half_width_px=found.half_width_px,
            tip_px=found.tip_px,
            tip_sigma_px=found.tip_sigma_px,
            end_px=found.end_px,
            end_sigma_px=found.end_sigma_px,
            rim_px=rim,
            rim_sigma_px=rim_sigma,
            repeats=repeats,
            predicted=predicted,
        )

    def _found_near(self, image: Image, predicted: Track) -> tuple[Midline, bool] | None:
        """Return what is measured near the predicted curve and whether it is beyond doubt, None where there is none."""
        if image.size_px != self._model.size_px:
            return None
        light, other = self._segmenters.light, self._segmenters.refreshed
        if light is not None:
            return self._near.found((image.pixels, light[0], float(light[1]), 1.0), image.t_ns, predicted)
        path = None if other is None else self._near.path(image.t_ns, predicted)
        if path is None or other is None:
            return None
        return self._near.found(self._near_matte.source(image.pixels, other, path), image.t_ns, predicted)

    def _found(self, pixels: PixelArray) -> Midline | str:
        size = (pixels.shape[1], pixels.shape[0])
        if size != self._model.size_px:
            return (
                f"picture of {size[0]}x{size[1]} pixels, the rig says {self._model.size_px[0]}x{self._model.size_px[1]}"
            )
        blank = blank_reason(pixels)
        if blank is not None:
            return blank
        segmenter = self._segmenters.for_picture(pixels)
        coarse = segmenter.coarse(pixels)
        mask = self._in_roi(coarse)
        window = self._window(mask, coarse.step)
        if window is None:
            return "no catheter"
        matte = segmenter.matte(pixels, window)
        found = self._followed(matte, mask, coarse.step, window)
        if isinstance(found, str) and found.startswith(_NO_RIM):
            return found
        plateau = _plateau(matte, mask, coarse.step, window) if isinstance(found, str) else found.plateau
        own = _filled(matte, self._width_px) if self._hollow else matte
        self._rim = rim_of(own, mask, coarse.step, window, plateau, self._axis.points, self._width_px)
        return found

    def _followed(self, matte: MatteArray, mask: PixelArray, step: int, window: Window) -> Midline | str:
        """Return the midline of the catheter in a matte, or why there is none.

        A shining catheter has a bright core between two dark rims. Where what is seen is too slim, narrow gaps are
        closed, and what comes nearer to the catheter's width is taken; the pictures after are likely to be like it.
        """
        tries = (True, False) if self._hollow else (False, True)
        best: tuple[float, bool, Midline | str] = (np.inf, self._hollow, "no catheter")
        for filled in tries:
            own = _filled(matte, self._width_px) if filled else matte
            found = self._line(own, mask, step, window)
            off = np.inf
            if not isinstance(found, str):
                off = abs(np.log(2.0 * float(np.median(found.half_width_px)) / self._width_px))
            if off < best[0] or filled is tries[0]:
                best = (off, filled, found)
            if off < _CLEARLY:
                break
        if best[0] < np.inf:
            self._hollow = best[1]
        return best[2]

    def _line(self, matte: MatteArray, mask: PixelArray, step: int, window: Window) -> Midline | str:
        """Return the midline of the longest tube from the inlet in a matte, or why there is none."""
        plateau = _plateau(matte, mask, step, window)
        corner = np.array([window.x0, window.y0], dtype=np.float64)
        path, width, plateau = self._longest(matte, corner, plateau)
        if len(path) < 3:
            return "no catheter"
        line = measured(matte, path, width, plateau)
        if line is None or arc_length(line.curve_px)[-1] < _LEAST_LENGTH_WIDTHS * width:
            return "no catheter"
        line = _shifted(line, corner)
        return self._objection(line, mask, step, width) or line

    def _in_roi(self, coarse: Coarse) -> PixelArray:
        """Return the coarse mask without what lies outside the region of interest."""
        inside = np.zeros_like(coarse.mask)
        hull = (self._hull - (coarse.step - 1) / 2) / coarse.step
        cv2.fillConvexPoly(inside, np.round(hull).astype(np.int32), 255)
        return np.asarray(cv2.bitwise_and(coarse.mask, inside), dtype=np.uint8)

    def _window(self, mask: PixelArray, step: int) -> Window | None:
        """Return the block of the picture that holds all candidates, with room around."""
        x, y, w, h = cv2.boundingRect(mask)
        if w == 0 or h == 0:
            return None
        room = round(3.0 * self._width_px)
        width, height = self._model.size_px
        window = Window(
            max(0, x * step - room),
            max(0, y * step - room),
            min(width, (x + w) * step + room),
            min(height, (y + h) * step + room),
        )
        return window if window.x1 - window.x0 > 4 and window.y1 - window.y0 > 4 else None

    def _longest(self, matte: MatteArray, corner: FloatArray, plateau: float) -> tuple[FloatArray, float, float]:
        """Return (path, width, plateau) of the longest tube that begins at the inlet; entry first, matte pixels."""
        best: tuple[FloatArray, float, float] = (np.empty((0, 2)), self._width_px, plateau)
        best_length = 0.0
        limit = 3.0 * float(np.hypot(*self._model.size_px))
        tried: list[FloatArray] = []
        for point, direction, scale in zip(self._axis.points, self._axis.directions, self._axis.scale, strict=True):
            for seed in _seeds(matte, point - corner, direction, scale, self._width_px, plateau):
                if any(_near(path, seed, self._width_px) for path in tried):
                    continue
                forward, width, own = trace(matte, seed, direction, self._width_px, plateau, limit)
                forward = _before_jump(matte, forward, direction, width, 0.5 * own)
                if len(forward) < 3:
                    continue
                tried.append(forward)
                length = float(arc_length(forward)[-1])
                if length > best_length:
                    back, _, _ = trace(matte, forward[1], forward[0] - forward[1], width, own, _SEARCH_MM * scale)
                    best = (np.vstack([back[:0:-1], forward[1:]]) if len(back) > 1 else forward, width, own)
                    best_length = length
            if best_length > 8.0 * self._width_px:
                break
        return best

    def _objection(self, line: Midline, mask: PixelArray, step: int, width: float) -> str | None:
        """Return why a midline cannot be the one catheter, None when it can."""
        ratio = 2.0 * float(np.median(line.half_width_px)) / self._width_px
        if not 0.5 < ratio < 1.9:
            return f"what is seen is {ratio:.1f} times as wide as the catheter"
        if not bool(self._model.inside(line.tip_px, margin_px=0.7 * width)):
            return "the catheter leaves the picture"
        rest = mask.copy()
        trail = np.round((line.curve_px - (step - 1) / 2) / step * 16).astype(np.int32)
        cv2.polylines(rest, [trail], False, 0, thickness=max(3, round(2.4 * width / step)), shift=4)
        seen = int(np.count_nonzero(mask)) - int(np.count_nonzero(rest))
        suspicious = max(0.4 * seen, 8.0 * (width / step) ** 2)
        if int(np.count_nonzero(rest)) <= suspicious:
            return None
        # what hangs together with the midline is one silhouette: its rim says whether one catheter explains it
        _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        own = np.unique(labels[(mask > 0) & (rest == 0)])
        areas = stats[:, cv2.CC_STAT_AREA].copy()
        areas[own] = areas[0] = 0
        return "more than one thing looks like a catheter" if int(areas.max()) > suspicious else None


def _axis(model: CameraModel, rig: Rig) -> _Axis:
    """Return the inlet's axis in a camera's picture, one point a millimetre."""
    along = np.arange(0.0, min(_SEARCH_MM, float(rig.roi.max_mm[0])) + 1.0)
    line = np.stack([along, np.zeros_like(along), np.zeros_like(along)], axis=1)
    points, jacobian = model.project_with_jacobian(line)
    slope = jacobian[:, :, 0]
    # the scale across the axis: px per mm on a sphere about the point, whatever the axis' slant
    scale = np.linalg.norm(jacobian, axis=(1, 2)) / np.sqrt(2.0)
    return _Axis(points, slope / np.linalg.norm(slope, axis=1, keepdims=True), scale)


def _roi_hull(model: CameraModel, rig: Rig) -> FloatArray:
    """Return the outline (N, 2) px of the region of interest, a little widened."""
    corners = model.project(rig.roi.corners_mm)
    middle = corners.mean(axis=0)
    widened = (middle + 1.04 * (corners - middle)).astype(np.float32)
    return np.asarray(cv2.convexHull(widened)[:, 0, :], dtype=np.float64)


def _plateau(matte: MatteArray, mask: PixelArray, step: int, window: Window) -> float:
    """Return the matte's usual level on the candidates."""
    rows = np.arange(window.y0, window.y1, 2)
    columns = np.arange(window.x0, window.x1, 2)
    inside = mask[np.minimum(rows // step, mask.shape[0] - 1)][:, np.minimum(columns // step, mask.shape[1] - 1)] > 0
    values = np.sort(matte[::2, ::2][inside])
    return float(np.clip(values[(3 * values.size) // 5], 0.05, 1.0)) if values.size else 0.5


def _filled(matte: MatteArray, width: float) -> MatteArray:
    """Return the matte with gaps closed that are slimmer than a catheter's bright core may be."""
    size = 2 * max(1, round(0.5 * _CORE_WIDTHS * width)) + 1
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.morphologyEx(matte, cv2.MORPH_CLOSE, around), dtype=np.float32)


def _seeds(
    matte: MatteArray, point: FloatArray, direction: FloatArray, scale: float, width: float, plateau: float
) -> list[FloatArray]:
    """Return the middles of tube-wide sections of a line across the axis at `point`, nearest to the axis first."""
    normal = np.array([-direction[1], direction[0]])
    reach = _SIDE_MM * scale
    offsets = np.arange(-reach, reach + SAMPLE_PX, SAMPLE_PX)
    above = line_samples(matte, point - reach * normal, SAMPLE_PX * normal, len(offsets)) > 0.5 * plateau
    edges = np.flatnonzero(np.diff(above.astype(np.int8)))
    starts, ends = edges[~above[edges]], edges[above[edges]]
    seeds = []
    for start in starts:
        later = ends[ends > start]
        if later.size and 0.5 * width < (later[0] - start) * SAMPLE_PX < 1.8 * width:
            seeds.append(0.5 * (offsets[start + 1] + offsets[later[0]]))
    return [point + each * normal for each in sorted(seeds, key=abs)]


def _before_jump(matte: MatteArray, path: FloatArray, direction: FloatArray, width: float, level: float) -> FloatArray:
    """Return a path (N, 2) without what lies beyond a gap and at its own beginning: a tip that points at the inlet.

    A trace crosses gaps, for there may be glare; but what is dark behind such a tip is the inlet.
    """
    if len(path) < 3:
        return path
    along = (path - path[0]) @ direction
    open_ = line_levels(matte, path) < level
    gaps = np.flatnonzero(open_)
    if not len(gaps):
        return path
    after = along[gaps[-1] + 1 :]
    if not len(after) or float(after.min()) > width:
        return path
    first = gaps[-1]
    while first > 0 and open_[first - 1]:
        first -= 1
    return path[:first]


def _near(path: FloatArray, point: FloatArray, distance: float) -> bool:
    return bool((np.linalg.norm(path - point, axis=1) < distance).any())


def _shifted(line: Midline, corner: FloatArray) -> Midline:
    """Return the midline in the picture's pixels."""
    return Midline(
        line.curve_px + corner,
        line.normal_px,
        line.sigma_px,
        line.half_width_px,
        line.tip_px + corner,
        line.tip_sigma_px,
        line.end_px + corner,
        line.end_sigma_px,
        line.plateau,
    )
