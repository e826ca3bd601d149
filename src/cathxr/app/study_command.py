"""`cathxr study`: a study from its design to its report."""

import click

from cathxr.app.lazy_group import LazyGroup

_COMMANDS = {
    "init": ("study_init", "init", "Begin a study, or adopt the design that study.toml says now."),
    "allocate": ("study_allocate", "allocate", "Draw a participant's order of conditions."),
    "next": ("study_next", "next_", "Say what a participant does next."),
    "board": ("study_board", "board_", "Show how far everybody is, and what was cut off."),
    "mark": ("study_mark", "mark", "Mark a trial as invalid, or end one that was cut off."),
    "survey": ("study_survey", "survey", "Ask a survey on the console."),
    "enter": ("study_enter", "enter", "Enter answers from a CSV file."),
    "export": ("study_export", "export", "Give everything out as CSV, with a data dictionary."),
    "report": ("study_report", "report", "Write the report: HTML and PDF."),
    "simulate": ("study_simulate", "simulate", "Make a study of simulated participants, to try things out."),
    "delete": ("study_delete", "delete", "Delete a participant, with the recordings where asked."),
}


@click.group("study", cls=LazyGroup, commands_of=_COMMANDS)
def study() -> None:
    """Run a study in a folder: study.toml is its design, study.sqlite its store.

    Participants are known by code only. With several boxes or sites the store may be a PostgreSQL database:
    --store postgresql://user@host/database, or CATHXR_STUDY_STORE.

    \b
    Examples:
      cathxr study init my_study                 writes my_study/study.toml; change it, and give the command again
      cathxr study allocate P01 --study my_study
      cathxr study board --study my_study
    """
