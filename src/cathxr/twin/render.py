"""One camera's pictures of the simulated box: a pure function of the world and the instant."""

import zlib

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from cathxr.core import ConfigError, FloatArray, PixelArray
from cathxr.geometry import CameraModel
from cathxr.twin.clutter import Clutter, draw_clutter
from cathxr.twin.coverage import add_coverage
from cathxr.twin.kinematics import sphere_path
from cathxr.twin.lens import lens_numbers, ray_table
from cathxr.twin.sensor import LEVEL_STEPS, deviation_table, expose, expose_changed, level_table, noise_bank
from cathxr.twin.silhouette import FAR, distance_field, nodes_at, project_nodes, surface_field, window_of
from cathxr.twin.static_picture import glare_picture, static_picture
from cathxr.twin.static_scene import INLET_SIZE_MM, static_scene
from cathxr.twin.world import TwinWorld

_SEGMENT_MM = 0.35
_CURVE_EVERY_S = 0.003
_MOST_PIECES = 24
_STILL_PX = 0.01
_FIELD_PX = 1.0
"""The outline moves at most this far between two distance fields of one exposure; between them, evenly."""
_BANK_SIZE = 1 << 22
"""Samples of noise; small pictures make do with five times as many as they have values."""
_FULL_SCALE = 255.0


