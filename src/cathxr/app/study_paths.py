"""The tip's path of a study's trial, out of its recordings."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cathxr.core.trials import TrialRecord

if TYPE_CHECKING:
    from cathxr.study.report.figures_paths import TrialPath


def trial_path(session: Path, record: TrialRecord) -> "TrialPath | None":
    """Return the path of a trial that the recording `session`, with those that go on from it, holds; None if unseen.

    A pause breaks the path as a gap does.

    Raises:
        CathxrError: no recording of that trial there, or it is damaged.
    """
    from cathxr.runtime.training_recordings import recorded_trial
    from cathxr.study.report.figures_paths import TrialPath
    from cathxr.training.metrics import motion_of

    found = recorded_trial(session, record.id)
    motion = motion_of(found.tracks, found.result.stretches)
    if not motion.seen.any():
        return None
    seen = np.array(motion.seen, dtype=bool)
    seen[1:] &= np.diff(motion.stretch) == 0  # the first sample after a pause makes room for the gap
    places = [target.point_box for target in found.replayed.trial.placed.targets]
    targets = np.array(places, dtype=np.float64).reshape(len(places), 3)
    return TrialPath(record.id, record.condition, motion.tip_box, seen, targets)
