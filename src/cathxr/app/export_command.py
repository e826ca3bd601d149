"""`cathxr export`: a session in other forms."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.live_options import PATH


@click.group("export")
def export() -> None:
    """Give a session out in another form.

    \b
    Example:
      cathxr export csv recordings/first --out track.csv
    """


@export.command("csv")
@click.argument("session", type=PATH)
@click.option("--out", required=True, type=PATH, help="The table to write.")
@click.option("--points", type=click.IntRange(2, 200), help="Points of the centreline.  [default: as recorded]")
@told_in_a_sentence
def csv(session: Path, out: Path, points: int | None) -> None:
    """Write a session's Tracks as the same table that `cathxr track` writes.

    \b
    Example:
      cathxr export csv recordings/first --out track.csv
    """
    from cathxr.storage.session import SessionReader, export_csv

    reader = SessionReader(session)
    rows = export_csv(reader, out, points=points)
    note = "" if reader.is_whole else " The recording was cut off; this is what was saved."
    click.echo(f"{rows} rows: {out}.{note}")
