"""`cathxr study delete`: a participant's rows, and the recordings where asked."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.app.study_folder import checked_code, now, open_study, study_options
from cathxr.core import ConfigError


@click.command("delete")
@click.argument("code")
@study_options
@click.option("--recordings", is_flag=True, help="Delete the recordings of the trials too.")
@click.option("--recordings-in", type=PATH, help="The folder of all recordings.  [default: recordings in the folder]")
@click.option("--yes", is_flag=True, help="Do not ask.")
@told_in_a_sentence
def delete(code: str, folder: Path, store: str | None, recordings: bool, recordings_in: Path | None, yes: bool) -> None:
    """Delete participant CODE: enrolment, trials, answers, and what the log says about them. This cannot be undone.

    The draw keeps its place without the code, so that the allocation stays as it was. Backups and exports made
    before are not reached. A recording that holds other participants' trials too stays, and is named.

    \b
    Examples:
      cathxr study delete P07
      cathxr study delete P07 --recordings --yes
    """
    if recordings_in is not None and not recordings:
        raise ConfigError("--recordings-in goes with --recordings.")
    with open_study(folder, store) as study:
        from cathxr.storage.study_store.recordings import delete_folders, session_folders

        chosen = checked_code(code)
        going = study.store.deletion_of(chosen)
        root = recordings_in or folder / "recordings"
        there, missing = session_folders(root, going.sessions) if recordings else ((), ())
        click.echo(f"{chosen}: {going.trials} trials and {going.answers} answers" + (f", and {len(there)} recordings." if recordings else "."))  # fmt: skip  # noqa: E501
        if not yes:
            click.confirm("Delete them for good?", abort=True)
        # folders first: the rows say which they are, should this be cut off
        delete_folders(there)
        gone = study.store.delete(chosen, at=now())
        click.echo(f"Deleted {chosen}: {gone.trials} trials, {gone.answers} answers, {len(there)} recordings.")
        for name in missing:
            click.echo(f"The recording {name} was not there any more.")
        for name in gone.shared if recordings else ():
            click.echo(f"The recording {name} stays: it holds other participants' trials too.")
        if not recordings and gone.sessions:
            click.echo(f"Recordings that stay: {', '.join(gone.sessions)}.")
