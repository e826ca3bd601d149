"""The report's contents: from an analysis to a document."""

from collections.abc import Sequence
from dataclasses import dataclass

from cathxr.study.analysis.analyse import Analysis
from cathxr.study.analysis.estimates import p_text
from cathxr.study.analysis.model import CONFOUNDED
from cathxr.study.report.document import Block, Bullets, Document, Heading, Paragraph
from cathxr.study.report.figures_paths import TrialPath
from cathxr.study.report.section_groups import groups
from cathxr.study.report.section_methods import methods
from cathxr.study.report.section_outcomes import primary, secondary
from cathxr.study.report.section_people import people, trial_list
from cathxr.study.report.section_surveys import surveys
from cathxr.study.report.section_times import course, path_pictures


@dataclass(frozen=True)
class Made:
    """Where the report comes from. when: UTC, ISO 8601; software: version; libraries: name and version of each.

    store: where the data were read from, without a password; question: the study's, as its design states it.
    simulated: in what way the data are, as a sentence.
    """

    when: str
    software: str
    libraries: tuple[tuple[str, str], ...] = ()
    store: str = ""
    question: str = ""
    simulated: str = ""


def report(analysis: Analysis, made: Made, trial_paths: Sequence[TrialPath] = ()) -> Document:
    """Return the report's document."""
    data, flow = analysis.data, analysis.flow
    facts = [
        ("Participants", f"{flow.participants} joined"),
        ("Trials", f"{flow.analysed} analysed of {flow.trials}"),
        ("Views", ", ".join(each.name for each in data.conditions)),
        ("Primary outcome", data.primary.name + (f" ({data.primary.unit})" if data.primary.unit else "")),
        ("Made", f"{made.when}, cathxr {made.software}"),
    ]
    if made.store:
        facts.append(("Data", made.store))
    blocks: list[Block] = []
    if made.simulated:
        blocks.append(Paragraph(made.simulated, "warning"))
    blocks += [
        *_summary(analysis),
        *people(analysis),
        *primary(analysis),
        *course(analysis),
        *secondary(analysis),
        *groups(analysis),
        *path_pictures(analysis, trial_paths),
        *surveys(analysis),
        *methods(analysis, made.libraries),
        *trial_list(analysis),
    ]
    return Document(data.name, made.question or "Report of a study", tuple(facts), tuple(blocks))


def _summary(analysis: Analysis) -> list[Block]:
    model = analysis.primary.model
    told = [model.reading]
    comparison = analysis.primary.comparisons[0] if analysis.primary.comparisons else None
    if comparison is not None and comparison.effects is not None and comparison.wilcoxon is not None:
        told.append(
            f"{comparison.effects.same_way} of {comparison.effects.n} participants changed in that direction; by the "
            f"exact signed-rank test, which takes each person once, p = {comparison.wilcoxon.p:.3f} (the smallest that "
            f"{comparison.wilcoxon.n} people can give is {comparison.wilcoxon.smallest_p:.3f})."
        )
    told += _doubts(analysis)
    if analysis.interaction is not None and analysis.interaction.change.excludes_zero:
        told.append(analysis.interaction.reading)
    told.append(analysis.learning.reading)
    if analysis.censoring.censored:
        told.append(analysis.censoring.reading)
    better = [each for each in analysis.outcomes[1:] if each.holm_p and min(each.holm_p) <= analysis.data.alpha]
    if len(analysis.outcomes) > 1 and model.view_alone:
        names = ", ".join(each.measure.name for each in better) or "none"
        told.append(
            f"Of {len(analysis.outcomes) - 1} secondary outcomes, these differ between views after correction for "
            f"their number: {names}."
        )
    blocks: list[Block] = [Heading("In plain words"), Bullets(tuple(each for each in told if each))]
    if not model.view_alone and model.view is not None:
        why = "everybody had the views in the same order" if model.doubt == CONFOUNDED else "it is too small"
        blocks.append(
            Paragraph(
                f"The view cannot be told from practice in this study: {why}. Do not report its difference as the "
                "effect of the view.",
                "warning",
            )
        )
    blocks.append(Paragraph("For training and research; not a medical device.", "small"))
    return blocks


def _doubts(analysis: Analysis) -> list[str]:
    """Return a sentence where the model and the analyses that take each person once come out on different sides."""
    model = analysis.primary.model
    comparison = analysis.primary.comparisons[0] if analysis.primary.comparisons else None
    if comparison is None or model.view is None or not model.view_alone:
        return []
    finds, alpha = model.view.effect.excludes_zero, analysis.data.alpha
    others = []
    cross, test = comparison.cross_over, comparison.wilcoxon
    if cross is not None and cross.view.excludes_zero != finds:
        others.append(f"the AB/BA analysis by person ({p_text(cross.view_p)})")
    if cross is not None and (cross.exact.p <= alpha) != finds:
        others.append(f"the exact rank-sum test ({p_text(cross.exact.p)})")
    if test is not None and (test.p <= alpha) != finds:
        practice = ", to which practice is noise" if cross is not None else ""
        others.append(f"the exact signed-rank test ({p_text(test.p)}{practice})")
    if not others:
        return []
    several = len(others) > 1
    what = "finds a difference between the views" if finds else "finds no difference that chance could not make"
    does = ("do not" if several else "does not") if finds else ("find one" if several else "finds one")
    return [
        f"The {model.name} {what} ({p_text(model.view.p)}); {' and '.join(others)} {does}: people may differ in how "
        "much the view helps them, or are too few to tell. Take the result as provisional."
    ]
