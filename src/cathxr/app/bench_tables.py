"""The tracking part of the benchmark page: accuracy by category, speed, growth, and how soon it is found again."""

from collections.abc import Callable, Sequence

import numpy as np

from cathxr.app.bench_sequence import WRONG_MM, SequenceScore, Speed, reacquisition, sequence_scores, speed

METHODS = ("model", "paper")
SIZES = ((640, 480), (1280, 720), (1920, 1080))
_USUAL = (1280, 720)
FIRST_SEED = 3
_AT_REST = ("rest",)
_TIMED_PAIRS = 60
_RETURNS = 8
_HEAD = (
    "scene", "method", "tracked", "tip mean", "tip p95", "tip max", "shape mean", "shape max", "tangent mean",
    "error / sigma", "wrong", "ms steady",
)  # fmt: skip
_CALIBRATIONS = {
    "exact": "exact camera poses",
    "fiducials": "camera poses from four fiducials each, seen with 0.1 px of noise (another draw for each sequence)",
}


def tracking_part(
    scenes: Sequence[str],
    *,
    pairs: int,
    rate_hz: float,
    calibration: str,
    sequences: int,
    begun: Callable[[str], None],
    progress: Callable[[], None],
    so_far: Callable[[str], None],
) -> str:
    """Return the page's part on tracking: both methods on the same pictures, in one run.

    begun: told each scene's name; progress: called after each pair; so_far: given the page's part after each scene.
    """
    rows: list[tuple[str, ...]] = []
    notes: list[str] = []
    seeds = tuple(range(FIRST_SEED, FIRST_SEED + sequences))
    wrong = dict.fromkeys(METHODS, 0)
    counted = dict.fromkeys(METHODS, 0)
    for name in scenes:
        begun(name)
        measured = sequence_scores(
            name, METHODS, pairs=pairs, rate_hz=rate_hz, calibration=calibration, seeds=seeds, progress=progress
        )
        for method, score in measured.items():
            rows.append(_row(name, method, score))
            wrong[method] += score.wrong
            counted[method] += score.statuses.get("tracked", 0)
            if name in _AT_REST:
                notes.append(f"Jitter of the tip, scene {name}, {method}: {score.jitter_mm:.4f} mm RMS about its mean.")
        overall = ", ".join(
            f"{method} {wrong[method]} of {counted[method]} ({100.0 * wrong[method] / max(counted[method], 1):.2f} %)"
            for method in METHODS
        )
        total = f"Wrong (called tracked, tip more than {WRONG_MM:g} mm off) over all scenes: {overall}."
        text = _accuracy(rows, [*notes, total], pairs, sequences, rate_hz, calibration)
        so_far(text)
    return text + "\n\n" + _speed_part()


def _accuracy(
    rows: list[tuple[str, ...]], notes: list[str], pairs: int, sequences: int, rate_hz: float, calibration: str
) -> str:
    """Return the table of all categories, and what is to be said about it."""
    return (
        f"## Tracking\n\nErrors in mm (tangent in degrees), over tracked pairs, against the twin's truth; shape is the "
        f"symmetric mean distance, its maximum the largest distance of all. {pairs} pairs a scene in "
        f"{sequences} sequences at {rate_hz:g} pairs/s, read near the prediction as live, exact intrinsics, "
        f"{_CALIBRATIONS[calibration]}. wrong: pairs called tracked whose tip is more than {WRONG_MM:g} mm off. "
        "ms steady: median processor time of detection in both views and the fit.\n\n"
        + table(_HEAD, rows)
        + "\n\n"
        + "\n\n".join(notes)
    )


def _row(name: str, method: str, score: SequenceScore) -> tuple[str, ...]:
    total = sum(score.statuses.values())
    share = f"{100.0 * score.statuses.get('tracked', 0) / max(total, 1):.1f} %"
    seconds = score.predicted_s if len(score.predicted_s) > len(score.whole_s) else score.whole_s
    spent = f"{1e3 * float(np.median(seconds)):.2f}" if seconds else "-"
    if not score.shape_mm:
        return (name, method, share, *("-",) * 8, spent)
    tip = np.array(score.tip_mm)
    return (
        name, method, share, f"{tip.mean():.3f}", f"{np.quantile(tip, 0.95):.3f}", f"{tip.max():.3f}",
        f"{np.mean(score.shape_mm):.3f}", f"{np.max(score.shape_max_mm):.3f}", f"{np.mean(score.tangent_deg):.2f}",
        f"{np.sqrt(np.mean(np.square(score.normalised))):.2f}", str(score.wrong), spent,
    )  # fmt: skip


def _speed_part() -> str:
    """Return what a pair costs, at several picture sizes, and how soon a catheter that comes back is tracked."""
    model = {size: speed("model", pairs=_TIMED_PAIRS, size_px=size) for size in SIZES}
    paper = speed("paper", pairs=_TIMED_PAIRS // 2, size_px=_USUAL)
    usual = model[_USUAL]
    rows = [_speed_row(size, each, usual) for size, each in model.items()]
    waits = reacquisition(times=_RETURNS)
    return (
        "### Speed\n\nProcessor time of detection in both views and the fit, smooth scene, one thread, pictures in "
        "memory, medians, ms. steady: read near the prediction; whole: all of both pictures; first: from nothing, "
        "after the compiled parts are loaded.\n\n"
        + table(("pictures", "steady", "whole", "first", "steady, ratio", "pixels, ratio"), rows)
        + f"\n\nThe paper method takes {1e3 * paper.whole_s:.1f} ms a pair at {_USUAL[0]}x{_USUAL[1]} in the same run: "
        f"{paper.whole_s / usual.steady_s:.1f} times the model's steady pair, {paper.whole_s / usual.whole_s:.2f} "
        "times its whole one.\n\nA catheter that comes back after half a second of an empty box is tracked in pair "
        f"{max(waits)} at the latest ({len(waits)} returns)."
    )


def _speed_row(size: tuple[int, int], each: Speed, usual: Speed) -> tuple[str, ...]:
    pixels = size[0] * size[1] / (_USUAL[0] * _USUAL[1])
    times = (f"{1e3 * spent:.2f}" for spent in (each.steady_s, each.whole_s, each.first_s))
    return (f"{size[0]}x{size[1]}", *times, f"{each.steady_s / usual.steady_s:.2f}", f"{pixels:.2f}")


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])
