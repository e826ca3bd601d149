"""Paths of trials out of a recording: the trial's own part, a pause and unseen stretches as gaps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cathxr.app.study_paths import trial_path
from cathxr.core import DataError
from cathxr.core.trials import Outcome, TrialRecord
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionWriter
from cathxr.training import Trial

from ...training_support.tracks import placed, tip_target, tracks

RECORD = TrialRecord("T-1", "P01", "task", "3d", 1, 1, "2026-01-05T09:00:00Z", Outcome.COMPLETED, 1.0)


def test_a_path_is_the_trials_own_and_keeps_its_gaps(tmp_path: Path) -> None:
    tips = [None if 30 <= i < 40 else (0.5 * i, 0.0, 0.0) for i in range(100)]
    recorded = tracks(tips, step_ms=20, start_ms=1000)
    trial, events = Trial(placed(tip_target("a", (45.0, 0.0, 0.0), radius=2.0)), ("a",), trial="T-1"), []
    for i, track in enumerate(recorded):
        events += trial.take(track)
        if i == 10:
            events += trial.begin(track.t_ns + 1_000_000)
        elif i == 60:
            events += trial.pause(track.t_ns + 1_000_000)
        elif i == 70:
            events += trial.resume(track.t_ns + 1_000_000)
    clock = (recorded[0].t_ns, "2026-01-01T00:00:00Z")
    writer = SessionWriter(tmp_path / "s", rig=example_rig(), config={}, clock_pair=clock, videos=False)
    for each in recorded:
        writer.write_track(each)
    for event in events:
        writer.write_event(event)
    writer.close()
    path = trial_path(tmp_path / "s", RECORD)
    assert path is not None
    assert (path.trial, path.condition) == ("T-1", "3d")
    assert path.targets_box.tolist() == [[45.0, 0.0, 0.0]]
    runs = path.runs()
    assert len(runs) == 3
    assert runs[0][0, 0] >= 0.5 * 10  # nothing from before it began
    for run in runs:
        assert np.diff(run[:, 0]).max() < 1.0  # no line over the unseen stretch, nor over the pause
    with pytest.raises(DataError):
        trial_path(tmp_path / "absent", RECORD)
    with pytest.raises(DataError):
        trial_path(tmp_path / "s", replace(RECORD, id="T-2"))
