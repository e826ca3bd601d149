"""Accuracy on the twin's scenes, where the truth is known: what `cathxr bench tracking` measures."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree

from cathxr.core import FloatArray, Image, Observation, Status, Track
from cathxr.geometry import resampled
from cathxr.storage.rig_file import example_rig
from cathxr.tracking import make_tracker
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig
from cathxr.vision import make_detector

_APART_NS = 333_333_333
"""Pairs are this far apart: pictures a frame apart would show nearly the same shape again and again."""
_DENSE = 400


@dataclass
class Score:
    """Errors of every tracked pair, and how many there were. seconds: processor time of each pair."""

    tip_mm: list[float] = field(default_factory=list)
    shape_mm: list[float] = field(default_factory=list)
    shape_max_mm: list[float] = field(default_factory=list)
    tangent_deg: list[float] = field(default_factory=list)
    normalised: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    statuses: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)

    def add(self, track: Track, truth: Track, seconds: float) -> None:
        """Count one pair."""
        self.statuses[track.status.value] += 1
        self.seconds.append(seconds)
        if track.status is not Status.TRACKED:
            self.reasons[track.reason] += 1
            return
        if track.shape_box is None or truth.shape_box is None or track.sigma_mm is None:
            # a pose where there is no catheter: the worst there is
            self.tip_mm.append(float("inf"))
            return
        tip = float(np.linalg.norm(track.shape_box[0] - truth.shape_box[0]))
        self.tip_mm.append(tip)
        self.normalised.append(tip / max(track.sigma_mm, 1e-9))
        mean, largest = shape_distance(track.shape_box, truth.shape_box)
        self.shape_mm.append(mean)
        self.shape_max_mm.append(largest)
        if track.direction_box is not None and truth.direction_box is not None:
            cosine = float(np.clip(track.direction_box @ truth.direction_box, -1.0, 1.0))
            self.tangent_deg.append(float(np.degrees(np.arccos(cosine))))


def shape_distance(first: FloatArray, second: FloatArray) -> tuple[float, float]:
    """Return the symmetric mean and the largest distance, mm, between two centrelines (N, 3) and (M, 3)."""
    a, b = resampled(first, _DENSE), resampled(second, _DENSE)
    there = cKDTree(b).query(a)[0]
    back = cKDTree(a).query(b)[0]
    return float(0.5 * (there.mean() + back.mean())), float(max(there.max(), back.max()))


def scene_pairs(name: str, *, pairs: int, seed: int) -> Iterator[tuple[Image, Image, Track, TwinWorld]]:
    """Yield pictures of both cameras and the truth of a twin's scene, a third of a second apart."""
    nominal = example_rig()
    settings = scene(name)
    world = TwinWorld(true_rig(nominal, seed), seed=seed, settings=settings)
    renderers = {each: CameraRenderer(world, each) for each in ("top", "front")}
    skew_ns = round(settings.front_skew_ms * 1e6)
    for seq in range(pairs):
        t_ns = 1_000_000_000 + seq * _APART_NS
        top = Image("top", seq, t_ns, renderers["top"].picture(t_ns))
        front = Image("front", seq, t_ns + skew_ns, renderers["front"].picture(t_ns + skew_ns))
        yield top, front, world.truth(t_ns, seq=seq), world


def scores(
    name: str, methods: tuple[str, ...], *, pairs: int, seed: int, progress: Callable[[], None] = lambda: None
) -> dict[str, Score]:
    """Return each method's score on the same pictures of a scene, with the true rig."""
    rig = true_rig(example_rig(), seed)
    result = {method: Score() for method in methods}
    detectors = {method: {each: make_detector(method, rig, each) for each in ("top", "front")} for method in methods}
    trackers = {method: make_tracker(method, rig) for method in methods}
    for top, front, truth, _ in scene_pairs(name, pairs=pairs, seed=seed):
        for method in methods:
            begun = time.thread_time()
            pair = detectors[method]
            found = (pair["top"].detect(top), pair["front"].detect(front))
            track = trackers[method].update(Observation(truth.seq, top.t_ns, found, front.t_ns - top.t_ns))
            result[method].add(replace(track), truth, time.thread_time() - begun)
        progress()
    return result
