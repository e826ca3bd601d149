"""`cathxr study mark`: trials that must not count, and trials that were cut off."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.study_folder import now, open_study, study_options
from cathxr.core import ConfigError


@click.command("mark")
@click.argument("trial")
@study_options
@click.option("--invalid", metavar="REASON", help="The trial must not count, and why.")
@click.option("--valid", is_flag=True, help="Take such a mark back.")
@click.option("--interrupted", is_flag=True, help="The trial was cut off and will not be gone on with.")
@told_in_a_sentence
def mark(trial: str, folder: Path, store: str | None, invalid: str | None, valid: bool, interrupted: bool) -> None:
    """Mark TRIAL (its id) as invalid; nothing of it is deleted, and the log keeps what was said.

    \b
    Examples:
      cathxr study mark 5f0c2a --invalid "the catheter slipped out of the inlet"
      cathxr study mark 5f0c2a --interrupted
    """
    if (invalid is not None) + valid + interrupted != 1 or invalid == "":
        raise ConfigError("Give one of --invalid REASON, --valid, --interrupted.")
    with open_study(folder, store) as study:
        if interrupted:
            study.store.interrupt(trial, active_s=0.0, at=now())
            click.echo(f"Trial {trial} is kept as interrupted; its recording holds what was done.")
            return
        study.store.mark(trial, invalid or "", at=now())
        click.echo(f"Trial {trial} is marked as {'valid again' if valid else 'invalid: ' + (invalid or '')}.")
