"""Says what takes long, while it does."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import click

_QUIET_S, _WORTH_A_WORD_S = 1.5, 10.0


@contextmanager
def said_when_compiling() -> Iterator[None]:
    """Say, when what is inside takes long, that the fast parts are being compiled, which happens once."""
    said = threading.Timer(
        _QUIET_S, lambda: click.echo("Compiling the fast parts (up to a minute, the first time only) …", err=True)
    )
    said.daemon = True
    said.start()
    begun_s = time.monotonic()
    try:
        yield
    finally:
        said.cancel()
    if said.finished.is_set() and time.monotonic() - begun_s > _WORTH_A_WORD_S:
        click.echo(f"Compiled in {time.monotonic() - begun_s:.0f} s; the next start takes a second or two.", err=True)
