"""Sections on learning, on targets not reached in time, and on the paths."""

from collections.abc import Sequence

from cathxr.study.analysis.analyse import Analysis
from cathxr.study.analysis.estimates import percent
from cathxr.study.report.document import Block, Heading, Paragraph, Table
from cathxr.study.report.figures_course import learning_curves, not_yet_completed
from cathxr.study.report.figures_paths import TrialPath, paths


def course(analysis: Analysis) -> list[Block]:
    """Return learning over the trials, and targets and trials not reached within the limit."""
    blocks: list[Block] = [Heading("Learning"), Paragraph(analysis.learning.reading, "reading")]
    curves = learning_curves(analysis)
    if curves is not None:
        blocks.append(curves)
    cut, data = analysis.censoring, analysis.data
    blocks += [Heading("Targets not reached"), Paragraph(cut.reading, "reading")]
    level = percent(1.0 - data.alpha)
    rows = tuple(
        (
            data.name_of(each.condition),
            f"{each.completed} of {each.trials}",
            f"{percent(each.share.value)} ({percent(each.share.low)} to {percent(each.share.high)})",
            f"{each.targets_reached} of {each.targets}" if each.targets else "–",
            f"{each.median_s:.0f}" if each.median_s is not None else "not reached",
        )
        for each in cut.views
    )
    if rows:
        blocks.append(
            Table(
                "Trials completed within the limit, and targets reached, by view.",
                ("view", "completed", f"share ({level} interval)", "targets reached", "median time, s"),
                rows,
                numbers=(1, 2, 3, 4),
                widths=(1.2, 1.0, 2.0, 1.3, 1.2),
                note=(
                    "Shares: Wilson's interval, which takes trials as independent though a person's are alike, and so "
                    "is rather too narrow. Median: of Kaplan and Meier's curve, in which cut trials count as cut."
                ),
            )
        )
    picture = not_yet_completed(analysis)
    if picture is not None:
        blocks.append(picture)
    return blocks


def path_pictures(analysis: Analysis, trial_paths: Sequence[TrialPath]) -> list[Block]:
    """Return the pictures of the paths; nothing where no recordings were given."""
    picture = paths(analysis, trial_paths)
    if picture is None:
        return []
    return [Heading("Paths"), picture]
