"""The tasks that come with the package, for the built-in heart."""

from importlib.resources import files
from pathlib import Path

from cathxr.core import ConfigError
from cathxr.training.task import Task
from cathxr.training.task_file import read_task


def builtin_tasks() -> tuple[Task, ...]:
    """Return the built-in tasks: those of the progression by their step, then the others, by key."""
    tasks = [read_task(path) for path in _folder().glob("*.toml")]
    return tuple(sorted(tasks, key=lambda each: (each.step is None, each.step or 0, each.key)))


def find_task(name: str) -> Task:
    """Return a built-in task by its key, or the task of a file by its path.

    Raises:
        ConfigError: neither is there; DataError, ConfigError: see `read_task`.
    """
    path = Path(name)
    if path.suffix == ".toml":
        return read_task(path)
    keys = sorted(each.stem for each in _folder().glob("*.toml"))
    if name not in keys:
        raise ConfigError(f"There is no task {name!r}; give a task file (.toml) or one of {', '.join(keys)}.")
    return read_task(_folder() / f"{name}.toml")


def _folder() -> Path:
    return Path(str(files("cathxr.training"))) / "builtin"
