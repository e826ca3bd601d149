"""A trial: from Tracks and a person's acts to Events, the same live and on a recording, bit for bit."""

from collections.abc import Sequence

import numpy as np

from cathxr.core import Event, FloatArray, Track
from cathxr.core.track import Status
from cathxr.core.trials import Outcome, TargetResult
from cathxr.training import events as say
from cathxr.training.carried import Carried, carried_mapping
from cathxr.training.closeness import Closeness, closeness
from cathxr.training.placing import PlacedTarget, PlacedTask, placed_mapping
from cathxr.training.state import Offer, Phase, TrialResult, TrialState
from cathxr.training.watch import Watch

_NS = 1_000_000_000


class Trial:
    """A pure state machine. Give it every Track in the order of its instants, and what the person does as it happens.

    Only tracked Tracks count: while the tip coasts or is lost, or no Track comes for 0.25 s, time runs, a dwell begins
    anew, no path is added, and the time goes into unseen_share. A target for the beam or a plane needs the roll too.
    A Track whose instant is not after the last one's, or before the trial's beginning, is left out. Time limits end at
    their own instant, not at the Track that shows that they have passed. `events.py` says which Events come out.
    """

    def __init__(
        self, placed: PlacedTask, order: Sequence[str], *, trial: str = "", carried: Carried | None = None
    ) -> None:
        """Prepare. order: the targets' keys; practice begins again at the first after the last. trial: an id.

        carried: what was done already in a recording that broke off; `begin` then goes on with it.
        """
        if not order:
            raise ValueError("order: expected at least one target")
        self._carried = carried
        self.placed, self.order, self.id = placed, tuple(order), trial
        self._targets = [placed.target(key) for key in self.order]
        self._phase = Phase.WAITING
        self._watch = Watch()
        self._outcome: Outcome | None = None
        self._began_ns = self._now_ns = 0
        self._track_ns: int | None = None
        self._offers: list[Offer] = []
        self._row = 0
        self._offered_ns = self._offered_active_ns = 0
        self._path_mm, self._misses = 0.0, 0
        self._tip: FloatArray | None = None
        self._inside_ns: int | None = None
        self._near: Closeness | None = None
        self._hindrance = ""

    def begin(self, t_ns: int) -> tuple[Event, ...]:
        """Start at an instant; return what happens. Raises ValueError where it has begun already."""
        self._expect("begin", Phase.WAITING)
        t_ns = self._act_ns(t_ns)
        self._began_ns = t_ns
        self._phase = Phase.RUNNING
        more: dict[str, object] = {}
        if self._carried is not None:
            self._take_over(self._carried.moved(t_ns))
            more["carried"] = carried_mapping(self._carried)
        self._watch.start(t_ns)
        begun = self._act(t_ns, say.BEGUN, task=placed_mapping(self.placed), order=list(self.order), **more)
        return begun, self._offer(t_ns) if self._carried is None else self._offered(t_ns)

    def pause(self, t_ns: int) -> tuple[Event, ...]:
        """Stop the time. Raises ValueError unless it runs."""
        self._expect("pause", Phase.RUNNING)
        t_ns = self._act_ns(t_ns)
        before = self._expired(t_ns)
        if self._phase is Phase.ENDED:
            return (*before, self._act(t_ns, say.PAUSED, void=True))
        self._watch.stop(t_ns)
        self._phase = Phase.PAUSED
        self._forget()
        return (*before, self._act(t_ns, say.PAUSED))

    def resume(self, t_ns: int) -> tuple[Event, ...]:
        """Let the time run again, the dwell beginning anew. Raises ValueError unless it is paused."""
        self._expect("resume", Phase.PAUSED)
        t_ns = self._act_ns(t_ns)
        self._watch.start(t_ns)
        self._phase = Phase.RUNNING
        return (self._act(t_ns, say.RESUMED),)

    def abort(self, t_ns: int) -> tuple[Event, ...]:
        """End it. Raises ValueError where it does not run and is not paused."""
        self._expect("abort", Phase.RUNNING, Phase.PAUSED)
        t_ns = self._act_ns(t_ns)
        before = self._expired(t_ns) if self._phase is Phase.RUNNING else []
        if self._phase is Phase.ENDED:
            return (*before, self._act(t_ns, say.ABORTED, void=True))
        act = self._act(t_ns, say.ABORTED)
        return (*before, act, *self._close(t_ns, Outcome.ABORTED))

    def take(self, track: Track) -> tuple[Event, ...]:
        """Take the next Track; return what happens."""
        if self._track_ns is not None and track.t_ns <= self._track_ns:
            return ()
        self._track_ns = track.t_ns
        started_ns = self._watch.started_ns
        if self._phase is not Phase.RUNNING or started_ns is None or track.t_ns < started_ns:
            return ()
        out = self._expired(track.t_ns)
        if self._phase is Phase.RUNNING:
            self._now_ns = track.t_ns
            out += self._judge(track, seen=self._watch.take(track))
        return tuple(out)

    @property
    def state(self) -> TrialState:
        """How it stands, at the last Track or act."""
        now, target = self._now_ns, self._target if self._phase in (Phase.RUNNING, Phase.PAUSED) else None
        active_ns = self._watch.active_ns(now)
        limit_s = self.placed.target_limit_s
        near = self._near
        return TrialState(
            phase=self._phase,
            target=None if target is None else target.key,
            number=len(self._offers) + (target is not None),
            of=None if self.placed.in_a_row is not None else len(self.order),
            reached=sum(each.reached for each in self._offers),
            in_a_row=self._row,
            progress=self._progress(target),
            distance_mm=None if near is None else near.distance_mm,
            angle_deg=None if near is None else near.angle_deg,
            up_deg=None if near is None else near.up_deg,
            hindrance=self._hindrance,
            active_s=active_ns / _NS,
            remaining_s=max(0.0, self.placed.limit_s - active_ns / _NS),
            target_remaining_s=None
            if limit_s is None or target is None
            else max(0.0, limit_s - (active_ns - self._offered_active_ns) / _NS),
            finished=self._outcome,
        )

    def result(self) -> TrialResult:
        """Return how it went; a trial that has not ended counts as interrupted at its last Track or act.

        Raises:
            ValueError: it never began.
        """
        if self._phase is Phase.WAITING:
            raise ValueError("Trial: expected one that has begun")
        now, offers, stretches = self._now_ns, list(self._offers), list(self._watch.closed)
        if self._outcome is None:
            offers.append(self._offer_so_far(now, reached=False))
            if self._watch.started_ns is not None:
                stretches.append((self._watch.started_ns, now))
        return TrialResult(
            id=self.id,
            outcome=self._outcome or Outcome.INTERRUPTED,
            began_ns=self._began_ns,
            ended_ns=now,
            active_s=self._watch.active_ns(now) / _NS,
            offers=tuple(offers),
            unseen_share=self._watch.unseen_share(now),
            stretches=tuple(stretches),
        )

    def carry(self) -> Carried:
        """Return how far it is, to be gone on with in another recording.

        Raises:
            ValueError: it has not begun, or has ended.
        """
        self._expect("be carried on", Phase.RUNNING, Phase.PAUSED)
        now, stretches = self._now_ns, list(self._watch.closed)
        if self._watch.started_ns is not None:
            stretches.append((self._watch.started_ns, now))
        return Carried(
            began_ns=self._began_ns,
            ended_ns=now,
            active_ns=self._watch.active_ns(now),
            unseen_ns=self._watch.unseen_ns,
            stretches=tuple(stretches),
            offers=tuple(self._offers),
            row=self._row,
            offered_ns=self._offered_ns,
            offered_active_ns=self._offered_active_ns,
            path_mm=self._path_mm,
            misses=self._misses,
        )

    def _take_over(self, carried: Carried) -> None:
        """Go on from what was carried, which is in this trial's clock."""
        self._began_ns, self._offers, self._row = carried.began_ns, list(carried.offers), carried.row
        self._offered_ns, self._offered_active_ns = carried.offered_ns, carried.offered_active_ns
        self._path_mm, self._misses = carried.path_mm, carried.misses
        self._watch.carry(carried.stretches, active_ns=carried.active_ns, unseen_ns=carried.unseen_ns)

    @property
    def _target(self) -> PlacedTarget:
        return self._targets[len(self._offers) % len(self._targets)]

    def _judge(self, track: Track, *, seen: bool) -> list[Event]:
        """Return what follows from a Track within the time limits. seen: since the one before."""
        target, out = self._target, []
        tip, pose = track.tip_box, track.box_from_tip
        if track.status is not Status.TRACKED or tip is None or pose is None:
            self._tip = self._near = None
            self._hindrance = f"The tip is not seen: {track.reason}."
            return self._outside(track.t_ns, seen=False)
        if seen and self._tip is not None:
            self._path_mm += float(np.linalg.norm(tip - self._tip))
        self._tip = tip
        if target.kind != "tip" and track.roll_rad is None:
            self._near, self._hindrance = None, "The roll is not known, which this target needs."
            return self._outside(track.t_ns, seen=False)
        self._hindrance = ""
        self._near = closeness(target, tip, pose.rotation)
        if not seen:
            out += self._outside(track.t_ns, seen=False)
        if not self._near.inside:
            return out + self._outside(track.t_ns, seen=True)
        if self._inside_ns is None:
            self._inside_ns = track.t_ns
            out.append(say.training_event(track.t_ns, say.ENTERED, self.id, target=target.key))
        if track.t_ns - self._inside_ns >= _to_ns(target.dwell_s):
            out += self._done(track.t_ns, reached=True)
        return out

    def _outside(self, t_ns: int, *, seen: bool) -> list[Event]:
        """End a dwell that had begun: a miss where it was seen."""
        if self._inside_ns is None:
            return []
        self._inside_ns = None
        self._misses += seen
        return [say.training_event(t_ns, say.LEFT, self.id, target=self._target.key, seen=seen)]

    def _done(self, t_ns: int, *, reached: bool) -> list[Event]:
        """Finish the current target at an instant and offer the next, or end."""
        key, active_s = self._target.key, self._watch.active_ns(t_ns) / _NS
        self._now_ns = t_ns
        self._offers.append(self._offer_so_far(t_ns, reached=reached))
        self._row = self._row + 1 if reached else 0
        said = {"active_s": active_s} if reached else {}
        out = [say.training_event(t_ns, say.REACHED if reached else say.MISSED, self.id, target=key, **said)]
        if self.placed.in_a_row is not None:
            if self._row == self.placed.in_a_row:
                return out + self._finish(t_ns, Outcome.COMPLETED)
        elif len(self._offers) == len(self.order):
            every = all(each.reached for each in self._offers)
            return out + self._finish(t_ns, Outcome.COMPLETED if every else Outcome.TIMED_OUT)
        return [*out, self._offer(t_ns)]

    def _expired(self, t_ns: int) -> list[Event]:
        """Let the limits that passed before an instant take effect, each at its own."""
        out: list[Event] = []
        while self._phase is Phase.RUNNING:
            whole_ns = self._watch.instant_ns(_to_ns(self.placed.limit_s))
            limit_s = self.placed.target_limit_s
            one_ns = whole_ns if limit_s is None else self._watch.instant_ns(self._offered_active_ns + _to_ns(limit_s))
            if min(whole_ns, one_ns) >= t_ns:
                break
            if whole_ns <= one_ns:
                out += self._close(whole_ns, Outcome.TIMED_OUT)
            else:
                out += self._done(one_ns, reached=False)
        return out

    def _close(self, t_ns: int, outcome: Outcome) -> list[Event]:
        """End with the current target not reached."""
        self._offers.append(self._offer_so_far(t_ns, reached=False))
        return self._finish(t_ns, outcome)

    def _finish(self, t_ns: int, outcome: Outcome) -> list[Event]:
        if self._watch.started_ns is not None:
            self._watch.stop(t_ns)
        self._now_ns, self._phase, self._outcome = t_ns, Phase.ENDED, outcome
        self._forget()
        active_s, reached = self._watch.active_ns(t_ns) / _NS, sum(each.reached for each in self._offers)
        return [say.training_event(t_ns, say.ENDED, self.id, outcome=outcome.value, active_s=active_s, reached=reached)]

    def _offer(self, t_ns: int) -> Event:
        """Offer the next target."""
        self._offered_ns, self._offered_active_ns = t_ns, self._watch.active_ns(t_ns)
        self._path_mm, self._misses, self._inside_ns, self._near = 0.0, 0, None, None
        return self._offered(t_ns)

    def _offered(self, t_ns: int) -> Event:
        """Say which target is offered since when."""
        active_s = self._offered_active_ns / _NS
        return say.training_event(t_ns, say.OFFERED, self.id, target=self._target.key, active_s=active_s)

    def _offer_so_far(self, t_ns: int, *, reached: bool) -> Offer:
        reached_s = self._watch.active_ns(t_ns) / _NS if reached else None
        offered_s = self._offered_active_ns / _NS
        result = TargetResult(self._target.key, offered_s, reached_s, self._path_mm, self._misses)
        return Offer(result, self._offered_ns, t_ns)

    def _forget(self) -> None:
        """Forget what must not be carried across a pause or the end."""
        self._tip = self._near = self._inside_ns = None
        self._hindrance = ""

    def _progress(self, target: PlacedTarget | None) -> float:
        if target is None or self._inside_ns is None or target.dwell_s == 0.0:
            return 0.0
        return min(1.0, (self._now_ns - self._inside_ns) / _to_ns(target.dwell_s))

    def _act_ns(self, t_ns: int) -> int:
        """Return the instant of an act, not before what has been taken already."""
        return max(int(t_ns), self._now_ns)

    def _act(self, t_ns: int, what: str, **payload: object) -> Event:
        if self._phase is not Phase.ENDED:
            self._now_ns = t_ns
        return say.training_event(t_ns, what, self.id, after_ns=self._track_ns, **payload)

    def _expect(self, act: str, *phases: Phase) -> None:
        if self._phase not in phases:
            raise ValueError(f"Trial: cannot {act} while it is {self._phase.value}")


def _to_ns(seconds: float) -> int:
    return round(seconds * _NS)
