"""Measures a study store with many trials: writing them, and everything that a report and the board ask of it.

python benchmarks/study_store.py [--trials 100000] [--store PLACE] [--json]

Every trial has six targets and 25 measures; a survey of 16 items is answered three times by everybody. The store is a
new SQLite file, or PLACE (such as postgresql://…). Times are of this process: wall clock, and the processor's beside
it. A report then goes on with statistics and pictures of its own, whose time is not counted here.
"""

import argparse
import json
import random
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cathxr.core.trials import Answer, Outcome, Participant, TargetResult, TrialRecord
from cathxr.storage.study_store import StudyStore
from cathxr.study.board import board
from cathxr.study.design_file import design_from_text
from cathxr.study.design_template import design_template
from cathxr.study.report_data import measure_of, study_data
from cathxr.study.surveys import builtin_surveys

AT = "2026-01-01T00:00:00Z"
TRIALS_OF_ONE = 100


def trial(number: int, chance: random.Random) -> TrialRecord:
    """Return the `number`-th trial of the study."""
    person, mine = divmod(number, TRIALS_OF_ONE)
    times = sorted(chance.uniform(0.0, 90.0) for _ in range(6))
    return TrialRecord(
        id=f"{number:032x}", participant=f"P{person}", task="six_targets", condition=("2d", "3d")[mine % 2],
        number=mine // 2 + 1, period=mine % 2 + 1, began=f"2026-01-01T00:00:00.{number:06d}Z",
        outcome=Outcome.COMPLETED, active_s=times[-1], unseen_share=chance.uniform(0.0, 0.1),
        targets=tuple(TargetResult(f"target_{k}", t, t, chance.uniform(10.0, 200.0)) for k, t in enumerate(times)),
        measures={f"measure_{k}": chance.gauss(0.0, 100.0) for k in range(24)} | {"t": times[-1]},
        session=f"2026-01-01/{number}", box="box-1", software="0.0.0", task_sha256="0" * 64,
    )  # fmt: skip


def measure(place: str, count: int) -> dict[str, tuple[float, float]]:
    """Return wall and processor seconds of every step, for a store at `place` with `count` trials."""
    found: dict[str, tuple[float, float]] = {}

    @contextmanager
    def timed(name: str) -> Iterator[None]:
        wall, processor = time.perf_counter(), time.process_time()
        yield
        found[name] = (time.perf_counter() - wall, time.process_time() - processor)

    chance = random.Random(1)
    surveys = {each.key: each for each in builtin_surveys()}
    design = design_from_text(
        design_template(key="bench", title="b", task="six_targets", practice="practice", planned=1)
    )
    with StudyStore.create(place, study="bench", seed=1, software="0", at=AT) as store:
        people = [Participant(f"P{each}", "2d>3d", "", AT) for each in range(count // TRIALS_OF_ONE)]
        answers = [
            Answer(each.code, "ssq", item.key, occasion, AT, 1.0)
            for each in people
            for occasion in ("before", "after:2d", "after:3d")
            for item in surveys["ssq"].items
        ]
        with timed("write: participants and answers"):
            store.answer(answers, at=AT, enrol=people)
        with timed("write: trials, 1000 a transaction"):
            for start in range(0, count, 1000):
                store.record_all([trial(each, chance) for each in range(start, start + 1000)], at=AT)
        with timed("write: one more trial"):
            store.record(TrialRecord("x", "P0", "t", "2d", 999, 1, AT, Outcome.ABORTED, 1.0), at=AT)
        with timed("read: participants"):
            participants = store.participants()
        with timed("read: trials"):
            trials = store.trials()
        with timed("read: answers"):
            given = store.answers()
        assert (len(participants), len(trials), len(given)) == (len(people), count + 1, len(answers))
        with timed("read: designs"):
            store.designs()
        with timed("make ready: exclusion rules, measures, scores of surveys"):
            measures = {
                key: measure_of(key, name=key, unit="mm", better="lower", trials=trials) for key in design.secondary
            }
            study_data(
                design, participants=participants, trials=trials, answers=given, surveys=surveys, measures=measures,
                seed=0,
            )  # fmt: skip
        with timed("(the board, besides)"):
            board(design, surveys, participants, trials=trials, answers=given)
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=100_000)
    parser.add_argument("--store", help="a new SQLite file unless given")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = measure(options.store or str(Path(folder) / "bench.sqlite"), options.trials)
    if options.json:
        print(json.dumps(found))
        return
    print(f"{options.trials} trials")
    for name, (wall, processor) in found.items():
        print(f"  {name:58} {wall:8.2f} s wall, {processor:8.2f} s processor")
    asked = [each for name, each in found.items() if name.startswith(("read", "make ready"))]
    wall, processor = (sum(each) for each in zip(*asked, strict=True))
    print(f"  {'all that a report asks of the store':58} {wall:8.2f} s wall, {processor:8.2f} s processor")


if __name__ == "__main__":
    main()
