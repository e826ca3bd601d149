"""Trials of a recording, done again: the same machine, given the recorded Tracks and the person's recorded acts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cathxr.core import DataError, Event, Track
from cathxr.training import events as say
from cathxr.training.carried import carried_from_mapping
from cathxr.training.orders import order_of
from cathxr.training.placing import PlacedTask, placed_from_mapping
from cathxr.training.state import Phase
from cathxr.training.task import Task
from cathxr.training.trial import Trial


@dataclass(frozen=True)
class Replayed:
    """A trial after its replay, and the Events that came out of it."""

    trial: Trial
    events: tuple[Event, ...]


def replay_trials(tracks: Sequence[Track], events: Iterable[Event]) -> tuple[Replayed, ...]:
    """Return the trials of a recording, done again, in their order. Events that are no acts of training are left out.

    Raises:
        DataError: an act does not say what it must, or does not fit its trial.
    """
    acts: dict[str, list[Event]] = {}
    for event in events:
        if say.is_act(event):
            acts.setdefault(str(event.payload.get("trial", "")), []).append(event)
    return tuple(_replayed(tracks, each) for each in acts.values())


def run_task(placed: PlacedTask, order: Sequence[str], tracks: Sequence[Track]) -> Replayed:
    """Return a task done on a recording that was made without one: it begins at the first Track."""
    trial = Trial(placed, order)
    out = list(trial.begin(tracks[0].t_ns)) if tracks else []
    for track in tracks:
        out += trial.take(track)
    return Replayed(trial, tuple(out))


def default_order(task: Task) -> tuple[str, ...]:
    """Return the order in which a task offers its targets where nobody has chosen a seed or a row."""
    return order_of(task)


def _replayed(tracks: Sequence[Track], acts: Sequence[Event]) -> Replayed:
    """Return one trial, each act done after the Track after which it was done live."""
    try:
        first = acts[0].payload
        if first["what"] != say.BEGUN:
            raise ValueError(f"expected it to begin with {say.BEGUN}, got {first['what']}")
        order = [str(each) for each in first["order"]]
        before = carried_from_mapping(first["carried"]) if "carried" in first else None
        trial = Trial(placed_from_mapping(first["task"]), order, trial=str(first["trial"]), carried=before)
        out: list[Event] = []
        left = list(acts)
        for track in tracks:
            while left and (left[0].payload["after_ns"] is None or left[0].payload["after_ns"] < track.t_ns):
                out += _do(trial, left.pop(0))
            out += trial.take(track)
            if trial.state.phase is Phase.ENDED and not left:
                break
        for act in left:
            out += _do(trial, act)
    except (ValueError, KeyError, TypeError) as error:
        raise DataError(
            f"The recorded trial {acts[0].payload.get('trial')!r} cannot be done again ({error}); it was recorded by "
            "another version or is damaged."
        ) from error
    return Replayed(trial, tuple(out))


def _do(trial: Trial, act: Event) -> tuple[Event, ...]:
    what = act.payload["what"]
    if what == say.BEGUN:
        return trial.begin(act.t_ns)
    if trial.state.phase is Phase.ENDED:
        return ()
    if what == say.PAUSED:
        return trial.pause(act.t_ns)
    return trial.resume(act.t_ns) if what == say.RESUMED else trial.abort(act.t_ns)
