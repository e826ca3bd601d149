"""The optical tracker: two cameras, an encoder, two detectors and a tracker, composed into one Source of Tracks.

One thread for each device. The thread that calls `read` pairs, detects and tracks; the second view is detected beside
the first by a helper thread, which pays because OpenCV and Numba let go of the interpreter's lock.
"""

import logging
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from dataclasses import replace
from functools import partial
from threading import Event
from types import TracebackType
from typing import Self

from cathxr.core import (
    Clock,
    Detection,
    Detector,
    DeviceError,
    EndOfStream,
    Health,
    Image,
    Observation,
    Reading,
    Rig,
    RollStatus,
    Source,
    Status,
    Track,
    Tracker,
)
from cathxr.runtime.fanout import Fanout, sentence
from cathxr.runtime.moment import Moment
from cathxr.runtime.pairing import Pair, Pairer
from cathxr.runtime.queues import Deadline, Queue
from cathxr.runtime.roll import LiveRoll, RollAt
from cathxr.runtime.supervisor import DeviceThread, Meter, RetryPolicy
from cathxr.tracking import read_and_track

_log = logging.getLogger(__name__)

CAMERAS = ("top", "front")
_PICTURES_BOUND = 16
_JOIN_S = 1.5
_SLICE_S = 0.1


