"""Time and targets: the published paper's t, nT and tT, without dividing what is censored."""

from cathxr.core.trials import Outcome
from cathxr.training.metrics.measure import Measure, Run, none


def completion_time(run: Run) -> Measure:
    """Return the active time until the last target was reached, s; none where the trial is censored."""
    if run.result.outcome is Outcome.COMPLETED:
        return Measure(run.result.active_s)
    return none(f"not completed ({run.result.outcome.value}): censored at {run.result.active_s:.1f} s")


def targets_reached(run: Run) -> Measure:
    """Return how many targets were reached."""
    return Measure(float(run.result.reached))


def time_per_target(run: Run) -> Measure:
    """Return t / nT, s; none where a target was not reached."""
    if run.result.outcome is Outcome.COMPLETED:
        return Measure(run.result.active_s / run.result.reached)
    return none(f"not completed ({run.result.outcome.value}): t / nT would flatter whoever reached fewer")


def misses(run: Run) -> Measure:
    """Return how often the tip left a target before the dwell was over."""
    return Measure(float(sum(each.misses for each in run.result.targets)))


def unseen_share(run: Run) -> Measure:
    """Return how much of the active time the tip was not seen, %."""
    return Measure(100.0 * run.result.unseen_share)
