"""The catalogue of metrics: key, name, unit, which way is better, formula in words, source, function."""

from cathxr.training.metrics import aim, curves, outcome, path, smoothness, turning, wall
from cathxr.training.metrics.measure import Measure, Metric, Run

_PAPER = "the published two-camera ICE training system's t, nT, tT"
_PERK = "Perk Tutor: Ungi et al., IEEE Trans. Biomed. Eng. 59(12), 2012"
_SMOOTH = "Balasubramanian et al., J. NeuroEng. Rehabil. 12:112, 2015"
_OWN = "this project; shown to agree with no other instrument yet"
_MOVEMENTS = (
    "Over the movements: from each reached target's offer until it was reached, where the tip was seen throughout."
)
_SMOOTHED = (
    "Mean over the movements of 5 mm or more, each from the first to the last sample at 5 % of its greatest speed."
)

METRICS: tuple[Metric, ...] = (
    Metric("t", "Completion time", "s", "lower",
           "Active time from the beginning until the last target was reached, dwells included, pauses not. Only of "
           "completed trials: any other is censored.", _PAPER, outcome.completion_time),
    Metric("nT", "Targets reached", "", "higher", "How many targets were reached.", _PAPER, outcome.targets_reached),
    Metric("tT", "Time per target", "s", "lower",
           "t / nT. Only of completed trials: dividing a censored time would flatter whoever reached fewer.",
           _PAPER, outcome.time_per_target),
    Metric("misses", "Misses", "", "lower",
           "How often the tip, in sight, left a target before its dwell was over.", _OWN, outcome.misses),
    Metric("unseen", "Time not seen", "%", "neither",
           "Share of the active time without a tracked pose: coasting, lost, or no Track for over 0.25 s. What is "
           "summed over a trial is not given above 10 %.", _OWN, outcome.unseen_share),
    Metric("path_length", "Path length", "mm", "lower", "Sum of the tip's steps while it was seen.",
           _PERK, path.path_length),
    Metric("path_inefficiency", "Path inefficiency", "%", "lower",
           f"100 (L / D − 1): L the path, D the straight distance from its first to its last point, each summed. "
           f"{_MOVEMENTS}", _PERK, path.path_inefficiency),
    Metric("mean_speed", "Mean tip speed", "mm/s", "neither", "Path length / time seen.",
           "FEVS: validated with 52 persons", path.mean_speed),
    Metric("peak_speed", "Peak tip speed", "mm/s", "neither", "Greatest step / its time.",
           "FEVS: validated with 52 persons", path.peak_speed),
    Metric("sparc", "Smoothness (SPARC)", "", "higher",
           "Minus the arc length of the speed's scaled magnitude spectrum up to 10 Hz, where it is at least 0.05; "
           f"negative, nearer to 0 is smoother. {_SMOOTHED}", _SMOOTH, smoothness.mean_sparc),
    Metric("ldlj", "Smoothness (LDLJ)", "", "higher",
           "−ln(T³ / v_peak² ∫|d²v/dt²|² dt) of the velocity; negative, nearer to 0 is smoother. "
           f"{_SMOOTHED}", _SMOOTH, smoothness.mean_ldlj),
    Metric("rotation_total", "Total rotation", "deg", "lower",
           "Sum of the angles between one orientation of the tip and the next.", _PERK, turning.rotation_total),
    Metric("rotation_actions", "Rotation actions", "", "lower",
           "Runs of at least 0.2 s that turn at 15 deg/s or more (over 0.1 s), until below half of that.",
           _PERK, turning.rotation_actions),
    Metric("translation_actions", "Translation actions", "", "lower",
           "Runs of at least 0.2 s with the tip at 5 mm/s or more, until below half of that.",
           _PERK, turning.translation_actions),
    Metric("idle_time", "Idle time", "s", "lower",
           "Time in runs of at least 0.5 s slower than 1 mm/s and 5 deg/s. Dwells on a target are idle too.",
           _PERK, turning.idle_time),
    Metric("roll_economy", "Roll economy", "%", "higher",
           "100 · sum of |net roll| / sum of the roll made, of the handle, on the way to each reached target; 100: it "
           "never turned back.", _OWN, turning.roll_economy),
    Metric("axial_motion", "Motion along the tip's axis", "mm", "neither",
           "Sum of |step · the tip's tangent|.", _PERK, path.axial_motion),
    Metric("tip_distance", "Tip to target", "mm", "lower",
           "Mean distance from the tip to its target at the Track that reached it.", _OWN, aim.tip_distance),
    Metric("beam_distance", "Beam to target", "mm", "lower",
           "Mean shortest distance from the beam to its target at the Track that reached it.", _OWN, aim.beam_distance),
    Metric("aim_angle", "Angle to target", "deg", "lower",
           "Mean angle between the beam and the line to the target, or the tip's axis and the wanted direction, at the "
           "Track that reached it.", _OWN, aim.aim_angle),
    Metric("plane_angle", "Plane to view, angle", "deg", "lower",
           "Mean angle between the normals of the image plane and the view's plane at the Track that reached it.",
           _OWN, aim.plane_angle),
    Metric("plane_direction", "Plane to view, direction", "deg", "lower",
           "Mean angle between the beam and the direction that the view's beam has, at the Track that reached it.",
           _OWN, aim.plane_direction),
    Metric("plane_offset", "Plane to view, distance", "mm", "lower",
           "Mean distance of the view's place from the image plane at the Track that reached it.", _OWN,
           aim.plane_offset),
    Metric("breach_count", "Virtual wall breaches", "", "lower",
           "How often the tip went 1 mm or deeper into a wall of the virtual heart, until it was back in the blood. No "
           "perforation: the real catheter cannot feel the virtual wall.", _OWN, wall.breach_count),
    Metric("breach_time", "Virtual wall breach, time", "s", "lower", "Time in breaches.", _OWN, wall.breach_time),
    Metric("breach_path", "Virtual wall breach, path", "mm", "lower", "Path in breaches.", _OWN, wall.breach_path),
    Metric("breach_depth", "Virtual wall breach, depth", "mm", "lower", "Greatest depth in breaches; 0 without one.",
           _OWN, wall.breach_depth),
    Metric("frechet", "Fréchet distance to an expert", "mm", "lower",
           "Discrete Fréchet distance of the two paths, 400 points each.",
           "Eiter, Mannila, TU Vienna CD-TR 94/64, 1994", curves.frechet),
    Metric("hausdorff", "Hausdorff distance to an expert", "mm", "lower",
           "Greatest distance of a point of one path from the other path, both ways, 400 points each.",
           "Hausdorff, Grundzüge der Mengenlehre, 1914", curves.hausdorff),
    Metric("dtw", "Warped distance to an expert", "mm", "lower",
           "Mean distance of the pairs that dynamic time warping makes of the two paths, 400 points each.",
           "Sakoe, Chiba, IEEE Trans. ASSP 26(1), 1978", curves.dtw),
)  # fmt: skip


def measured(run: Run) -> dict[str, Measure]:
    """Return every metric of a trial by its key: a number, or the reason why there is none."""
    return {each.key: each.function(run) for each in METRICS}


def values(measures: dict[str, Measure]) -> dict[str, float]:
    """Return the numbers alone, as a `TrialRecord` holds them: what cannot be had is absent."""
    return {key: each.value for key, each in measures.items() if each.value is not None}


def catalogue_text() -> str:
    """Return the catalogue as a Markdown table, for docs/metrics.md."""
    better = {"lower": "lower", "higher": "higher", "neither": "—"}
    rows = [
        (f"`{each.key}`", each.name, each.unit or "—", better[each.better], _cell(each.formula), each.source)
        for each in METRICS
    ]
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join(["| key | name | unit | better | formula | source |", "|---|---|---|---|---|---|", *lines, ""])


def _cell(text: str) -> str:
    """Return text for a table's cell, which a bar would end."""
    return text.replace("|", "&#124;")
