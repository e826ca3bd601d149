"""Pictures of a flat printed board held before one camera, through its lens: what intrinsics are calibrated from."""

import zlib

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.core import FloatArray, PixelArray, Pose, RigCamera
from cathxr.geometry import CameraModel
from cathxr.geometry.pose import perturbed
from cathxr.twin.board_kernels import BESIDE, MIXED, PLAIN, light_up, see_print
from cathxr.twin.lens import ray_table
from cathxr.twin.sensor import expose_level, noise_bank
from cathxr.twin.settings import TwinSettings
from cathxr.twin.static_picture import LAMP, back_light, fall_off, front_lamp

_PAPER, _INK = 0.88, 0.045
_AMBIENT = 0.35
_GRID = 4
"""Along a pixel's side; each sample is itself a mean over about a texel."""
_TEXELS_PER_PIXEL = 5.0
_MOST_SAMPLES = 48
_STILL_PX = 0.05
_BANK_SIZE = 1 << 21
_FULL_SCALE = 255.0
Float32 = NDArray[np.float32]


class BoardRenderer:
    """Makes pictures of one board before one camera. Keeps scratch memory: one thread at a time.

    texture (h, w) uint8: the print, white margin included, 255 bare paper; its first pixel's outer corner lies at
    -offset_mm of the board's frame (x right, y down on the print, z into the paper, as OpenCV's boards).
    """

    def __init__(
        self,
        camera: RigCamera,
        texture: PixelArray,
        *,
        px_per_mm: float,
        offset_mm: tuple[float, float] = (0.0, 0.0),
        settings: TwinSettings,
        seed: int,
    ) -> None:
        if texture.ndim != 2 or texture.dtype != np.uint8 or min(texture.shape) < 2:
            raise ValueError(f"texture: expected a grey uint8 picture, got {texture.dtype} {texture.shape}")
        if not (np.isfinite(px_per_mm) and px_per_mm > 0):
            raise ValueError(f"px_per_mm: expected a positive number, got {px_per_mm}")
        self.camera, self.settings = camera, settings
        self._texture, self._px_per_mm, self._offset_mm = texture, px_per_mm, np.array(offset_mm)
        self._seed = [seed, zlib.crc32(camera.name.encode()), 0xB0A2D]
        rng = np.random.default_rng(self._seed)
        fixed = int(rng.integers(1 << 31))
        width, height = camera.size_px
        self._rays = ray_table(CameraModel(camera.intrinsics, Pose.identity(), camera.size_px))
        cast = np.array(settings.cast)
        self._light = np.asarray(back_light(width, height, settings, seed=fixed) * cast, dtype=np.float32)
        lamp = front_lamp(width, height, settings, seed=fixed) * fall_off(width, height, settings)
        self._lamp = np.asarray(_FULL_SCALE * settings.front_light * lamp, dtype=np.float32)
        self._prints: dict[int, Float32] = {}
        self._states: dict[tuple[int, int, bool], NDArray[np.uint8]] = {}
        self._bank = noise_bank(rng, size=_BANK_SIZE)
        self._noise_of = np.array([settings.read_noise_dn, settings.electrons_per_dn / settings.gain])
        self._seen = np.zeros((height, width, 2), np.float32)
        self._level = np.empty((height, width, 3), np.float32)

    def picture(self, camera_from_board: Pose, *, number: int = 0, twist: FloatArray | None = None) -> PixelArray:
        """Return the picture (H, W, 3) BGR uint8 of the board at a pose; other noise for each `number`.

        twist (6,): how far the board turns (rad) and shifts (mm) in the camera's frame over the exposure, whose middle
        is at the pose. A board seen from behind is plain paper.
        """
        self._see(camera_from_board, np.zeros(6) if twist is None else np.asarray(twist, dtype=np.float64))
        seen = self._seen
        if self.settings.lens_blur_px > 0:
            seen = np.asarray(cv2.GaussianBlur(seen, (0, 0), self.settings.lens_blur_px), dtype=np.float32)
        normal = camera_from_board.rotation[:, 2]
        square = _AMBIENT + (1.0 - _AMBIENT) * abs(float(normal @ LAMP) / float(np.linalg.norm(LAMP)))
        light_up(
            seen, self._light, self._lamp, square * _INK, square * _PAPER, np.array(self.settings.cast), self._level
        )
        key = np.uint64(np.random.SeedSequence([*self._seed, number % (1 << 63)]).generate_state(1, np.uint64)[0])
        height, width = self._lamp.shape
        out = np.empty((height, width, 3), dtype=np.uint8)
        flat = (height, 3 * width)
        black = self.settings.black_level_dn
        expose_level(self._level.reshape(flat), black, self._noise_of, self._bank, key, out.reshape(flat))
        return out

    def _see(self, pose: Pose, twist: FloatArray) -> None:
        """Fill the scratch layer with what the pixels see of the print."""
        self._seen[:] = 0.0
        outline = self._outline(pose)
        if outline is None:
            return
        pixels, texels_per_px = outline
        blur_px = self._blur_px(pose, twist)
        shrunk = max(1, int(texels_per_px / _TEXELS_PER_PIXEL))
        per_mm, texture = self._px_per_mm / shrunk, self._shrunk(shrunk)
        behind = bool(pose.rotation[:, 2] @ pose.translation_mm <= 0.0)
        if behind:
            texture = np.full_like(texture, 255.0)
        samples, shares = _samples(blur_px)
        maps = np.stack([self._texels_from_rays(perturbed(pose, share * twist), per_mm) for share in shares])
        # In coarse steps, so that what is known of the print serves many pictures.
        reach = int(4.0 * 1.5 ** np.ceil(np.log(((1.0 + blur_px) * texels_per_px / shrunk + 2.0) / 4.0) / np.log(1.5)))
        reach = max(reach, 4) + 1
        if (shrunk, reach, behind) not in self._states:
            self._states[shrunk, reach, behind] = _state(texture, reach)
        state = self._states[shrunk, reach, behind]
        width, height = self.camera.size_px
        margin = blur_px + 2.0
        low = np.clip(np.floor(pixels.min(axis=0) - margin), 0, (width, height)).astype(np.int64)
        high = np.clip(np.ceil(pixels.max(axis=0) + margin) + 1, 0, (width, height)).astype(np.int64)
        window = np.array([*low, *high])
        see_print(self._rays, texture, state, reach, samples, maps, window, self._seen)

    def _edge_mm(self) -> FloatArray:
        """Return points (N, 3) around the print's edge, mm in the board's frame."""
        size = np.array(self._texture.shape[::-1]) / self._px_per_mm
        s = np.linspace(0.0, 1.0, 9)[:-1]
        ones, zeros = np.ones(8), np.zeros(8)
        x, y = np.concatenate([s, ones, 1.0 - s, zeros]), np.concatenate([zeros, s, ones, 1.0 - s])
        around = np.column_stack([x * size[0], y * size[1], np.zeros(32)])
        return np.asarray(around - np.append(self._offset_mm, 0.0), dtype=np.float64)

    def _outline(self, pose: Pose) -> tuple[FloatArray, float] | None:
        """Return the edge's pixels (N, 2) and the most texels that a pixel spans; None when it is behind the camera."""
        points = pose.apply(self._edge_mm())
        depth = points[:, 2]
        if depth.max() <= 1.0:
            return None
        width, height = self.camera.size_px
        tilt = max(abs(float(pose.rotation[2, 2])), 0.1)
        texels_per_px = self._px_per_mm * float(depth.max()) / float(self.camera.intrinsics.focal_px.min()) / tilt * 1.2
        model = CameraModel(self.camera.intrinsics, pose, self.camera.size_px)
        directions = np.abs(points[:, :2] / np.maximum(depth, 1e-9)[:, None])
        if depth.min() <= 1.0 or directions.max() > 1.5 * float(np.abs(self._rays).max()):
            # Far out of the picture the lens model folds back: look everywhere.
            return np.array([[0.0, 0.0], [width, height]]), texels_per_px
        return model.project(self._edge_mm()), texels_per_px

    def _blur_px(self, pose: Pose, twist: FloatArray) -> float:
        """Return how far the print moves in the picture over the exposure, px, at most."""
        ends = [perturbed(pose, share * twist).apply(self._edge_mm()) for share in (-0.5, 0.5)]
        if not twist.any() or min(float(each[:, 2].min()) for each in ends) <= 1.0:
            return 0.0
        first, second = (each[:, :2] / each[:, 2:] for each in ends)
        return float(np.linalg.norm(second - first, axis=1).max() * self.camera.intrinsics.focal_px.max())

    def _shrunk(self, factor: int) -> Float32:
        """Return the print at a whole fraction of its fineness, as fine as a view needs it."""
        if factor not in self._prints:
            rows, columns = (-side % factor for side in self._texture.shape)
            whole = cv2.copyMakeBorder(self._texture, 0, rows, 0, columns, cv2.BORDER_REPLICATE).astype(np.float32)
            size = (whole.shape[1] // factor, whole.shape[0] // factor)
            small = cv2.resize(whole, size, interpolation=cv2.INTER_AREA)
            self._prints[factor] = np.asarray(small, dtype=np.float32)
        return self._prints[factor]

    def _texels_from_rays(self, pose: Pose, per_mm: float) -> FloatArray:
        """Return (3, 3): what takes (x/z, y/z, 1) to texel column, row and 1, times 1 over the depth."""
        turn = pose.rotation
        board_from_ray = np.linalg.inv(np.column_stack([turn[:, 0], turn[:, 1], pose.translation_mm]))
        off_x, off_y = self._offset_mm * per_mm
        texels_from_board = np.array([[per_mm, 0.0, off_x], [0.0, per_mm, off_y], [0.0, 0.0, 1.0]])
        return np.asarray(texels_from_board @ board_from_ray, dtype=np.float64)


def board_picture(
    camera: RigCamera,
    texture: PixelArray,
    *,
    px_per_mm: float,
    camera_from_board: Pose,
    settings: TwinSettings,
    seed: int,
    offset_mm: tuple[float, float] = (0.0, 0.0),
    twist: FloatArray | None = None,
) -> PixelArray:
    """Return one picture (H, W, 3) BGR uint8 of a board; for many of one camera, a `BoardRenderer` is quicker.

    Raises:
        ValueError: the texture is no grey uint8 picture, or px_per_mm not positive.
    """
    renderer = BoardRenderer(camera, texture, px_per_mm=px_per_mm, offset_mm=offset_mm, settings=settings, seed=seed)
    return renderer.picture(camera_from_board, twist=twist)


def _samples(blur_px: float) -> tuple[FloatArray, FloatArray]:
    """Return offsets (K, 2) within a pixel and the share (K,) of the exposure from its middle, -0.5 to 0.5, of each."""
    if blur_px < _STILL_PX:
        fine = (np.arange(_GRID) + 0.5) / _GRID - 0.5
        grid = np.stack(np.meshgrid(fine, fine), axis=-1).reshape(-1, 2)
        return grid, np.zeros(len(grid))
    count = int(np.clip(_GRID * _GRID + blur_px, 0, _MOST_SAMPLES))
    # A rank-1 lattice (Roberts' R2) over the pixel, in even steps of time.
    k = np.arange(count)
    offsets = (0.5 + np.outer(k, [0.7548776662466927, 0.5698402909980532])) % 1.0 - 0.5
    return offsets - offsets.mean(axis=0), (k + 0.5) / count - 0.5


def _state(texture: Float32, reach: int) -> NDArray[np.uint8]:
    """Return what the print is like within `reach` texels of each, padded by `reach` all around."""
    side = 2 * reach + 1
    kernel = np.ones((side, side), np.uint8)
    grey = cv2.copyMakeBorder(texture, reach, reach, reach, reach, cv2.BORDER_REPLICATE).astype(np.uint8)
    alike = cv2.dilate(grey, kernel) == cv2.erode(grey, kernel)
    there = np.zeros(grey.shape, np.uint8)
    there[reach:-reach, reach:-reach] = 1
    whole = cv2.erode(there, kernel, borderType=cv2.BORDER_CONSTANT, borderValue=0.0) > 0
    near = cv2.dilate(there, kernel) > 0
    state = np.where(alike & whole, PLAIN, np.where(near, MIXED, BESIDE))
    return np.asarray(state, dtype=np.uint8)
