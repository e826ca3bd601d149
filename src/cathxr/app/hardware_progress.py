"""Progress of the CAD work, on stderr: a bar on a terminal, a line for each kind of work elsewhere."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


@contextmanager
def shown_progress() -> Iterator[Callable[[str, float | None], None]]:
    """Yield a function that is called with what is being done, and the share that is done (None: not known)."""
    console = Console(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("Starting", total=None)
        told = ""

        def show(what: str, share: float | None) -> None:
            nonlocal told
            bar.update(task, description=what, total=None if share is None else 1.0, completed=share or 0.0)
            kind = what.split(" ")[0]
            if not console.is_terminal and kind != told:
                console.print(f"{what} ...", highlight=False)
                told = kind

        yield show
