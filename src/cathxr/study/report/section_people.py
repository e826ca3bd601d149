"""Sections on who took part and which trials count, and the list of all trials with where they come from."""

import statistics

from cathxr.core.trials import Outcome
from cathxr.study.analysis.analyse import Analysis
from cathxr.study.analysis.data import why_not
from cathxr.study.report.document import Block, Bullets, Heading, Paragraph, Table
from cathxr.study.report.figures_flow import flow_diagram

_MOST_LISTED = 400


def people(analysis: Analysis) -> list[Block]:
    """Return the flow of participants and trials."""
    flow, data = analysis.flow, analysis.data
    blocks: list[Block] = [Heading("Participants and trials"), Paragraph(flow.reading, "reading")]
    diagram = flow_diagram(flow)
    if diagram is not None:
        blocks.append(diagram)
    if flow.not_counted:
        rows = tuple((why, str(count)) for why, count in flow.not_counted)
        blocks.append(
            Table(
                "Trials that are not analysed, by reason.", ("reason", "trials"), rows, numbers=(1,), widths=(5.0, 1.0)
            )
        )
    if data.rules:
        blocks += [Paragraph("Exclusion rules, fixed before the data:"), Bullets(data.rules)]
    if data.changes:
        blocks += [Paragraph("Changes of the design after it was first adopted:"), Bullets(data.changes)]
    if flow.practised:
        blocks += _practice(analysis)
    if flow.unknown:
        blocks.append(
            Paragraph(
                f"Trials of codes that are no participants of this study: {', '.join(flow.unknown)}. They are analysed "
                "by their code; correct the store if they should not be.",
                "warning",
            )
        )
    return blocks


def _practice(analysis: Analysis) -> list[Block]:
    rows, lasts, times = [], [], []
    for person in analysis.data.participants:
        done = [each for each in analysis.data.trials if each.practice and each.participant == person.code]
        if done:
            last = max(done, key=lambda each: each.began)
            lasts.append(last.outcome)
            times.append(sum(each.active_s for each in done))
            rows.append(
                (
                    person.code,
                    str(len(done)),
                    f"{times[-1]:.0f}",
                    last.outcome.value.replace("_", " "),
                )
            )
    met = sum(each is Outcome.COMPLETED for each in lasts)
    told = (
        f"Practice was ended by its criterion in {met} of {len(lasts)} participants; it took them "
        f"{min(times):.0f} to {max(times):.0f} s (median {statistics.median(times):.0f} s)."
    )
    table = Table(
        "Familiarisation before the data: its length and how it ended, by participant.",
        ("participant", "practice trials", "active time, s", "ended"),
        tuple(rows[:_MOST_LISTED]),
        numbers=(1, 2),
        widths=(1.2, 1.0, 1.0, 1.6),
    )
    return [Paragraph(told, "reading"), table] if rows else []


def trial_list(analysis: Analysis) -> list[Block]:
    """Return the list of every trial with its recording and software, so that each number can be traced."""
    trials = sorted(analysis.data.trials, key=lambda each: each.began)
    blocks: list[Block] = [Heading("Where the numbers come from")]
    if len(trials) > _MOST_LISTED:
        blocks.append(
            Paragraph(
                f"The study has {len(trials)} trials, too many to list here. `cathxr study export` gives each with its "
                "recording, task and software version."
            )
        )
        return blocks
    name_of = analysis.data.name_of
    software = sorted({each.software for each in trials})
    one = len(software) == 1
    rows = tuple(
        (
            each.participant,
            name_of(each.condition),
            f"{each.period or 'practice'}",
            str(each.number),
            f"{each.active_s:.1f}",
            f"{each.reached}/{len(each.targets)}" if each.targets else "–",
            f"{100.0 * each.unseen_share:.0f}",
            why_not(each) or each.outcome.value.replace("_", " "),
            each.session or "–",
            *([] if one else [each.software or "–"]),
        )
        for each in trials
    )
    head = (
        "participant",
        "view",
        "period",
        "no.",
        "time, s",
        "targets",
        "unseen, %",
        "counts as",
        "recording",
        *([] if one else ["software"]),
    )
    blocks.append(
        Table(
            "All trials in the order of their start. unseen: share of the active time without a tracked pose."
            + (f" Software: cathxr {software[0]}." if one and software[0] else ""),
            head,
            rows,
            numbers=(3, 4, 5, 6),
            widths=(1.25, 1.0, 0.95, 0.5, 0.8, 0.9, 0.9, 1.5, *((2.4,) if one else (1.5, 1.1))),
        )
    )
    return blocks
