"""A program of its own that writes trials into a store and says which are kept: writer.py PLACE STUDY CODE HOW."""

import resource
import signal
import sys
from pathlib import Path

from sqlalchemy import insert

from cathxr.core import DataError
from cathxr.core.trials import TrialRecord
from cathxr.storage.study_store import StudyStore, rows
from cathxr.storage.study_store.schema import TRIAL

sys.path.insert(0, str(Path(__file__).parent))
from records import AT, trial  # beside this file, wherever that is


def say(text: str) -> None:
    print(text, flush=True)


def main(place: str, study: str, code: str, how: str) -> None:
    with StudyStore.open(place, study=study) as store:
        if how == "limited":
            # the system refuses what goes past it, as a full disk does
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            size = Path(place).stat().st_size + 30_000
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
        if how == "halfway":
            halfway(store, study, [trial(f"half-{code}-{each}", code, number=each + 1) for each in range(2000)])
        number = 0
        while how in ("forever", "limited", "full") or number < int(how):
            record = trial(f"{code}-{number}", code, number=number + 1)
            try:
                store.record(record, at=AT)
            except DataError as error:
                say(f"refused: {error}")
                return
            say(record.id)
            number += 1


def halfway(store: StudyStore, study: str, trials: list[TrialRecord]) -> None:
    """Write trials, far more than a cache holds, say so, and never end the transaction."""
    with store._writing() as connection:
        connection.exec_driver_sql("PRAGMA cache_size = 1") if connection.dialect.name == "sqlite" else None
        for each in trials:
            connection.execute(insert(TRIAL).values(study=study, design=0, **rows.trial_row(each)))
        say("halfway")
        signal.pause()


if __name__ == "__main__":
    main(*sys.argv[1:])
