"""`cathxr study allocate`: draws a participant's order of conditions, or checks all draws."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.study_folder import checked_code, now, open_study, study_options
from cathxr.core import ConfigError, DataError
from cathxr.study.allocation import draw_faults, drawn_sequence
from cathxr.study.design import sequence_text


@click.command("allocate")
@click.argument("code", required=False)
@study_options
@click.option("--group", default="", help="The participant's group, where the design has groups.")
@click.option("--check", is_flag=True, help="Compare all draws with the seed instead.")
@click.option("--show-seed", is_flag=True, help="With --check: show the seed, after the last draw; the log keeps that.")
@told_in_a_sentence
def allocate(code: str | None, folder: Path, store: str | None, group: str, check: bool, show_seed: bool) -> None:
    """Draw the order of conditions of participant CODE, and enrol that code.

    Nobody can see a draw before it is made; one that was made stays. CODE is a code such as P01, never a name or date.

    \b
    Examples:
      cathxr study allocate P01
      cathxr study allocate N-07 --group novice
      cathxr study allocate --check
    """
    if (code is None) != check or (show_seed and not check):
        raise ConfigError("Give a participant's code, or --check (and --show-seed with that).")
    with open_study(folder, store) as study:
        seed = study.store.seed()
        if code is None:
            draws = study.store.draws()
            faults = draw_faults(study.design, seed, draws)
            if faults:
                raise DataError(" ".join(faults))
            click.echo(f"All {len(draws)} draws are those that the seed gives.")
            if show_seed:
                click.echo(f"Seed {study.store.show_seed(at=now())}: whoever knows it can foretell every further draw.")
            return
        groups = study.design.groups
        if group not in (groups or ("",)):
            told = f"one of {', '.join(groups)}" if groups else "none, as the design has no groups"
            raise ConfigError(f"--group: expected {told}, got {group!r}.")
        draw = study.store.draw(
            checked_code(code),
            lambda number: sequence_text(drawn_sequence(study.design, seed, group, number)),
            group=group,
            at=now(),
        )
        names = " then ".join(study.design.condition(key).name for key in draw.sequence.split(">"))
        click.echo(f"{draw.participant}: {names} (draw {draw.number}{f' of {group}' if group else ''}, {draw.drawn}).")
