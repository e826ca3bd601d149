"""Serves a calibration with its page until a person ends it: what all live calibrations of the command line share."""

import sys
import threading
from collections.abc import Callable, Mapping
from typing import Any

import click

from cathxr.app.page_options import PageChoice
from cathxr.app.run_command import leave, open_browser, stop_signal
from cathxr.core import CalibrationError, CathxrError, Clock, Image, Rig, Source
from cathxr.runtime.calibration_live import LiveCalibration
from cathxr.runtime.calibration_running import RunningCalibration
from cathxr.runtime.calibration_task import Ending, Task
from cathxr.wire.console import access_text
from cathxr.wire.hub import Hub
from cathxr.wire.messages import Command
from cathxr.wire.scene import scene_description
from cathxr.wire.server import Lan, LiveServer

PAGE = "calibrate.html"
_POLL_S = 0.25
_LAST_WORDS_S = 1.0
"""How long the server stays after the end, so that every page learns of it."""


def serve_calibration(
    make_task: Callable[[Hub], Task[Any]],
    sources: Mapping[str, Source[Image]],
    *,
    rig: Rig,
    kind: str,
    title: str,
    clock: Clock,
    page: PageChoice,
    stills: tuple[Image, ...] = (),
) -> Ending:
    """Run a calibration with its page until a person accepts it, and return how it ended.

    make_task: given the hub, which keeps the result's pictures. kind: where the pictures come from, for the page.
    title: the first line on the console.

    Raises:
        CalibrationError: a person cancelled it; CathxrError: it could not start, or the server died.
        KeyboardInterrupt: Ctrl-C or SIGTERM; nothing was written.
    """

    def running(outlet: Hub) -> LiveCalibration:
        return LiveCalibration(make_task(outlet), sources, outlet=outlet, clock=clock, stills=stills)

    return serve_running(running, rig=rig, kind=kind, title=title, clock=clock, page=page, cameras=tuple(sources))


def serve_running(
    make_running: Callable[[Hub], RunningCalibration],
    *,
    rig: Rig,
    kind: str,
    title: str,
    clock: Clock,
    page: PageChoice,
    cameras: tuple[str, ...] = (),
) -> Ending:
    """Run whatever `make_running` makes with its page, as `serve_calibration`. cameras: whose pictures are served.

    Raises: as `serve_calibration`.
    """
    hub = Hub()
    live = make_running(hub)

    def commands(command: Command) -> Mapping[str, Any]:
        return live.handle(command.name, command.args)

    server = LiveServer(
        hub, scene_description(rig, kind), commands=commands, clock=clock, port=page.port,
        lan=Lan() if page.lan else None, cameras=cameras,
    )  # fmt: skip
    ending, ended = None, True
    with stop_signal() as stopping:
        server.start()
        try:
            live.__enter__()
            click.echo(f"{title} Ctrl-C ends it without writing anything.")
            click.echo(access_text(server, asked_port=page.port))
            click.echo(f"Open {server.url}/{PAGE}")
            sys.stdout.flush()
            open_browser(f"{server.url}/{PAGE}", wanted=page.browser)
            ending = _wait(stopping, server, live)
        finally:
            closing = threading.Thread(target=server.stop, name="stop-server")
            closing.start()
            ended = live.stop()
            closing.join()
    if ending is None:
        # What was accepted in the very moment of Ctrl-C has been written, and is told.
        ending = live.ending
    if not ended:
        _tell_and_leave(ending)
    if ending is None:
        raise KeyboardInterrupt
    if not ending.saved:
        raise CalibrationError(ending.sentence)
    return ending


def compiled(work: Callable[[], object]) -> None:
    """Do once what compiles the fast parts, and say so when that takes a while."""
    said = threading.Timer(1.5, lambda: click.echo("Compiling the fast parts (the first time only) …"))
    said.daemon = True
    said.start()
    try:
        work()
    finally:
        said.cancel()


def _wait(stopping: threading.Event, server: LiveServer, live: RunningCalibration) -> Ending | None:
    """Return how it ended, None when told to stop.

    Raises:
        CathxrError: the server's thread has died.
    """
    while not stopping.is_set():
        if live.wait(_POLL_S):
            stopping.wait(_LAST_WORDS_S)
            return live.ending
        if not server.running:
            raise CathxrError(f"The server has stopped ({server.failure}); start the calibration again.")
    return None


def _tell_and_leave(ending: Ending | None) -> None:
    """End the process although a thread hangs, as inside a camera's driver: Python's own way out would wait for it."""
    if ending is not None and ending.saved:
        click.echo(ending.sentence)
        leave(ended=False)
    sentence = "Interrupted: stopped, and nothing half-written is left." if ending is None else ending.sentence
    click.echo(sentence if ending is None else f"Error: {sentence}", err=True)
    leave(ended=False, code=130 if ending is None else 1)
