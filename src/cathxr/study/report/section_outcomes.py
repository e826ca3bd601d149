"""Sections on the outcomes: the primary one in full, the secondary ones in tables."""

from cathxr.study.analysis.analyse import Analysis, Comparison, OutcomeResult
from cathxr.study.analysis.data import Measure
from cathxr.study.analysis.estimates import Estimate, effect_cell, number, p_cell, percent
from cathxr.study.analysis.model import Model
from cathxr.study.report.document import Block, Heading, Paragraph, Table
from cathxr.study.report.figures_times import changes, times_by_participant


def primary(analysis: Analysis) -> list[Block]:
    """Return the primary outcome: pictures, description, model, exact tests, effect sizes, power."""
    result, data = analysis.primary, analysis.data
    blocks: list[Block] = [Heading(f"Primary outcome: {result.measure.name}"), *times_by_participant(analysis)]
    slopes = changes(analysis)
    if slopes is not None:
        blocks.append(slopes)
    blocks += [
        _described(analysis, (result,), result.measure.name),
        Heading(result.model.name.capitalize(), 2),
        *_model(analysis, result),
    ]
    if analysis.interaction is not None:
        blocks += [Heading("Does the view do the same in both periods?", 2), *_interaction(analysis)]
    if analysis.uncut is not None and analysis.uncut.view is not None:
        blocks.append(
            Paragraph(
                "Without the trials that the time limit cut: " + analysis.uncut.reading
                + " Leaving out the slowest trials makes this the less careful answer.",
                "small",
            )
        )  # fmt: skip
    for comparison in result.comparisons:
        title = f"{comparison.subject.name} against {comparison.reference.name}, person by person"
        blocks += [Heading(title, 2), *_person_by_person(comparison, result.measure, data.alpha)]
    if analysis.power is not None:
        blocks += [
            Heading("What this number of participants can show", 2),
            Paragraph(analysis.power.reading, "reading"),
        ]
        if analysis.power.more and analysis.power.detectable is not None:
            blocks.append(_more(analysis))
    return blocks


def secondary(analysis: Analysis) -> list[Block]:
    """Return the secondary outcomes: one table of what was measured, one of the comparisons with Holm's correction."""
    results = analysis.outcomes[1:]
    if not results:
        return []
    blocks: list[Block] = [Heading("Secondary outcomes"), _described(analysis, results, "Secondary outcomes")]
    rows: list[tuple[str, ...]] = []
    strong: list[int] = []
    for result in results:
        for at, term in enumerate(result.model.of_kind("view")):
            exact = next((c.wilcoxon for c in result.comparisons if c.subject.name == term.column.level), None)
            holm = result.holm_p[at]
            if holm <= analysis.data.alpha:
                strong.append(len(rows))
            rows.append(
                (
                    result.measure.name,
                    term.column.level,
                    effect_cell(term.effect, result.model.measure),
                    p_cell(term.p),
                    p_cell(holm),
                    p_cell(exact.p if exact else None),
                )
            )
        if result.model.why:
            rows += _without_model(result)
    level = percent(1.0 - analysis.data.alpha)
    blocks.append(
        Table(
            f"Views compared, {level} intervals. ×: a ratio, of counts that of their means by the model for counts, "
            "else that of geometric means by the mixed model; the others are differences by the mixed model.",
            ("outcome", "view", f"effect ({level} interval)", "p", "p, Holm", "p, signed-rank"),
            tuple(rows),
            numbers=(3, 4, 5),
            note=(
                "Holm: corrected for the number of rows. Bold: differs after the correction. Signed-rank: exact, each "
                "participant once, not corrected, period not taken out. A row without a model is not in the correction."
            ),
            strong=tuple(strong),
            widths=(1.9, 1.1, 2.7, 0.9, 0.9, 1.5),
        )
    )
    readings = [each for result in results for term in result.model.of_kind("view") if (each := term.reading)]
    if not analysis.primary.model.view_alone:
        readings = ["View and practice cannot be told apart here, for these outcomes as for the primary one."]
    blocks += [Paragraph(each, "reading") for each in readings]
    remarks: dict[str, list[str]] = {}
    for result in results:
        for remark in result.model.remarks:
            remarks.setdefault(remark, []).append(result.measure.name)
    return [*blocks, *(Paragraph(f"{', '.join(names)}: {each}", "small") for each, names in remarks.items())]


