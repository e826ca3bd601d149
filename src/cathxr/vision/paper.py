"""The paper method's picture half (arXiv 2411.02611): one picture to an ordered pixel path from tip to entry."""

import cv2
import numpy as np

from cathxr.core import Detection, FloatArray, Image, PixelArray, Rig, Track
from cathxr.geometry.curves import arc_length, resampled
from cathxr.vision.paper_silhouette import silhouette
from cathxr.vision.paper_skeleton import skeleton_path
from cathxr.vision.paper_warp import PaperWarp
from cathxr.vision.repeats import RepeatCounter
from cathxr.vision.segmentation import blank_reason

_POINTS = 200
_SIGMA_PX = 0.5
"""A skeleton lives on the pixel grid: each point is right to about half a pixel."""
_SHORTEST_WIDTHS = 0.7
"""Shortest skeleton, in catheter widths: less says nothing about a direction."""
_WIDTHS = (0.55, 1.7)
"""How wide a silhouette may be, in catheter widths: perspective inside the ROI and touching loops included."""
_UNEVEN = 0.8


class PaperDetector:
    """A Detector: undistort, rectify, smooth, threshold, clean, thin, search. Keeps no state but the repeat count.

    Raises (when made):
        ConfigError: the rig's markers cannot carry the paper method.
    """

    def __init__(self, rig: Rig, camera: str) -> None:
        self._camera = camera
        self._warp = PaperWarp.of(rig, camera)
        self._diameter_mm = rig.catheter.diameter_mm
        self._size_px = rig.cameras[camera].size_px
        self._repeats = RepeatCounter()
        inlet_mm = self._warp.plane.apparent(np.zeros((1, 3)))
        self._inlet_row = float(self._warp.to_cutout(inlet_mm)[0, 1])

    def detect(self, image: Image, predicted_box: Track | None = None) -> Detection:
        """Return the catheter's path in `image`. Each picture is looked at afresh: `predicted_box` is not used."""
        repeats = self._repeats.count(image)
        found = self._found(image.pixels)
        if isinstance(found, str):
            return Detection(self._camera, image.seq, image.t_ns, reason=found, repeats=repeats)
        curve_px, half_width_px = found
        return Detection(
            camera=self._camera,
            seq=image.seq,
            t_ns=image.t_ns,
            curve_px=curve_px,
            normal_px=_normals(curve_px, stride=round(float(half_width_px.mean())) + 1),
            sigma_px=np.full(len(curve_px), _SIGMA_PX),
            half_width_px=half_width_px,
            tip_px=curve_px[0],
            # Thinning eats the rounded end by about its radius: the skeleton's end is that far from the tip.
            tip_sigma_px=float(np.hypot(_SIGMA_PX, half_width_px[0])),
            repeats=repeats,
        )

    def reset(self) -> None:
        """Forget the last picture."""
        self._repeats.reset()

    def _found(self, pixels: PixelArray) -> tuple[FloatArray, FloatArray] | str:
        """Return the path (N, 2) raw px, tip first, with half widths (N,) px; or why there is none."""
        if (pixels.shape[1], pixels.shape[0]) != self._size_px:
            return "picture of another size than the rig's"
        grey = pixels if pixels.ndim == 2 else np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        blank = blank_reason(grey)
        if blank is not None:
            return blank
        seen = silhouette(
            self._warp.rectified(grey), self._warp.px_per_mm, diameter_mm=self._diameter_mm, inlet_row=self._inlet_row
        )
        if seen.reason is not None:
            return seen.reason
        top, left, block = _cropped(seen.mask)
        corner = np.array([left, top], dtype=np.float64)
        path = skeleton_path(block) + corner
        if len(path) < max(4.0, _SHORTEST_WIDTHS * self._diameter_mm * self._warp.px_per_mm):
            return "too little of a catheter"
        half_widths = _half_widths(block, path - corner)
        ratio = 2.0 * float(np.median(half_widths)) / (self._diameter_mm * self._warp.px_per_mm)
        if not _WIDTHS[0] < ratio < _WIDTHS[1]:
            return f"what is seen is {ratio:.1f} times as wide as the catheter"
        if float(np.percentile(half_widths, 90) - np.percentile(half_widths, 10)) > _UNEVEN * float(
            np.median(half_widths)
        ):
            return "what is seen is no even tube"
        path = self._to_inlet(path, radius=float(np.median(half_widths)))
        curve = resampled(path, _POINTS)
        half_width = np.interp(np.linspace(0.0, 1.0, _POINTS), np.linspace(0.0, 1.0, len(half_widths)), half_widths)
        try:
            raw = self._warp.plane.to_pixels(self._warp.to_mm(curve))
        except ValueError:
            return "catheter leaves the picture"
        if self._leaves(curve[0], raw[0], margin=float(half_width[0]) + 2.0):
            return "catheter leaves the picture"
        magnification = float(arc_length(raw)[-1] / arc_length(curve)[-1])
        return raw, half_width * magnification

    def _to_inlet(self, path: FloatArray, *, radius: float) -> FloatArray:
        """Return the path (N, 2), cut-out px, without its ragged start but straight on to column 0 (x = 0)."""
        ragged = round(radius)
        if len(path) < 4 * ragged + 8:
            # Too short to show its own direction: it leaves the inlet along +x.
            return np.vstack([path, [0.0, path[len(path) // 2 :, 1].mean()]])
        fitted = path[: len(path) - ragged]
        # The direction is fitted over some radii, so that one pixel's step does not set it.
        near = fitted[-max(4, round(4.0 * radius)) :]
        centre = near.mean(axis=0)
        direction = np.linalg.svd(near - centre)[2][0]
        if abs(direction[0]) < 0.2 or fitted[-1, 0] <= 0.0:
            return fitted
        return np.vstack([fitted, centre - direction * (centre[0] / direction[0])])

    def _leaves(self, tip: FloatArray, tip_px: FloatArray, *, margin: float) -> bool:
        """Return whether a tip (2,), in cut-out px and in raw px, is cut off by an edge other than the inlet's."""
        width, height = self._warp.size_px
        beyond = tip[0] > width - 1 - margin or tip[1] < margin or tip[1] > height - 1 - margin
        return bool(beyond or not self._warp.plane.camera.inside(tip_px, margin_px=margin))


def _cropped(mask: PixelArray) -> tuple[int, int, PixelArray]:
    """Return the first row, first column and contents of the smallest block that holds a mask."""
    left, top, width, height = cv2.boundingRect(mask)
    return top, left, mask[top : top + height, left : left + width]


def _half_widths(block: PixelArray, path: FloatArray) -> FloatArray:
    """Return the distance (N,), px, from each path point (N, 2) to the silhouette's edge."""
    framed = cv2.copyMakeBorder(block, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    distance = cv2.distanceTransform(framed, cv2.DIST_L2, 3)[1:-1, 1:-1]
    columns, rows = path.astype(np.intp).T
    # The edge runs between the last inner and the first outer pixel.
    return np.maximum(np.asarray(distance[rows, columns], dtype=np.float64) - 0.5, 0.5)


def _normals(curve: FloatArray, *, stride: int) -> FloatArray:
    """Return unit normals (N, 2) of a polyline (N, 2), from chords `stride` points to both sides."""
    index = np.arange(len(curve))
    chord = curve[np.minimum(index + stride, len(curve) - 1)] - curve[np.maximum(index - stride, 0)]
    normal = np.column_stack([-chord[:, 1], chord[:, 0]])
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12), dtype=np.float64)
