"""The `cathxr` command: its sub-commands, and nothing else. The only composition root with `live_parts`."""

import importlib
import logging
import os

import click

from cathxr import __version__

# The fit solves many small systems: threads inside the linear algebra only get in each other's way there.
for _library in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_library, "1")

_COMMANDS = {
    "run": ("run_command", "run", "Start the live system: source, tracker, server, page."),
    "track": ("track_command", "track", "Track a catheter in recorded pictures of both cameras."),
    "record": ("record_command", "record", "Record a session without a page."),
    "replay": ("replay_command", "replay", "Play a session on the page, or check that it replays exactly."),
    "export": ("export_command", "export", "Give a session out in another form."),
    "bench": ("bench_command", "bench", "Measure speed, latency, load and accuracy on this machine."),
}


class _LazyGroup(click.Group):
    """Imports a sub-command's module only when it is asked for: `cathxr --help` answers at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        module, name, _ = _COMMANDS[cmd_name]
        command = getattr(importlib.import_module(f"cathxr.app.{module}"), name)
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary) for name, (_, _, summary) in _COMMANDS.items()])


@click.group(cls=_LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, "-V", "--version", prog_name="cathxr")
@click.option("-v", "--verbose", count=True, help="Say more (-vv: everything) on the console's error output.")
def main(verbose: int) -> None:
    """Track a real catheter with two cameras and an encoder, and show it live inside a heart.

    For training and research; not a medical device. Without hardware everything runs on the digital twin.

    \b
    Examples:
      cathxr run                                  the live system on the twin, in the browser
      cathxr run --source cameras --rig rig.toml --config config.toml --lan
      cathxr track --rig rig.toml --top top.mp4 --front front.mp4 --out track.csv
    """
    level = (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    logging.basicConfig(level=level, format="%(levelname)s %(name)s: %(message)s")


if __name__ == "__main__":
    main()
