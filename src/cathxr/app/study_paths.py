"""The tip's paths of a study's trials, out of their recordings."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cathxr.core.trials import TrialRecord
from cathxr.storage.session import SessionReader

if TYPE_CHECKING:
    from cathxr.study.report.figures_paths import TrialPath


def trial_paths(session: Path, trials: Sequence[TrialRecord]) -> list["TrialPath"]:
    """Return the path of each of `trials` (by id) that the recording `session` holds; a pause breaks it as a gap does.

    Raises:
        CathxrError: no recording there, or it is damaged.
    """
    from cathxr.study.report.figures_paths import TrialPath
    from cathxr.training import replay_trials
    from cathxr.training.metrics import motion_of

    reader = SessionReader(session)
    tracks = tuple(reader.tracks())
    wanted = {each.id: each for each in trials}
    found = []
    for each in replay_trials(tracks, reader.events()):
        result = each.trial.result()
        record = wanted.get(result.id)
        motion = motion_of(tracks, result.stretches)
        if record is None or not motion.seen.any():
            continue
        seen = np.array(motion.seen, dtype=bool)
        seen[1:] &= np.diff(motion.stretch) == 0  # the first sample after a pause makes room for the gap
        places = [target.point_box for target in each.trial.placed.targets]
        targets = np.array(places, dtype=np.float64).reshape(len(places), 3)
        found.append(TrialPath(record.id, record.condition, motion.tip_box, seen, targets))
    return found