class CameraRenderer:
    """Makes the pictures of one camera of a `TwinWorld`. Keeps scratch memory: one thread at a time."""

    def __init__(self, world: TwinWorld, camera: str) -> None:
        if camera not in world.rig_true.cameras:
            known = ", ".join(world.rig_true.cameras)
            raise ConfigError(f"The rig {world.rig_true.name!r} has no camera {camera!r}; it has {known}.")
        self.world, self.camera = world, camera
        self.settings = world.settings
        self.model = CameraModel.of(world.rig_true.cameras[camera])
        self._seed = [world.seed, zlib.crc32(camera.encode())]
        seed = int(np.random.default_rng(self._seed).integers(1 << 31))
        width, height = self.model.size_px
        self._rays = ray_table(self.model)
        self._lens = lens_numbers(self.model)
        static = static_picture(
            self.model,
            self._rays,
            static_scene(world.rig_true, self.settings, seed=world.seed),
            self.settings,
            seed=seed,
        )
        self._depth = static.depth_mm
        spots = self.settings.glare_spots > 0
        self._veil = glare_picture(width, height, self.settings, seed=seed) if spots else np.zeros((0, 0), np.float32)
        self._noise_of = np.array([self.settings.read_noise_dn, self.settings.electrons_per_dn / self.settings.gain])
        whole = static.level + np.float32(self.settings.black_level_dn)
        whole = whole + self._veil[..., None] if spots else whole
        self._table = level_table(whole)
        deviation = deviation_table(whole, read_noise_dn=self._noise_of[0], electrons_per_dn=self._noise_of[1])
        self._deviation = deviation
        self._bank = noise_bank(np.random.default_rng([seed, 0x2015E]), size=min(_BANK_SIZE, 5 * whole.size))
        self._clutter = Clutter.made(
            world.rig_true.roi, debris=self.settings.debris, bubbles=self.settings.bubbles, seed=world.seed
        )
        self._fields = (np.full((height, width, 3), FAR), np.full((height, width, 3), FAR))
        self._coverage = np.zeros((height, width), np.float32)
        self._passed = np.ones((height, width), np.float32)
        self._added = np.zeros((height, width, 3), np.float32)
        self._colours = np.array(self.settings.colours, dtype=np.float64) * self.settings.cast
        tone = 255.0 * (np.arange(256) / 255.0) ** (1.0 / self.settings.gamma)
        self._tone = np.rint(tone).astype(np.uint8)

    def picture(self, t_ns: int) -> PixelArray:
        """Return the picture (H, W, 3) BGR uint8 whose exposure is centred on `t_ns`."""
        fault = self.settings.fault
        if fault in ("black", "white"):
            return np.full((*self._depth.shape, 3), 255 if fault == "white" else 0, dtype=np.uint8)
        t_ns = self.world.start_ns if fault == "frozen" else t_ns
        gain = self._gain(t_ns)
        key = np.uint64(np.random.SeedSequence([*self._seed, t_ns % (1 << 63)]).generate_state(1, np.uint64)[0])
        height, width = self._depth.shape
        out = np.empty((height, width, 3), dtype=np.uint8)
        flat = (height, 3 * width)
        table, deviation = self._table.reshape(flat), self._deviation.reshape(flat)
        expose(table, deviation, np.tile(gain, width), self._bank, key, out.reshape(flat))
        window = self._draw_moving(t_ns)
        if window[2] > window[0]:
            black, layers = self.settings.black_level_dn, (self._passed, self._added)
            expose_changed(self._table, self._veil, black, *layers, window, gain, self._noise_of, self._bank, key, out)
        return self._encoded(out)

    def empty_picture(self) -> PixelArray:
        """Return the box without catheter, clutter and noise, (H, W, 3) BGR uint8: the mean of many empty pictures."""
        level = np.clip(np.rint(self._table / LEVEL_STEPS), 0, 255).astype(np.uint8)
        return np.asarray(self._tone[level])

    def _draw_moving(self, t_ns: int) -> NDArray[np.int64]:
        """Mark in the scratch layers what moves, and return the window (4,) that holds it."""
        height, width = self._depth.shape
        window = np.array([width, height, 0, 0])
        if self.settings.catheter:
            self._draw_tube(t_ns, window)
        if len(self._clutter.radius_mm):
            balls = self._clutter.seen(self.model, (t_ns - self.world.start_ns) * 1e-9)
            shine = _FULL_SCALE * self.settings.front_light * np.array(self.settings.cast)
            draw_clutter(balls, shine, self._passed, self._added, window)
        return window

    def _draw_tube(self, t_ns: int, window: NDArray[np.int64]) -> None:
        """Mark the catheter: its silhouette over the exposure, blurred by the lens, and its own light."""
        readout_s, exposure_s = self.settings.readout_ms * 1e-3, self.settings.exposure_ms * 1e-3
        curves, along = self._curves(t_ns, readout_s + exposure_s)
        # Row r is open from index per_row * r, for `open_for`: both in steps of the curves' spacing in time.
        steps = (len(curves) - 1) / max(readout_s + exposure_s, 1e-12)
        per_row, open_for = steps * readout_s / (len(self._depth) - 1), steps * exposure_s
        self._cover(curves, per_row, open_for, window)
        if window[2] <= window[0] or window[3] <= window[1]:
            return
        inside = np.s_[window[1] : window[3], window[0] : window[2]]
        radius, nodes, outline = self.world.body.radius_mm, np.empty(curves.shape[1:]), np.empty(curves.shape[1:])
        nodes_at(curves, 0.5 * (len(curves) - 1), nodes)
        project_nodes(nodes[None], 0.0, 0.0, radius, self._lens, outline)
        surface = self._fields[0]
        surface[inside] = FAR
        surface_field(nodes, along, radius, outline, self._rays, self._depth, surface)
        covered = self._coverage[inside]
        if self.settings.lens_blur_px > 0:
            blurred = cv2.GaussianBlur(covered, (0, 0), self.settings.lens_blur_px, borderType=cv2.BORDER_REPLICATE)
            covered = np.asarray(blurred, dtype=np.float32)
        look = np.array([self.settings.transmission, _FULL_SCALE * self.settings.front_light, self.settings.specular])
        layers = self._passed[inside], self._added[inside]
        cast = np.array(self.settings.cast)
        _shade(covered, surface[inside], self._colours, self.settings.band_mm, look, cast, *layers)

    def _cover(self, curves: FloatArray, per_row: float, open_for: float, window: NDArray[np.int64]) -> None:
        """Fill the scratch layer of coverage with the tube's silhouette, averaged over the exposure; widen `window`."""
        height, width = self._depth.shape
        radius, outline = self.world.body.radius_mm, np.empty(curves.shape[1:])
        for index in (0.0, open_for):
            project_nodes(curves, index, per_row, radius, self._lens, outline)
            window_of(outline, width, height, window)
        if window[2] <= window[0] or window[3] <= window[1]:
            return
        inside = np.s_[window[1] : window[3], window[0] : window[2]]
        self._coverage[inside] = 0.0
        moved = self._moved_px(curves) * open_for / max(len(curves) - 1, 1)
        pieces = 0 if moved < _STILL_PX else int(np.clip(np.ceil(moved / _FIELD_PX), 1, _MOST_PIECES))
        before, after = self._fields
        for i, index in enumerate(np.linspace(0.0, open_for, pieces + 1) if pieces else (0.5 * open_for,)):
            after[inside] = FAR
            project_nodes(curves, index, per_row, radius, self._lens, outline)
            distance_field(curves, index, per_row, radius, outline, self._rays, self._depth, after)
            if i or not pieces:
                add_coverage(before if pieces else after, after, 1.0 / max(pieces, 1), window, self._coverage)
            before, after = after, before

    def _curves(self, t_ns: int, span_s: float) -> tuple[FloatArray, FloatArray]:
        """Return curves (K, n, 3) mm in the camera's frame, spread evenly over the open time, and along (n,)."""
        count = 1 if span_s <= 0 else 2 + int(span_s / _CURVE_EVERY_S)
        times = (
            t_ns + np.rint(np.linspace(-0.5, 0.5, count) * span_s * 1e9).astype(np.int64)
            if count > 1
            else np.array([t_ns])
        )
        body, middle = self.world.body, self.world.controls(t_ns)
        steps = max(2, int(np.ceil((middle.insertion_mm - body.radius_mm) / _SEGMENT_MM)))
        behind = 2.0 if self.settings.inlet else INLET_SIZE_MM[0]
        paths = [sphere_path(body, self.world.controls(int(t)), steps=steps, behind_mm=behind) for t in times]
        bare = middle.insertion_mm - body.radius_mm
        along = body.radius_mm + np.concatenate([[bare + behind], np.linspace(bare, 0.0, steps + 1)])
        return self.model.to_camera(np.stack(paths)), along

    def _moved_px(self, curves: FloatArray) -> float:
        """Return how far the outline moves from the first curve to the last, px, at most."""
        if len(curves) < 2:
            return 0.0
        shift = np.linalg.norm(curves[-1] - curves[0], axis=1) / curves[0, :, 2]
        return float(shift.max() * self.model.intrinsics.focal_px.max())

    def _gain(self, t_ns: int) -> NDArray[np.float32]:
        """Return the gain (3,) of blue, green, red at an instant: flicker, drift of exposure and of white balance."""
        t_s = (t_ns - self.world.start_ns) * 1e-9
        settings = self.settings
        common = 1.0 + settings.flicker * np.sin(2.0 * np.pi * settings.flicker_hz * t_s)
        common *= 1.0 + settings.exposure_drift * np.sin(2.0 * np.pi * t_s / 7.3)
        warm = settings.white_balance_drift * np.sin(2.0 * np.pi * t_s / 11.7)
        return np.asarray(common * np.array([1.0 - warm, 1.0, 1.0 + warm]), dtype=np.float32)

    def _encoded(self, out: PixelArray) -> PixelArray:
        """Return the picture after the camera's tone curve and compression."""
        if self.settings.gamma != 1.0:
            out = np.asarray(cv2.LUT(out, self._tone), dtype=np.uint8)
        if self.settings.jpeg_quality is not None:
            _, packed = cv2.imencode(".jpg", out, [cv2.IMWRITE_JPEG_QUALITY, self.settings.jpeg_quality])
            out = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), dtype=np.uint8)
        return out


@njit(cache=True, nogil=True)
def _shade(covered, surface, colours, band_mm, look, cast, passed, added):  # type: ignore[no-untyped-def]
    """Let the tube cover what is behind it and add its own light: matt, lit from the camera's side, with a shine."""
    transmission, front, specular = look
    for row in range(covered.shape[0]):
        for column in range(covered.shape[1]):
            cover = covered[row, column]
            if cover < 5e-4:
                continue
            share = min(surface[row, column, 1], 1.0)
            facing = np.sqrt(1.0 - share * share)
            band = 0
            if colours.shape[0] > 1 and surface[row, column, 0] < 1e8:
                band = int(max(surface[row, column, 2], 0.0) / band_mm) % colours.shape[0]
            matt = front * (0.3 + 0.7 * facing)
            shine = 255.0 * specular * facing**24
            passed[row, column] *= 1.0 - cover * (1.0 - transmission)
            for c in range(3):
                added[row, column, c] = cover * (matt * colours[band, c] + shine * cast[c]) + 1e-6
