"""The study.toml that `cathxr study init` writes for a person to change: 2D against 3D, counterbalanced."""

from string import Template

_TEMPLATE = Template(
    """\
# A study's design. It is fixed before the first participant is allocated; docs/study.md explains every key.
schema = "cathxr-study/1"
key = "$key"                     # small letters, digits, - and _
title = "$title"
question = "Does the view change how fast the targets are reached?"

[conditions.2d]
name = "2D view"
view = "2d"                      # what is shown: 2d, 3d or free

[conditions.3d]
name = "3D view"
view = "3d"

[sequences]
$sequences

[trials]
tasks = ["$task"]
per_condition = $per_condition                # of every task

[practice]
task = "$practice"
when = "first"                   # first: once; each: before every condition

[participants]
planned = $planned
# groups = ["novice", "expert"]  # allocated apart from each other

[allocation]
blocks = [1, 2]                  # blocks of one or two whole sets of sequences, drawn at random
# seed = 1234                    # without it one is drawn and kept in the store: then nobody can foretell a draw

[outcomes]
primary = "t"
secondary = ["nT", "tT", "path_length", "sparc", "breach_count"]

[[exclusions]]
key = "unseen"
reason = "the catheter was out of the cameras' sight for too long"
of = "trial"
measure = "unseen_share"
above = 0.25

[[exclusions]]
key = "ended"
reason = "the trial was not brought to its end"
of = "trial"
measure = "outcome"
is = ["aborted", "interrupted"]

[[exclusions]]
key = "too_few"
reason = "a condition has no trial that counts"
of = "participant"
measure = "valid_trials"
below = 1

[[surveys]]
survey = "ssq"                   # cathxr study survey --list names them
asked = "before"

[[surveys]]
survey = "ssq"
asked = "each"

[[surveys]]
survey = "tlx"
asked = "each"

[[surveys]]
survey = "sus"
asked = "end"

[[surveys]]
survey = "paper"
asked = "end"
"""
)


_CROSSOVER = 'kind = "crossover"               # crossover: AB and BA; latin: Williams square; permutations; listed'
_ONE_ORDER = 'kind = "listed"\nlisted = [["2d", "3d"]]          # view and practice cannot be told apart'


def design_template(
    *, key: str, title: str, task: str, practice: str, planned: int, per_condition: int = 3, one_order: bool = False
) -> str:
    """Return the text of a study.toml to begin with. key and title: the study's; the others as in the file.

    one_order: everybody has the conditions in the same order, to show what comes of it.
    """
    title = title.replace("\\", "\\\\").replace('"', '\\"')
    return _TEMPLATE.substitute(
        key=key, title=title, task=task, practice=practice, planned=planned, per_condition=per_condition,
        sequences=_ONE_ORDER if one_order else _CROSSOVER,
    )  # fmt: skip
