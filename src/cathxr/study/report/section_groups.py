"""The section on groups of people, such as novices and experts: each by itself, then how they differ."""

from cathxr.study.analysis.analyse import Analysis
from cathxr.study.analysis.estimates import effect_cell, number, p_cell, percent
from cathxr.study.analysis.groups import GroupDifference, Groups
from cathxr.study.report.document import Block, Heading, Paragraph, Table

_BY_WHOM = (
    "Nobody is put into a group by chance: what differs between groups may be due to whatever else differs between "
    "these people. The main analysis takes all groups together."
)


def groups(analysis: Analysis) -> list[Block]:
    """Return each group's numbers and the groups' differences; nothing where there are fewer than two groups."""
    found = analysis.groups
    if found is None:
        return []
    blocks: list[Block] = [Heading("Groups"), Paragraph(_BY_WHOM, "small"), _described(analysis, found)]
    blocks.append(_views(analysis, found))
    if found.differences:
        blocks.append(_compared(analysis, found.differences))
        blocks += [Paragraph(each.reading, "reading") for each in found.differences if each.holm_p is None]
    if found.too_few:
        blocks.append(
            Paragraph(f"Too few people in both views to compare {'; '.join(found.too_few)}.", "warning")
        )  # fmt: skip
    if found.ungrouped:
        blocks.append(Paragraph(f"In no group, and so not in this section: {', '.join(found.ungrouped)}.", "small"))
    return blocks


def _described(analysis: Analysis, found: Groups) -> Table:
    rows = tuple(
        (
            group.name,
            analysis.data.name_of(each.condition),
            str(each.participants),
            str(each.trials),
            number(each.mean) + (f" ± {number(each.sd)}" if each.sd is not None else ""),
            number(each.geometric) if each.geometric is not None else "–",
            number(each.median),
        )
        for group in found.results
        for each in group.described
    )
    return Table(
        f"{analysis.data.primary.label}, by group and view: all trials that count.",
        ("group", "view", "people", "trials", "mean ± SD", "geom. mean", "median"),
        rows, numbers=(2, 3, 4, 5, 6), widths=(1.4, 1.4, 0.8, 0.8, 1.6, 1.3, 1.0),
    )  # fmt: skip


def _views(analysis: Analysis, found: Groups) -> Table:
    data, rows = analysis.data, []
    for group in found.results:
        terms = group.model.of_kind("view")
        for each in terms:
            alone = "" if group.model.view_alone else " (with practice: cannot be told apart)"
            told = effect_cell(each.effect, data.primary) + alone
            rows.append((group.name, str(group.participants), each.column.level, told, p_cell(each.p)))
        if not terms:
            rows.append((group.name, str(group.participants), "–", group.model.why, "–"))
    level = percent(1.0 - data.alpha)
    return Table(
        f"What the view does in each group by itself: the mixed model, against {data.conditions[0].name}.",
        ("group", "people", "view", f"effect ({level} interval)", "p"),
        tuple(rows), numbers=(1, 4), widths=(1.4, 0.7, 1.4, 3.2, 0.8),
        note="Not corrected for the number of groups. That one group's interval holds no difference and another's does "
        "not is no difference between the groups: the next table has that.",
    )  # fmt: skip


def _compared(analysis: Analysis, compared: tuple[GroupDifference, ...]) -> Table:
    level = percent(1.0 - analysis.data.alpha)
    rows = tuple(
        (
            each.measure.name,
            f"{each.subject} − {each.reference}",
            "level" if each.kind == "level" else f"change by {each.condition}",
            effect_cell(each.effect, each.measure),
            f"{each.sizes[1]}, {each.sizes[0]}",
            p_cell(each.p),
            p_cell(each.rank_sum.p),
            p_cell(each.holm_p),
        )
        for each in compared
    )
    return Table(
        "Groups compared, each person counted once.",
        ("outcome", "groups", "of", f"difference ({level} interval)", "people", "p", "p, rank-sum", "p, Holm"),
        rows, numbers=(4, 5, 6, 7), widths=(1.7, 1.6, 1.5, 2.5, 0.8, 0.7, 0.9, 0.8),
        note="Level: of people's means over the views, by Welch's t. Change: of how much a view changes a person's "
        "value. Rank-sum: exact. Holm: over the secondary outcomes. Times of trials that the limit cut enter with the "
        "limit. Periods and practice weigh alike in groups that were allocated alike.",
    )  # fmt: skip
