"""Training beside the live system: the trial at hand, its recording, its numbers, and what clients are told."""

import threading
from collections.abc import Sequence
from typing import Self

from cathxr.core import CathxrError, Clock, ConfigError, Event, Track
from cathxr.core.trials import TrialStart
from cathxr.runtime.moment import Moment
from cathxr.runtime.queues import Deadline, Queue
from cathxr.runtime.training_after import After, Finished
from cathxr.runtime.training_books import Books
from cathxr.runtime.training_cuts import Cuts
from cathxr.runtime.training_desk import Desk
from cathxr.runtime.training_nouns import Chosen, Known, Outlet, Station, TrainingParts
from cathxr.runtime.training_recordings import part_folder, write_label
from cathxr.runtime.training_running import RunningTrials
from cathxr.runtime.training_surveys import survey_due
from cathxr.runtime.training_trial import TrialAtHand

_STEP_S = 0.03
_PERIOD_NS = 100_000_000
_TRACKS_HELD = 4096
_CLOSE_S = 1.5
_STORE_S = 0.5
_LOOK_NS = 2_000_000_000


class TrainingSession:
    """Runs trials. A context manager: entering starts its threads, leaving ends them; a trial that is on is cut off.

    `take` is a taker of Moments and `hear` one of Events; neither blocks. What operators may ask for is in
    `training_commands`, which uses the rest. Whoever reads or changes `hand` and `desk` holds `lock`, and never waits
    for the store meanwhile, whose thread takes it too.
    """

    def __init__(self, parts: TrainingParts, *, clock: Clock, outlet: Outlet, station: Station) -> None:
        self.parts, self.clock, self.station = parts, clock, station
        self.lock = threading.RLock()
        self.desk = Desk(parts, outlet)
        self.hand: TrialAtHand | None = None
        self.books = Books(parts, clock=clock, told=self._stored, changed=self._known_changed)
        self.after = After(parts, self.books, told=self._numbers)
        self.running = RunningTrials(parts.recordings, utc=parts.utc)
        self.cuts = Cuts(parts, self.books, self.after, self.running, changed=self.publish_offer)
        self._tracks: Queue[Track] = Queue(_TRACKS_HELD)
        self._start: TrialStart | None = None
        self._is_news = True
        self._due_ns = 0
        self._look_ns = 0
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="training", daemon=True)

    def __enter__(self) -> Self:
        self.publish_offer()
        self.books.start()
        self.after.worker.start()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> bool:
        """End the threads in about two seconds; return whether all did end.

        What is not computed or stored by then is so at the next start, from the recording.
        """
        self._stopping.set()
        if self._thread.ident is None:
            return True
        deadline = Deadline(_CLOSE_S)
        self._thread.join(deadline.left_s)
        computed = self.after.worker.close(max(0.0, deadline.left_s - _STORE_S))
        stored = self.books.close(max(_STORE_S, deadline.left_s))
        self.running.close()
        return computed and stored and not self._thread.is_alive()

    # From the live system's threads ----------------------------------------------------------------------------------

    def take(self, moment: Moment) -> None:
        """Take a Moment; it is looked at in the thread of training."""
        hand = self.hand
        if hand is not None and hand.is_on:
            self._tracks.put(moment.track)

    def hear(self, event: Event) -> None:
        """Hear of a recording that broke."""
        if event.kind != "recording_failed":
            return
        with self.lock:
            if self.hand is not None and self.hand.is_on:
                why = str(event.payload.get("sentence", "")).rstrip(".")
                self.hand.sentence = f"The recording of this trial broke ({why}): abort it, or go on without."
                self.news()

    def run(self, trial: str) -> bytes | None:
        """Return a trial's run as JSON; see `After.run`. It may read a recording."""
        return self.after.run(trial)

    # For the commands ------------------------------------------------------------------------------------------------

    def news(self) -> None:
        """Have every client told how training stands, soon."""
        self._is_news = True

    def check_free(self) -> None:
        """Return when no trial is on. Raises ConfigError where one is."""
        if self.hand is not None and self.hand.is_on:
            raise ConfigError(
                f"A trial of {self.hand.chosen.participant} is on: let it end, or abort it, before anything else."
            )

    def take_up(self, chosen: Chosen | None) -> None:
        """Have a trial at hand, or none. Under the lock."""
        self.check_free()
        self.desk.clear()
        self.hand = None if chosen is None else TrialAtHand(chosen)
        self.desk.lock(self.hand)
        self.news()

    def count_down(self) -> None:
        """Have the recording of the trial at hand begin, and count down. Under the lock.

        Raises:
            CathxrError: it cannot be recorded, is not ready, or runs elsewhere.
        """
        hand = self._at_hand()
        state = self.station.recording_state()
        if hand.phase == "ready":
            if self.parts.no_recording:
                raise ConfigError(f"A trial is recorded, and this system records nothing. {self.parts.no_recording}")
            if state.recording:
                raise ConfigError(f"The recording {state.name} runs: stop it first, since a trial makes its own.")
            self.running.take(hand.chosen.id)
            try:
                self.station.start_recording(part_folder(hand.session, hand.chosen.part))
            except CathxrError:
                self.running.let_go(hand.chosen.id)
                raise
        hand.count_down(self.clock.now_ns())
        self.news()

    def say(self, events: Sequence[Event]) -> None:
        """Announce what happened, and see to what follows. Under the lock."""
        for each in events:
            self.station.announce(each)
        if events:
            self.news()
        if self.hand is not None and self.hand.phase == "ended" and self._start is not None:
            self._end(self.hand, self._start)

    def stop_recording(self) -> None:
        """End the trial's recording; one that broke has ended already."""
        try:
            self.station.stop_recording()
        except CathxrError as error:
            if self.hand is not None and not self.hand.sentence:
                self.hand.sentence = f"The recording of this trial had ended before it ({str(error).rstrip('.')})."

    def publish_offer(self) -> None:
        """Tell every client what can be trained."""
        known, unfinished = self.books.known, self.cuts.messages()
        with self.lock:
            mine = None if self.hand is None else self.hand.chosen.id
            self.desk.offer(known, [each for each in unfinished if each.id != mine])

    # In the thread of training ---------------------------------------------------------------------------------------

    def step(self, timeout_s: float) -> None:
        """Look at the Tracks that came, at the time, and tell clients where it is due."""
        tracks = []
        track = self._tracks.get(timeout_s)
        while track is not None:
            tracks.append(track)
            track = self._tracks.get(0.0)
        with self.lock:
            hand, now_ns = self.hand, self.clock.now_ns()
            if hand is not None and hand.is_on:
                if hand.due(now_ns):
                    self._begin(hand, now_ns)
                for each in tracks:
                    self.say(hand.take(each))
                self.say(hand.look(now_ns))
            if (self._is_news or (self.hand is not None and self.hand.is_on)) and now_ns >= self._due_ns:
                self._is_news, self._due_ns = False, now_ns + _PERIOD_NS
                fault = self.books.fault and f"The store fails: {self.books.fault}"
                self.desk.publish(self.hand, now_ns, waiting=self.books.waiting > 0, fault=fault)

        if now_ns >= self._look_ns:
            self._look_ns = now_ns + _LOOK_NS
            self.cuts.look_for_ends(self._on)

    def _run(self) -> None:
        while not self._stopping.is_set():
            self.step(_STEP_S)

    def _begin(self, hand: TrialAtHand, now_ns: int) -> None:
        chosen, parts = hand.chosen, self.parts
        start = chosen.start or TrialStart(
            chosen.id, chosen.participant, chosen.placed.key, chosen.condition, chosen.number, chosen.period,
            parts.utc(), chosen.practice, hand.session, parts.box, parts.software, chosen.placed.sha256,
        )  # fmt: skip
        self._start = start
        self.cuts.forget(start.id)
        self.books.begin(start)
        if chosen.start is None:
            folder = self.after.folder(hand.session)
            self.after.worker.do(lambda: write_label(folder, start, study=parts.key))
        self.say(hand.begin(now_ns))

    def _end(self, hand: TrialAtHand, start: TrialStart) -> None:
        self._start = None
        self.stop_recording()
        self.desk.lock(hand)
        self.after.finish(hand, start, invalid=self.desk.invalid, written=self.station.wait_written)

    def _at_hand(self) -> TrialAtHand:
        if self.hand is None:
            raise ConfigError("No trial is prepared: prepare one first.")
        return self.hand

    # From the threads of the numbers and of the store -----------------------------------------------------------------

    def _numbers(self, finished: Finished) -> None:
        known = self.books.known
        with self.lock:
            if self.hand is not None and self.hand.chosen.id == finished.record.id:
                self.desk.take_numbers(finished, known)
                self._ask_survey(known)
                self.news()
        if self.desk.invalid and self.desk.invalid != finished.record.invalid and self.desk.finished is finished:
            self.books.mark(finished.record.id, self.desk.invalid)  # marked while they were computed

    def _stored(self, trial: str, sentence: str, stored: bool) -> None:
        if stored:
            self.running.let_go(trial)
        with self.lock:
            if self.hand is not None and self.hand.chosen.id == trial:
                self.desk.stored = sentence
                self.news()

    def _known_changed(self) -> None:
        known = self.books.known
        with self.lock:
            self._ask_survey(known)
            self.news()
        self.publish_offer()
        self.cuts.look(self._on)

    def _ask_survey(self, known: Known) -> None:
        """Ask what is due after the trial at hand, once it is recorded."""
        study, hand = self.parts.study, self.hand
        if study is not None and hand is not None and hand.phase == "ended" and self.desk.finished is not None:
            self.desk.survey = survey_due(study, known, hand.chosen.participant)

    def _on(self) -> str | None:
        """Return the id of the trial that is on or has just ended."""
        with self.lock:
            return None if self.hand is None or self.hand.phase == "ready" else self.hand.chosen.id