def _described(analysis: Analysis, results: tuple[OutcomeResult, ...], caption: str) -> Table:
    rows = tuple(
        (
            result.measure.label,
            analysis.data.name_of(each.condition),
            str(each.participants),
            str(each.trials),
            number(each.mean) + (f" ± {number(each.sd)}" if each.sd is not None else ""),
            number(each.geometric) if each.geometric is not None else "–",
            number(each.median),
            f"{number(each.low)} to {number(each.high)}",
        )
        for result in results
        for each in result.described
    )
    head = ("measure", "view", "people", "trials", "mean ± SD", "geom. mean", "median", "range")
    return Table(
        f"{caption}: all trials that count, by view. SD: of the sample of trials, people and their trials together.",
        head, rows, numbers=(2, 3, 4, 5, 6, 7), widths=(2.3, 1.2, 0.8, 0.8, 1.6, 1.1, 1.0, 1.6),
    )  # fmt: skip


def _model(analysis: Analysis, result: OutcomeResult) -> list[Block]:
    model, measure = result.model, result.model.measure
    if model.why:
        return [Paragraph(model.why, "warning")]
    level = percent(1.0 - analysis.data.alpha)
    rows = tuple(
        (each.column.name, effect_cell(each.effect, measure), f"{each.dof:.0f}", p_cell(each.p)) for each in model.terms
    )
    note = f"{model.trials} trials of {model.participants} participants. "
    if model.sd_participant is not None and model.sd_residual is not None:
        note += (
            f"Standard deviation between participants {number(model.sd_participant)}, within "
            f"{number(model.sd_residual)} (on the model's scale). "
        )
    blocks: list[Block] = [
        Table(
            f"{measure.name} {_formula(model)}.",
            ("term", f"effect ({level} interval)", "df", "p"),
            rows,
            numbers=(2, 3),
            note=f"{note}view: against {analysis.data.conditions[0].name}.",
            strong=tuple(at for at, each in enumerate(model.terms) if each.column.kind == "view"),
            widths=(2.2, 3.0, 0.6, 0.8),
        ),
        Paragraph(model.reading, "reading" if model.view_alone else "warning"),
    ]
    others = [each.reading for each in model.terms if each.column.kind != "view"]
    if others:
        blocks.append(Paragraph(" ".join(others), "reading"))
    return [*blocks, *(Paragraph(each, "small") for each in model.remarks)]


def _formula(model: Model) -> str:
    """Return the model's formula and scale, as a caption goes on."""
    if model.kind == "counts":
        return "~ view + period + trial, Poisson regression with robust errors by participant: effects are ratios"
    scale = "log of the measure: effects are ratios" if model.measure.log else "measure as it is: differences"
    return f"~ view + period + sequence + trial + (1 | participant), on the {scale}"


def _without_model(result: OutcomeResult) -> list[tuple[str, ...]]:
    """Return the rows of an outcome that has no model: why, and the exact test of each view."""
    if not result.comparisons:
        return [(result.measure.name, "–", result.model.why, "–", "–", "–")]
    return [
        (result.measure.name, each.subject.name, result.model.why, "–", "–",
         p_cell(each.wilcoxon.p if each.wilcoxon else None))
        for each in result.comparisons
    ]  # fmt: skip


def _interaction(analysis: Analysis) -> list[Block]:
    found, level = analysis.interaction, percent(1.0 - analysis.data.alpha)
    assert found is not None
    rows = (
        ("view, in period 1", effect_cell(found.first, found.measure), f"{found.dof:.0f}", "–"),
        ("view, in period 2", effect_cell(found.second, found.measure), f"{found.dof:.0f}", "–"),
        ("view × period", effect_cell(found.change, found.measure), f"{found.dof:.0f}", p_cell(found.p)),
    )
    return [
        Table(
            "The mixed model with view × period in the sequence's place.",
            ("term", f"effect ({level} interval)", "df", "p"),
            rows,
            numbers=(2, 3),
            note="view × period: its effect in period 2 against that in period 1. In a study of two orders this is "
            "also the carry-over, and the difference between the two groups: one number that cannot be taken apart. It "
            "chooses no analysis.",
            strong=(2,),
            widths=(2.2, 3.0, 0.6, 0.8),
        ),
        Paragraph(found.reading, "warning" if found.change.excludes_zero else "reading"),
    ]


