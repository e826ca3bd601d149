"""The rendered boxes' cameras: what they see of the scene, and from the light that arrives to the picture."""

from dataclasses import dataclass, field

import cv2
import numpy as np

from cathxr.core import FloatArray, PixelArray

from .worlds import Optics

FINER = 2
"""Rendered pixels to a picture's pixel, each way."""
_DISTANCE_MM = 330.0
_MIDDLE = np.array([60.0, 0.0, 0.0])
_MARGIN = 0.12
"""What is rendered beyond the picture on each side, of its width: distortion bends it in."""
_LOOKS = {  # rotation of camera_from_box: down and along +y
    "top": np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
    "front": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}


@dataclass
class RenderedCamera:
    """A camera: rotation (3, 3) and translation (3,) mm of camera_from_box, lens, and how light becomes a picture."""

    name: str
    rotation: FloatArray
    translation: FloatArray
    focal_px: FloatArray
    centre_px: FloatArray
    optics: Optics
    _map: tuple[FloatArray, FloatArray] = field(init=False)

    def __post_init__(self) -> None:
        self._map = self._made_map()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of what is rendered: a pinhole's picture, FINER times as fine, with a margin."""
        width, height = self.optics.size_px
        margin = 2 * round(_MARGIN * width)
        return FINER * (width + margin), FINER * (height + margin)

    @property
    def focal(self) -> float:
        """Focal length of what is rendered, px."""
        return FINER * float(self.focal_px[0])

    @property
    def place(self) -> FloatArray:
        """Where it is, (3,) mm in `box`."""
        return -self.rotation.T @ self.translation

    def window(self, points: FloatArray, margin_mm: float) -> tuple[int, int, int, int]:
        """Return x0, y0, x1, y1 of what is rendered around points (N, 3), mm in `box`; at least one pixel."""
        seen = points @ self.rotation.T + self.translation
        middle = 0.5 * np.array(self.size)
        places = self.focal * seen[:, :2] / seen[:, 2:] + middle
        margin = margin_mm * self.focal / float(seen[:, 2].min())
        low = np.clip(np.floor(places.min(axis=0) - margin), 0, np.array(self.size) - 1).astype(int)
        high = np.clip(np.ceil(places.max(axis=0) + margin), low + 1, self.size).astype(int)
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def picture(self, light: FloatArray, rng: np.random.Generator) -> PixelArray:
        """Return BGR uint8 (H, W, 3) of float light (h, w, 3) in BGR, 1 where the sensor is full."""
        optics = self.optics
        blurred = cv2.GaussianBlur(light.astype(np.float32), (0, 0), FINER * optics.blur_px)
        level = np.clip(cv2.remap(blurred, *self._map, cv2.INTER_CUBIC), 0.0, None).astype(float)
        height, width = level.shape[:2]
        y, x = np.mgrid[:height, :width]
        off_axis = ((x - 0.5 * width) ** 2 + (y - 0.5 * height) ** 2) / (0.25 * (width**2 + height**2))
        level *= (1.0 - 0.25 * off_axis)[..., None]
        level += optics.noise * rng.normal(size=level.shape) * np.sqrt(8e-5 * level + 4e-6)
        grey = 255.0 * np.clip(level, 0.0, 1.0) ** (1.0 / optics.gamma)
        if optics.sharpen:
            grey += optics.sharpen * (grey - cv2.GaussianBlur(grey, (0, 0), 1.2))
        picture = np.clip(np.round(grey), 0, 255).astype(np.uint8)
        if optics.jpeg is None:
            return picture
        _, packed = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, optics.jpeg])
        return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), dtype=np.uint8)

    def _made_map(self) -> tuple[FloatArray, FloatArray]:
        """Return where each of the picture's pixels is in what is rendered, x and y float32 (H, W)."""
        width, height = self.optics.size_px
        y, x = np.mgrid[:height, :width]
        seen = (np.stack([x, y], axis=-1).reshape(-1, 2) - self.centre_px) / self.focal_px
        ideal = undistorted(seen, self.optics.distortion)
        places = self.focal * ideal + 0.5 * np.array(self.size) - 0.5
        outside = (places.min() < 0) or bool((places.max(axis=0) > np.array(self.size) - 1).any())
        if outside:
            raise ValueError("the margin is too small for this lens")
        found = places.reshape(height, width, 2).astype(np.float32)
        return np.ascontiguousarray(found[..., 0]), np.ascontiguousarray(found[..., 1])


def undistorted(seen: FloatArray, distortion: tuple[float, ...]) -> FloatArray:
    """Return the pinhole's points (N, 2) of points seen through OpenCV's lens k1 k2 p1 p2 k3, by repetition.

    Its own, not the project's camera model: a mistake there must show.
    """
    k1, k2, p1, p2, k3 = distortion
    x, y = seen.T
    for _ in range(60):
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bent_x = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        bent_y = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        x, y = (seen[:, 0] - bent_x) / radial, (seen[:, 1] - bent_y) / radial
    return np.column_stack([x, y])


def make_cameras(optics: Optics, rng: np.random.Generator) -> list[RenderedCamera]:
    """Return the top and the front camera, off their nominal places as `optics.off` says."""
    width, height = optics.size_px
    cameras = []
    for name, nominal in _LOOKS.items():
        turned = cv2.Rodrigues(rng.normal(0.0, optics.off, 3))[0] @ nominal
        middle = np.array([0.0, 0.0, _DISTANCE_MM]) + rng.normal(0.0, 100.0 * optics.off, 3)
        focal = optics.focal * width * (1.0 + rng.normal(0.0, optics.off))
        centre = 0.5 * np.array([width - 1.0, height - 1.0]) + rng.normal(0.0, 100.0 * optics.off, 2)
        slant = np.array([1.0, 1.0 + rng.normal(0.0, 0.05 * optics.off)])
        cameras.append(RenderedCamera(name, turned, middle - turned @ _MIDDLE, focal * slant, centre, optics))
    return cameras
