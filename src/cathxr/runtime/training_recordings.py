"""Trials in their recordings: what each recording says it is of, and a trial joined from all its parts."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from cathxr.core import DataError, Event, Track
from cathxr.core.trials import TrialStart
from cathxr.storage.atomic import written_whole
from cathxr.storage.session import SessionReader
from cathxr.training import Replayed, TrialResult, moved_offer, replay_trials, shift_ns
from cathxr.training import events as say

LABEL = "trial.json"
"""Beside session.toml: which trial of which study this is, so that one can be stored that no store heard of."""
SCHEMA = "cathxr-trial/1"
_PART = "continued-"


@dataclass(frozen=True, eq=False)
class RecordedTrial:
    """A trial as its recordings give it, all parts joined in one time.

    replayed: the last part's, done again. recorded: the Events of training that were recorded in it. result, tracks:
    of all parts, in nanoseconds since the trial began. parts: the folders.
    """

    replayed: Replayed
    recorded: tuple[Event, ...]
    result: TrialResult
    tracks: tuple[Track, ...]
    parts: tuple[Path, ...]

    @property
    def is_same(self) -> bool:
        """Whether the replay gave the very Events that were recorded."""
        return self.replayed.events == self.recorded


def part_folder(session: str, part: int) -> str:
    """Return the folder of a trial's part, from 1, below that of all recordings; session: the first part's."""
    return session if part == 1 else f"{session}/{_PART}{part}"


def part_folders(first: Path) -> tuple[Path, ...]:
    """Return the folders of a trial's parts, oldest first, those without a session left out."""
    more = sorted(first.glob(f"{_PART}*"), key=lambda each: (len(each.name), each.name))
    return tuple(each for each in (first, *more) if (each / "session.toml").is_file())


def next_part(first: Path) -> int:
    """Return the number of the part that comes next; a folder that holds no session is not used again."""
    numbers = [each.name.removeprefix(_PART) for each in first.glob(f"{_PART}*")]
    return 1 + max((int(each) for each in numbers if each.isdecimal()), default=1)


def write_label(folder: Path, start: TrialStart, *, study: str) -> None:
    """Say in a recording's folder which trial it is of.

    Raises:
        DataError: it cannot be written.
    """
    document = {"schema": SCHEMA, "study": study, **asdict(start)}
    with written_whole(folder / LABEL) as part:
        part.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8", newline="\n")


def labelled(recordings: Path, *, study: str) -> Iterator[TrialStart]:
    """Yield the trials of a study that the recordings below a folder are of; what cannot be read is left out."""
    for path in sorted(recordings.glob(f"*/{LABEL}")):
        try:
            values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            if values.pop("schema") == SCHEMA and values.pop("study") == study:
                yield TrialStart(**values)
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue


def recorded_trial(first: Path, trial: str) -> RecordedTrial:
    """Return a trial from its recordings. first: the folder of the first part.

    Raises:
        CathxrError: there is no such recording, it is damaged, or the trial did not begin in it.
    """
    found: list[tuple[Path, tuple[Track, ...], tuple[Event, ...], Replayed]] = []
    for folder in part_folders(first):
        reader = SessionReader(folder)
        tracks = tuple(reader.tracks())
        events = tuple(each for each in reader.events() if each.kind == say.KIND and each.payload.get("trial") == trial)
        for each in replay_trials(tracks, events):
            found.append((folder, tracks, events, each))
    if not found:
        raise DataError(f"{first}: the trial {trial} did not begin in this recording.")
    _, _, recorded, last = found[-1]
    joined, by_ns = [], [0]
    for _, _, events, _ in reversed(found[1:]):
        begun = next(each for each in events if each.payload["what"] == say.BEGUN)
        by_ns.append(by_ns[-1] + shift_ns(int(begun.payload["carried"]["ended_ns"]), begun.t_ns))
    origin = last.trial.result().began_ns
    for (_, tracks, _, _), shift in zip(found, reversed(by_ns), strict=True):
        joined += [replace(each, t_ns=each.t_ns + shift - origin) for each in tracks]
    result = _moved(last.trial.result(), -origin)
    return RecordedTrial(last, recorded, result, _in_order(joined), tuple(each[0] for each in found))


def _in_order(tracks: list[Track]) -> tuple[Track, ...]:
    """Return Tracks of which each is later than the one before; a part's last ones, after its end, may not be."""
    out: list[Track] = []
    for each in tracks:
        while out and out[-1].t_ns >= each.t_ns:
            out.pop()
        out.append(each)
    return tuple(out)


def _moved(result: TrialResult, by_ns: int) -> TrialResult:
    return replace(
        result,
        began_ns=result.began_ns + by_ns,
        ended_ns=result.ended_ns + by_ns,
        stretches=tuple((start + by_ns, end + by_ns) for start, end in result.stretches),
        offers=tuple(moved_offer(each, by_ns) for each in result.offers),
    )