class OpticalSource:
    """A Source of Tracks, one for each pair of pictures; when tracking is the slower, older pairs are skipped.

    cameras, detectors: "top" and "front". `readings` gives every encoder reading (in the encoder's thread), `resets`
     the seq of each Observation before which detectors and tracker were reset (in the thread that reads).
    A camera that fails is retried for ever; meanwhile the Tracks are lost, with a reason that names it. So is the Track
    of a pair on which a detector or the tracker raises; both begin anew with the next pair.
    """

    def __init__(
        self,
        rig: Rig,
        cameras: Mapping[str, Source[Image]],
        *,
        detectors: Mapping[str, Detector],
        tracker: Tracker,
        clock: Clock,
        encoder: Source[Reading] | None = None,
        policy: RetryPolicy | None = None,
    ) -> None:
        for name, given in (("cameras", cameras), ("detectors", detectors)):
            if set(given) != set(CAMERAS):
                raise ValueError(f"{name}: expected top and front, got {sorted(given)}")
        self.readings: Fanout[Reading] = Fanout()
        self.resets: Fanout[int] = Fanout()
        self._rig, self._cameras, self._encoder = rig, dict(cameras), encoder
        self._detectors, self._tracker = dict(detectors), tracker
        self._clock, self._policy = clock, policy
        self._reset_wanted = Event()
        self._begin()

    def _begin(self) -> None:
        """Put everything that belongs to one opening into its first state."""
        periods = [round(1e9 / self._rig.cameras[name].rate_hz) for name in CAMERAS]
        self._pairer: Pairer[Image] = Pairer(periods[0], periods[1])
        self._pictures: Queue[tuple[int, Image, int]] = Queue(_PICTURES_BOUND)
        self._roll = LiveRoll(self._rig.roll, self._encoder)
        self._threads: dict[str, DeviceThread[Image] | DeviceThread[Reading]] = {}
        self._helper: ThreadPoolExecutor | None = None
        self._meter = Meter()
        self._predicted: Track | None = None
        self._seq = 0
        self._skipped = 0
        self._skew_ns: int | None = None
        self._error: str | None = None

    def __enter__(self) -> Self:
        if self._helper is not None:
            raise DeviceError("The optical tracker is open already: close it first.")
        self._begin()
        self.request_reset()
        self._helper = ThreadPoolExecutor(1, thread_name_prefix="second-view")
        clock, policy = self._clock, self._policy
        for index, name in enumerate(CAMERAS):
            deliver = partial(self._take_picture, self._pictures, index)
            self._threads[name] = DeviceThread(name, self._cameras[name], deliver, clock=clock, policy=policy)
        if self._encoder is not None:
            self._threads["encoder"] = DeviceThread(
                "encoder", self._encoder, self._take_reading, clock=clock, policy=policy, lost=self._roll.forget
            )
        for thread in self._threads.values():
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._helper is None:
            return
        deadline = Deadline(_JOIN_S)
        for thread in self._threads.values():
            thread.ask_to_stop()
        self._pictures.close()
        for thread in self._threads.values():
            thread.join(deadline.left_s)
        self._helper.shutdown(wait=False, cancel_futures=True)
        self._helper = None

    def read(self, timeout_s: float) -> Track | None:
        """Return the next Track, None when none came in time.

        Raises:
            DeviceError: it is not open; EndOfStream: both cameras have given all they have.
        """
        moment = self.read_moment(timeout_s)
        return None if moment is None else moment.track

    def read_moment(self, timeout_s: float) -> Moment | None:
        """Return the next Track with its Observation and pictures, None when none came in time. Raises as `read`."""
        if self._helper is None:
            raise DeviceError("The optical tracker is read before it is opened: use it in a with statement.")
        deadline = Deadline(timeout_s)
        wait_s = 0.0
        while True:
            pairs = self._collect(wait_s)
            if not pairs and all(self._threads[name].ended for name in CAMERAS) and not len(self._pictures):
                pairs = self._pairer.flush()
                if not pairs:
                    raise EndOfStream
            if pairs:
                self._skipped += len(pairs) - 1
                return self._process(pairs[-1])
            if deadline.left_s == 0.0:
                return None
            wait_s = min(deadline.left_s, self._until_poll_s())

    def request_reset(self) -> None:
        """Have detectors and tracker reset before the next Observation. From any thread."""
        self._reset_wanted.set()

    def health(self, now_ns: int) -> tuple[Health, ...]:
        """Return the Health of each device and of the tracker; its losses are unpaired pictures and skipped pairs."""
        devices = [thread.health(now_ns) for thread in self._threads.values()]
        losses = sum(self._pairer.unpaired) + self._skipped + self._pictures.losses
        tracker = self._meter.health(
            now_ns, "tracker", running=self._helper is not None, losses=losses, error=self._error
        )
        return (*devices, tracker, *self.readings.health(now_ns))

    def roll_status(self, now_ns: int) -> RollStatus:
        """Return whether the roll is valid, and what to do where it is not. From any thread."""
        thread = self._threads.get("encoder")
        if thread is None:
            return self._roll.status(now_ns, running=False, error=None)
        health = thread.health(now_ns)
        return self._roll.status(now_ns, running=health.running, error=health.last_error)

    def confirm_roll(self) -> None:
        """Take a person's word that roll is right. From any thread.

        Raises:
            CathxrError: there is nothing to confirm it to, or it is not enough; the sentence says what is.
        """
        self._roll.confirm()

    def zero_roll(self) -> None:
        """Have the present position be roll zero: the handle is in the jig. From any thread. Raises as confirm_roll."""
        self._roll.zero()

    @property
    def skew_ns(self) -> int | None:
        """The front picture's instant minus the top's, latest complete pair."""
        return self._skew_ns

    def _take_picture(self, pictures: Queue[tuple[int, Image, int]], camera: int, image: Image) -> None:
        """Queue a picture; runs in the camera's thread."""
        pictures.put((camera, image, self._clock.now_ns()))

    def _take_reading(self, reading: Reading) -> None:
        """Keep a reading and pass it on; runs in the encoder's thread."""
        self._roll.add(reading)
        self.readings.write(reading)

    def _collect(self, wait_s: float) -> list[Pair[Image]]:
        """Return the pairs that are ready, after waiting up to `wait_s` for a picture."""
        pairs: list[Pair[Image]] = []
        arrived = self._pictures.get(wait_s)
        while arrived is not None:
            pairs += self._pairer.offer(*arrived)
            arrived = self._pictures.get(0.0)
        return pairs or self._pairer.poll(self._clock.now_ns())

    def _until_poll_s(self) -> float:
        """Return how long to wait before looking again without a picture: never so short that it would spin."""
        at_ns = self._pairer.next_poll_ns()
        until_s = _SLICE_S if at_ns is None else (at_ns - self._clock.now_ns()) / 1e9
        return min(_SLICE_S, max(0.001, until_s))

    def _process(self, pair: Pair[Image]) -> Moment:
        """Return the Moment of one pair: detect, look up the roll, track."""
        seq, self._seq = self._seq, self._seq + 1
        given = zip(CAMERAS, (pair.first, pair.second), strict=True)
        images = {name: image for name, image in given if image is not None}
        self._skew_ns = pair.skew_ns if pair.skew_ns is not None else self._skew_ns
        roll = self._roll.at(pair.t_ns)
        observation = None
        try:
            self._apply_reset(seq)
            look = partial(self._seen, seq, pair, images, roll)
            observation, track = read_and_track(look, self._tracker, self._predicted)
            self._error = None
        except Exception as error:  # stored, shown, and begun anew: one bad picture must not end the tracking
            observation, track = None, self._failed(seq, pair.t_ns, error)
        self._predicted = None if track.status is Status.LOST else track
        now_ns = self._clock.now_ns()
        self._meter.count(seq, now_ns)
        if images:
            track = replace(track, latency_ns=max(0, now_ns - pair.t_ns))
        return Moment(track, observation, images)

    def _failed(self, seq: int, t_ns: int, error: Exception) -> Track:
        """Return the lost Track of a pair on which a detector or the tracker raised."""
        text = sentence(error)
        if text != self._error:
            _log.error("tracking failed on pair %d", seq, exc_info=error)
        self._error = text
        self.request_reset()
        return Track(seq, t_ns, Status.LOST, reason=f"internal error: {text}")

    def _seen(
        self, seq: int, pair: Pair[Image], images: Mapping[str, Image], roll: RollAt, predicted: Track | None
    ) -> Observation:
        """Return what a pair shows, read near what `predicted` predicts, or whole without it."""
        return Observation(
            seq,
            pair.t_ns,
            self._detect(images, pair.t_ns, predicted),
            pair.skew_ns or 0,
            roll_rad=roll.roll_rad,
            roll_predicted=roll.predicted,
        )

    def _detect(self, images: Mapping[str, Image], t_ns: int, predicted: Track | None) -> tuple[Detection, ...]:
        """Return one Detection for each camera, top first; the second view runs beside the first."""
        if len(images) == len(CAMERAS) and self._helper is not None:
            second = self._helper.submit(self._detectors["front"].detect, images["front"], predicted)
            try:
                first = self._detectors["top"].detect(images["top"], predicted)
            finally:
                wait_for([second])  # a detector is never left running behind a failure of the other
            return first, second.result()
        return tuple(
            self._detectors[name].detect(images[name], predicted)
            if name in images
            else Detection(name, -1, t_ns, reason=f"no picture from {name}")
            for name in CAMERAS
        )

    def _apply_reset(self, seq: int) -> None:
        """Carry out a reset that was asked for since the last pair."""
        if not self._reset_wanted.is_set():
            return
        self._reset_wanted.clear()
        for detector in self._detectors.values():
            detector.reset()
        self._tracker.reset()
        self._predicted = None
        self.resets.write(seq)
