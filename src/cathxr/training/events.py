"""The Events of training, in one place. All are of one kind; the payload's `what` says what happened.

A person's acts. They are recorded, and a recording is replayed by doing them again. `trial`: the trial's id.
`after_ns`: the instant of the last Track that the trial had been given before the act (None: none yet), since Tracks
arrive later than the instant they are of.

| what | payload beside `what`, `trial`, `after_ns` |
|---|---|
| begun | `task`: `placed_mapping`; `order`: the targets' keys; `carried` (`carried_mapping`) where it goes on |
| paused, resumed, aborted | `void` true where the trial had ended by itself just before |

What follows from Tracks and acts; a replay gives the same to the last bit.

| what | payload beside `what`, `trial` |
|---|---|
| offered | `target`, `active_s` |
| entered | `target`: within its limits, the dwell has begun |
| left | `target`; `seen` false where the tip was lost to sight, which is no miss |
| reached | `target`, `active_s` |
| missed | `target`: its own time limit came first |
| ended | `outcome`, `active_s`, `reached`: how many |
"""

from typing import Any

from cathxr.core import Event

KIND = "training"
BEGUN, PAUSED, RESUMED, ABORTED = "begun", "paused", "resumed", "aborted"
OFFERED, ENTERED, LEFT, REACHED, MISSED, ENDED = "offered", "entered", "left", "reached", "missed", "ended"
ACTS = (BEGUN, PAUSED, RESUMED, ABORTED)


def training_event(t_ns: int, what: str, trial: str, **payload: Any) -> Event:
    """Return an Event of training."""
    return Event(t_ns, KIND, {"what": what, "trial": trial, **payload})


def is_act(event: Event) -> bool:
    """Return whether an Event is a person's act on a trial."""
    return event.kind == KIND and event.payload.get("what") in ACTS