def _person_by_person(comparison: Comparison, measure: Measure, alpha: float) -> list[Block]:
    rows: list[tuple[str, ...]] = []
    effects, cross = comparison.effects, comparison.cross_over
    for test in (comparison.wilcoxon, comparison.permutation, cross.exact if cross else None):
        if test is not None:
            how = "exact" if test.exact else "approximate"
            rows.append((f"{test.name}, {how}", "–", str(test.n), p_cell(test.p), f"{test.smallest_p:.3f}"))
    if effects is not None:
        rows.append(("Mean of the differences (t)", effect_cell(effects.mean, measure), str(effects.n), "–", "–"))
        if effects.middle is not None:
            rows.append(
                (
                    "Middle of the differences (Hodges-Lehmann)",
                    effect_cell(effects.middle, measure),
                    str(effects.n),
                    "–",
                    "–",
                )
            )
        if effects.standardised is not None:
            rows.append(("Standardised (d_z, Hedges)", _plain(effects.standardised), str(effects.n), "–", "–"))
    if cross is not None:
        n = str(sum(cross.sizes))
        rows += [
            ("AB/BA: view, period taken out (t)", effect_cell(cross.view, measure), n, p_cell(cross.view_p), "–"),
            (
                "AB/BA: second period against first (t)",
                effect_cell(cross.period, measure),
                n,
                p_cell(cross.period_p),
                "–",
            ),
            ("AB/BA: carry-over (t)", effect_cell(cross.carry_over, measure), n, p_cell(cross.carry_over_p), "–"),
        ]
    if not rows:
        return [Paragraph("No participant has trials in both views.", "warning")]
    blocks: list[Block] = [
        Table(
            "Each participant counts once: the mean of their trials in a view, one view minus the other.",
            ("analysis", f"effect ({percent(1.0 - alpha)} interval)", "people", "p", "least p"),
            tuple(rows),
            numbers=(2, 3, 4),
            note=(
                "Least p: the smallest that a test can give with this number of people. Rank-sum: of the differences "
                "between periods, so that the period is taken out (Koch 1972)."
            ),
            widths=(2.9, 2.6, 0.7, 0.8, 0.9),
        )
    ]
    if cross is not None:
        people = (
            "People may differ in how much a view helps them, and here that is allowed for: this interval does not "
            "rest on the mixed model's assumption that a view helps everybody alike. "
        )
        blocks.append(Paragraph(people + cross.reading, "reading"))
    elif comparison.wilcoxon is not None:
        blocks.append(
            Paragraph(
                "The period cannot be taken out here: fewer than two people had either order of the views.", "warning"
            )
        )
    if comparison.differences.only_one:
        blocks.append(
            Paragraph(f"Trials in one of both views only: {', '.join(comparison.differences.only_one)}.", "small")
        )
    return blocks


def _plain(effect: Estimate) -> str:
    return f"{number(effect.value, 2)} ({number(effect.low, 2)} to {number(effect.high, 2)})"


def _more(analysis: Analysis) -> Table:
    power, measure = analysis.power, analysis.data.primary
    assert power is not None
    assert power.detectable is not None
    sign = -1.0 if measure.better == "lower" else 1.0
    rows = []
    for n, value in ((power.n, power.detectable), *power.more):
        shown = effect_cell(Estimate(sign * value, sign * value, sign * value), measure).split(" (")[0]
        rows.append((str(n), shown))
    return Table(
        f"The true difference that {percent(power.power)} of studies of a size would find, if people's differences "
        "spread as they do here.",
        ("participants", "difference found"),
        tuple(rows),
        note="The power of the difference that was found is not given: it would only say the p value again.",
    )
