"""What a trial carries over from a recording that the program ended under: plain numbers, exact to the last bit."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from cathxr.core.trials import TargetResult
from cathxr.training.state import Offer

PAUSE_NS = 1_000_000_000
"""What is carried is moved in time so that it ends this long before the trial goes on: clocks of two runs differ."""


@dataclass(frozen=True)
class Carried:
    """How far a trial was at the last Track or act of its recording, in that recording's clock.

    offers: the targets that are done. stretches: the active ones, (from, to) ns. row: targets in a row, in practice.
    offered_ns, offered_active_ns, path_mm, misses: of the target that was offered and not done.
    """

    began_ns: int
    ended_ns: int
    active_ns: int
    unseen_ns: int
    stretches: tuple[tuple[int, int], ...]
    offers: tuple[Offer, ...]
    row: int
    offered_ns: int
    offered_active_ns: int
    path_mm: float
    misses: int

    def moved(self, t_ns: int) -> "Carried":
        """Return it in the clock of a trial that goes on at `t_ns`."""
        by_ns = shift_ns(self.ended_ns, t_ns)
        return replace(
            self,
            began_ns=self.began_ns + by_ns,
            ended_ns=self.ended_ns + by_ns,
            stretches=tuple((start + by_ns, end + by_ns) for start, end in self.stretches),
            offers=tuple(moved_offer(each, by_ns) for each in self.offers),
            offered_ns=self.offered_ns + by_ns,
        )


def shift_ns(ended_ns: int, goes_on_ns: int) -> int:
    """Return what is added to instants of a recording that ended there, for a trial that goes on then."""
    return goes_on_ns - PAUSE_NS - ended_ns


def moved_offer(offer: Offer, by_ns: int) -> Offer:
    """Return an offer moved in time."""
    return replace(offer, offered_ns=offer.offered_ns + by_ns, until_ns=offer.until_ns + by_ns)


def carried_mapping(carried: Carried) -> dict[str, Any]:
    """Return it for JSON; `carried_from_mapping` is the inverse."""
    offers = [dict(vars(each)) | {"result": dict(vars(each.result))} for each in carried.offers]
    return dict(vars(carried)) | {"stretches": [list(each) for each in carried.stretches], "offers": offers}


def carried_from_mapping(values: Mapping[str, Any]) -> Carried:
    """Return what `carried_mapping` gave.

    Raises:
        ValueError, KeyError, TypeError: it is none.
    """
    offers = tuple(Offer(**{**each, "result": TargetResult(**each["result"])}) for each in values["offers"])
    stretches = tuple((int(start), int(end)) for start, end in values["stretches"])
    return Carried(**{**values, "stretches": stretches, "offers": offers})
