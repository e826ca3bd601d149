"""The `cathxr` command: its sub-commands, and nothing else. The only composition root with `live_parts`."""

import logging
import os

import click

from cathxr import __version__
from cathxr.app.lazy_group import LazyGroup

# The fit solves many small systems: threads inside the linear algebra only get in each other's way there.
for _library in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_library, "1")

_COMMANDS = {
    "run": ("run_command", "run", "Start the live system: source, tracker, server, page."),
    "track": ("track_command", "track", "Track a catheter in recorded pictures of both cameras."),
    "record": ("record_command", "record", "Record a session without a page."),
    "replay": ("replay_command", "replay", "Play a session on the page, or check that it replays exactly."),
    "export": ("export_command", "export", "Give a session out in another form."),
    "calibrate": ("calibrate_command", "calibrate", "Measure the rig: lenses, poses, timing; check what was measured."),
    "heart": ("heart_command", "heart", "Build a heart from a CT: look, build, correct."),
    "register": ("register_command", "register", "Find where the box lies in the heart, and how well."),
    "study": ("study_command", "study", "Run a study: design, allocation, surveys, board, report."),
    "tasks": ("tasks_command", "tasks", "List, show and check training tasks."),
    "score": ("score_command", "score", "Measure a recorded trial, or a task on any recording."),
    "doctor": ("doctor_command", "doctor", "Check what is connected and set up: box, encoder."),
    "hardware": ("hardware_command", "hardware", "Make the rig: what to print, cut and buy, from parameters."),
    "bench": ("bench_command", "bench", "Measure speed, latency, load and accuracy on this machine."),
}


@click.group(
    cls=LazyGroup,
    commands_of=_COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
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
