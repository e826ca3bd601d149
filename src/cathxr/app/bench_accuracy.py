"""Where the tip's error comes from, on the twin: each part measured by leaving the others out. For `bench accuracy`."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from cathxr.app.bench_scenes import CAMERAS, Sequence, from_fiducials
from cathxr.app.bench_sequence import Method
from cathxr.core import FloatArray, Rig, Status, Track
from cathxr.geometry import CameraModel, triangulate
from cathxr.storage.rig_file import example_rig
from cathxr.twin import true_rig

CLEAN: Mapping[str, Any] = MappingProxyType({"read_noise_dn": 0.0, "electrons_per_dn": 1e9})
"""A sensor without noise; it still rounds to 8 bits."""
FROZEN: Mapping[str, Any] = MappingProxyType({"exposure_ms": 0.0})
"""Nothing moves while the shutter is open."""
_SPEED_NS = 2_000_000


@dataclass
class Errors:
    """What was measured of every tracked pair. box_mm, speed_mm_s: the true tip's place and speed; pairs: of all."""

    tip_mm: list[float] = field(default_factory=list)
    shape_mm: list[float] = field(default_factory=list)
    sigma_mm: list[float] = field(default_factory=list)
    speed_mm_s: list[float] = field(default_factory=list)
    box_mm: list[FloatArray] = field(default_factory=list)
    pairs: int = 0

    def add(self, track: Track, truth: Track, speed_mm_s: float) -> None:
        """Count one pair."""
        self.pairs += 1
        shape, true = track.shape_box, truth.shape_box
        if track.status is not Status.TRACKED or shape is None or true is None or track.sigma_mm is None:
            return
        self.tip_mm.append(float(np.linalg.norm(shape[0] - true[0])))
        self.shape_mm.append(_beside(shape, true))
        self.sigma_mm.append(track.sigma_mm)
        self.speed_mm_s.append(speed_mm_s)
        self.box_mm.append(true[0])

    @property
    def mean_mm(self) -> float:
        """Mean tip error."""
        return float(np.mean(self.tip_mm)) if self.tip_mm else float("nan")

    @property
    def rms_mm(self) -> float:
        """Root mean square tip error: what adds up in squares."""
        return float(np.sqrt(np.mean(np.square(self.tip_mm)))) if self.tip_mm else float("nan")

    def quantile_mm(self, share: float) -> float:
        """Return the tip error that so great a share of the pairs stays under."""
        return float(np.quantile(self.tip_mm, share)) if self.tip_mm else float("nan")


def measured(
    scene: str,
    *,
    seeds: tuple[int, ...],
    pairs: int,
    rate_hz: float = 30.0,
    changes: Mapping[str, Any] | None = None,
    progress: Callable[[], None] = lambda: None,
) -> tuple[Errors, Errors]:
    """Return the method `model`'s errors with exact camera poses, and with poses from four fiducials each.

    Both see the same pictures. seeds: one sequence each, with its own box, motion and fiducials; pairs: of each.
    """
    exact, posed = Errors(), Errors()
    for seed in seeds:
        sequence = Sequence(scene, seed=seed, changes=changes)
        rig = from_fiducials(sequence.rig, np.random.default_rng([seed, 0xF1D]))
        running = ((exact, Method("model", sequence)), (posed, Method("model", sequence, rig=rig)))
        for pair in sequence.pairs(pairs, rate_hz):
            before = sequence.world.truth(pair.t_ns - _SPEED_NS, points=2).shape_box
            after = sequence.world.truth(pair.t_ns + _SPEED_NS, points=2).shape_box
            assert before is not None
            assert after is not None
            speed = float(np.linalg.norm(after[0] - before[0])) / (2e-9 * _SPEED_NS)
            for errors, method in running:
                errors.add(method.track(pair)[1], pair.truth, speed)
            progress()
    return exact, posed


def calibration_alone(points_box: FloatArray, *, draws: int, seed: int) -> FloatArray:
    """Return the RMS error (N,) mm of points (N, 3) mm that both cameras see exactly, over draws of the poses alone.

    The poses are those that four fiducials with 0.1 px of noise give each camera; nothing else is wrong.
    """
    rig = true_rig(example_rig(), seed)
    seen = np.stack([camera.project(points_box) for camera in _cameras(rig)])
    rng = np.random.default_rng(seed)
    squares = np.zeros(len(points_box))
    for _ in range(draws):
        found = triangulate(_cameras(from_fiducials(rig, rng)), seen)
        squares += np.square(found.points_box - points_box).sum(axis=1)
    return np.asarray(np.sqrt(squares / draws))


def _cameras(rig: Rig) -> list[CameraModel]:
    return [CameraModel.of(rig.cameras[name]) for name in CAMERAS]


def _beside(shape: FloatArray, truth: FloatArray) -> float:
    """Return the mean distance of points (N, 3) mm from the polyline through (M, 3) mm."""
    start, along = truth[:-1], np.diff(truth, axis=0)
    away = shape[:, None] - start
    share = np.clip((away * along).sum(axis=2) / np.maximum((along * along).sum(axis=1), 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(away - share[..., None] * along, axis=2).min(axis=1).mean())
