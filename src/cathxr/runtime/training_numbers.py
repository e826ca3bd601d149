"""From a trial's recording to its record with measures, and to the path that the scene shows again."""

from collections.abc import Mapping, Sequence

import numpy as np

from cathxr.core import FloatArray, Track
from cathxr.core.track import Status
from cathxr.core.trials import Outcome, TrialRecord, TrialStart
from cathxr.geometry import resampled
from cathxr.runtime.training_say import target_messages
from cathxr.training import PlacedTask, TrialResult
from cathxr.training.metrics import Depth, Measure, Run, measured, motion_of, values
from cathxr.wire.training_messages import RunPath, TargetState

_RATE_HZ = 20.0
_SHAPE_POINTS = 12
Vector = tuple[float, float, float]


def measures_of(
    result: TrialResult, placed: PlacedTask, tracks: Sequence[Track], depth: Depth | None
) -> dict[str, Measure]:
    """Return every metric of a trial; tracks in the time of the result."""
    return measured(Run(result, placed, motion_of(tracks, result.stretches), depth))


def record_of(
    start: TrialStart,
    result: TrialResult,
    measures: Mapping[str, Measure],
    *,
    invalid: str = "",
    outcome: Outcome | None = None,
) -> TrialRecord:
    """Return the record of a trial that has ended. outcome: where it is another than the result's."""
    return TrialRecord(
        id=start.id,
        participant=start.participant,
        task=start.task,
        condition=start.condition,
        number=start.number,
        period=start.period,
        began=start.began,
        outcome=outcome or result.outcome,
        active_s=result.active_s,
        targets=result.targets,
        measures=values(dict(measures)),
        unseen_share=min(1.0, result.unseen_share),
        practice=start.practice,
        invalid=invalid,
        session=start.session,
        box=start.box,
        software=start.software,
        task_sha256=start.task_sha256,
    )


def run_path(
    of: TrialStart | TrialRecord, placed: PlacedTask, order: Sequence[str], result: TrialResult, tracks: Sequence[Track]
) -> RunPath:
    """Return a run for the scene: 20 samples a second of active time; tracks in the time of the result."""
    t: list[float] = []
    tip: list[Vector | None] = []
    beam: list[Vector | None] = []
    shape: list[list[Vector] | None] = []
    before_ns = 0
    due_s = 0.0
    for begin, end in result.stretches:
        for track in tracks:
            active_s = (before_ns + track.t_ns - begin) / 1e9
            if not begin <= track.t_ns <= end or active_s < due_s - 1e-6:
                continue
            due_s = (np.floor(active_s * _RATE_HZ + 1e-6) + 1.0) / _RATE_HZ
            t.append(round(active_s, 4))
            seen = track.status is Status.TRACKED and track.shape_box is not None and track.box_from_tip is not None
            tip.append(_vector(track.shape_box[0], 3) if seen and track.shape_box is not None else None)
            shape.append(_shape(track.shape_box) if seen and track.shape_box is not None else None)
            rolled = seen and track.roll_rad is not None and track.box_from_tip is not None
            pose = track.box_from_tip
            beam.append(_vector(pose.rotation[:, 0], 5) if rolled and pose is not None else None)
        before_ns += end - begin
    offers = {each.result.key: each for each in result.offers}
    states: dict[str, TargetState] = {key: "reached" if each.reached else "missed" for key, each in offers.items()}
    return RunPath(
        id=of.id,
        participant=of.participant,
        task=of.task,
        t=t,
        tip=tip,
        beam=beam,
        shape=shape,
        targets=target_messages(placed, order, states),
        reached=[
            (each.result.key, round(each.result.reached_s, 3))
            for each in result.offers
            if each.result.reached_s is not None
        ],
    )


def _shape(points: FloatArray) -> list[Vector]:
    return [_vector(each, 2) for each in resampled(points, _SHAPE_POINTS)]


def _vector(values: FloatArray, digits: int) -> Vector:
    x, y, z = (round(float(each), digits) for each in values)
    return x, y, z
