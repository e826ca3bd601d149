"""Turns what goes wrong in a command into one sentence on stderr and a non-zero exit."""

import functools
import os
import sys
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import click

from cathxr.core import CathxrError

FAILED = 1
"""Exit code for a failure that a sentence explains."""
FAULT = 70
"""Exit code for a fault of this program (EX_SOFTWARE)."""
INTERRUPTED = 130
"""Exit code after Ctrl-C."""

DEBUG_VARIABLE = "CATHXR_DEBUG"
"""Set to anything, this environment variable lets every error through with its full trace."""

P = ParamSpec("P")
R = TypeVar("R")


def told_in_a_sentence(command: Callable[P, R]) -> Callable[P, R]:
    """Return `command` with its errors told: put it below click's decorators, nearest to the function.

    CathxrError: its sentence, exit 1. Ctrl-C: a sentence, exit 130. Anything else is a fault of this program: a
    sentence that says how to see the trace, exit 70. With CATHXR_DEBUG set nothing is caught.
    """

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        if os.environ.get(DEBUG_VARIABLE):
            return command(*args, **kwargs)
        try:
            return command(*args, **kwargs)
        except CathxrError as error:
            click.echo(f"Error: {error}", err=True)
            code = FAILED
        except KeyboardInterrupt:
            code = _interrupted()
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except BrokenPipeError:
            _silence_stdout()
            code = FAILED
        except Exception as error:
            code = _interrupted() if _comes_from_ctrl_c(error) else _at_fault(error)
        sys.exit(code)

    return run


def _interrupted() -> int:
    click.echo("Interrupted: stopped, and nothing half-written is left.", err=True)
    return INTERRUPTED


def _comes_from_ctrl_c(error: Exception) -> bool:
    """Return whether it is Ctrl-C that arrived while compiled code returned: Python then wraps it in a SystemError."""
    return isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt)


def _at_fault(error: Exception) -> int:
    click.echo(
        f"Error: cathxr met a fault of its own ({type(error).__name__}: {error}); run the command again with "
        f"{DEBUG_VARIABLE}=1 set to see where, and report that.",
        err=True,
    )
    return FAULT


def _silence_stdout() -> None:
    """Point stdout nowhere: whoever read it has gone, and flushing it at exit would complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
