"""Methods on the twin's sequences, as live: each pair is read near the prediction first. For `bench tracking`."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from cathxr.app.bench_scenes import CAMERAS, ScenePair, Sequence
from cathxr.app.bench_tracking import Score
from cathxr.core import Detection, Detector, FloatArray, Image, Observation, PixelArray, Rig, Status, Track, Tracker
from cathxr.tracking import make_tracker, read_and_track
from cathxr.vision import make_detector

WRONG_MM = 2.0
_UNTIMED = 2
"""The first pairs of a sequence are not timed: they load what the others need."""
_FRESH_EVERY = 4
_AWAY_PAIRS = 15
_PRESENT_PAIRS = 12


@dataclass
class SequenceScore(Score):
    """And the processor time of pairs read near the prediction, and where the tip was seen."""

    predicted_s: list[float] = field(default_factory=list)
    whole_s: list[float] = field(default_factory=list)
    tips_box: list[list[FloatArray]] = field(default_factory=list)

    @property
    def wrong(self) -> int:
        """How many tracked pairs have a tip that is more than 2 mm off."""
        return sum(each > WRONG_MM for each in self.tip_mm)

    @property
    def jitter_mm(self) -> float:
        """RMS distance of the tip from its mean over each sequence, mm: of a catheter at rest."""
        apart = [np.stack(each) - np.mean(each, axis=0) for each in self.tips_box if len(each) > 1]
        if not apart:
            return float("nan")
        return float(np.sqrt(np.square(np.concatenate(apart)).sum(axis=1).mean()))


class Method:
    """One method's detectors and tracker on one sequence. rig: what they take for the box, if not the sequence's."""

    def __init__(self, method: str, sequence: Sequence, *, rig: Rig | None = None) -> None:
        rig = sequence.rig if rig is None else rig
        backgrounds = sequence.empty_pictures()
        self.detectors: dict[str, Detector] = {
            each: make_detector(method, rig, each, background=backgrounds[each]) for each in CAMERAS
        }
        self.tracker: Tracker = make_tracker(method, rig)
        self._last: Track | None = None

    def track(self, pair: ScenePair, *, whole: bool = False) -> tuple[Observation, Track, float]:
        """Return what a pair shows, its Track, and the processor time that took. whole: nothing is predicted."""
        begun = time.thread_time()
        observation, track = read_and_track(
            lambda last: self._seen(pair, last), self.tracker, None if whole else self._last
        )
        spent = time.thread_time() - begun
        self._last = None if track.status is Status.LOST else track
        return observation, track, spent

    def _seen(self, pair: ScenePair, last: Track | None) -> Observation:
        found = tuple(self._detected(name, pair, last) for name in CAMERAS)
        front = pair.pictures["front"]
        return Observation(pair.seq, pair.t_ns, found, 0 if front is None else front.t_ns - pair.t_ns)

    def _detected(self, name: str, pair: ScenePair, last: Track | None) -> Detection:
        image = pair.pictures[name]
        if image is None:
            return Detection(name, -1, pair.t_ns, reason=f"no picture from {name}")
        return self.detectors[name].detect(image, last)


def sequence_scores(
    name: str,
    methods: tuple[str, ...],
    *,
    pairs: int,
    rate_hz: float,
    calibration: str,
    seeds: tuple[int, ...],
    progress: Callable[[], None] = lambda: None,
) -> Mapping[str, SequenceScore]:
    """Return each method's score on the same pictures of a category: one sequence a seed, `pairs` in all.

    A pair of which a picture never arrived is not counted, unless it is called tracked.
    """
    result = {method: SequenceScore() for method in methods}
    for index, seed in enumerate(seeds):
        sequence = Sequence(name, seed=seed, calibration=calibration)
        running = {method: Method(method, sequence) for method in methods}
        for score in result.values():
            score.tips_box.append([])
        share = pairs // len(seeds) + (index < pairs % len(seeds))
        for pair in sequence.pairs(share, rate_hz):
            complete = None not in pair.pictures.values()
            for method, each in running.items():
                observation, track, spent = each.track(pair)
                _add(result[method], pair, observation, track, spent, complete=complete)
            progress()
    return result


def _add(
    score: SequenceScore, pair: ScenePair, observation: Observation, track: Track, spent: float, *, complete: bool
) -> None:
    if not complete and track.status is not Status.TRACKED:
        return
    score.add(replace(track), pair.truth, spent)
    if pair.seq >= _UNTIMED:
        (score.predicted_s if observation.predicted else score.whole_s).append(spent)
    if track.status is Status.TRACKED and track.tip_box is not None:
        score.tips_box[-1].append(track.tip_box)


@dataclass(frozen=True)
class Speed:
    """Median processor times of one pair, s: steady (read near the prediction), whole, and the first of all."""

    steady_s: float
    whole_s: float
    first_s: float


def speed(method: str, *, pairs: int, size_px: tuple[int, int], seed: int = 3, rate_hz: float = 30.0) -> Speed:
    """Return what a pair of the smooth scene costs at a picture size, pictures in memory."""
    sequence = Sequence("smooth", seed=seed, size_px=size_px)
    running, reading = Method(method, sequence), Method(method, sequence)
    steady, whole, first = [], [], []
    for pair in sequence.pairs(pairs, rate_hz):
        spent = (running.track(pair)[2], reading.track(pair, whole=True)[2])
        if pair.seq < _UNTIMED:
            continue
        steady.append(spent[0])
        whole.append(spent[1])
        if pair.seq % _FRESH_EVERY == 0:
            first.append(Method(method, sequence).track(pair)[2])
    return Speed(float(np.median(steady)), float(np.median(whole)), float(np.median(first)))


def reacquisition(*, times: int, seed: int = 3, rate_hz: float = 30.0) -> list[int]:
    """Return how many pairs pass until it is tracked again, each time the catheter comes back: 1 is the first pair.

    The box is empty for half a second in between.
    """
    sequence = Sequence("smooth", seed=seed)
    running = Method("model", sequence)
    empty = {each: renderer.empty_picture() for each, renderer in sequence.renderers.items()}
    noise = np.random.default_rng(seed)
    result: list[int] = []
    waiting = 0
    for pair in sequence.pairs(times * (_AWAY_PAIRS + _PRESENT_PAIRS), rate_hz):
        turn = pair.seq % (_AWAY_PAIRS + _PRESENT_PAIRS)
        if turn < _AWAY_PAIRS:
            shown = {name: Image(name, pair.seq, pair.t_ns, _noisy(pixels, noise)) for name, pixels in empty.items()}
            running.track(replace(pair, pictures=shown))
            waiting = 0
            continue
        track = running.track(pair)[1]
        if waiting >= 0:
            waiting += 1
            if track.status is Status.TRACKED:
                result.append(waiting)
                waiting = -1
        if turn == _AWAY_PAIRS + _PRESENT_PAIRS - 1 and waiting >= 0:
            result.append(_PRESENT_PAIRS + 1)
    return result


def _noisy(pixels: PixelArray, noise: np.random.Generator) -> PixelArray:
    """Return a picture with a sensor's noise of about one grey level."""
    moved = pixels.astype(np.int16) + noise.integers(-1, 2, pixels.shape, dtype=np.int16)
    return np.asarray(np.clip(moved, 0, 255), dtype=np.uint8)
