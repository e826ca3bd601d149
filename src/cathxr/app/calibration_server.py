"""Serves a page until a person ends it: what all live calibrations and other guided commands share."""

import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, Self

import click
from fastapi import APIRouter

from cathxr.app.page_options import PageChoice
from cathxr.app.run_command import leave, open_browser, stop_signal
from cathxr.core import CalibrationError, CathxrError, Clock, Image, Rig, Source
from cathxr.runtime.calibration_live import LiveCalibration
from cathxr.runtime.calibration_running import RunningCalibration
from cathxr.runtime.calibration_task import Ending, Task
from cathxr.wire.console import access_text
from cathxr.wire.hub import Hub
from cathxr.wire.messages import Command, SceneDescription
from cathxr.wire.scene import scene_description
from cathxr.wire.server import Lan, LiveServer

PAGE = "calibrate.html"
_POLL_S = 0.25
_LAST_WORDS_S = 1.0
"""How long the server stays after the end, so that every page learns of it."""


class RunningPage(Protocol):
    """What runs behind a page. Entering starts it."""

    def __enter__(self) -> Self: ...
    @property
    def ending(self) -> Ending | None: ...
    def wait(self, timeout_s: float) -> bool: ...
    def stop(self) -> bool: ...
    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]: ...


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
    ending = serve_page(
        make_running, scene=scene_description(rig, kind), file=PAGE, cameras=cameras, clock=clock, page=page,
        title=f"{title} Ctrl-C ends it without writing anything.",
    )  # fmt: skip
    if not ending.saved:
        raise CalibrationError(ending.sentence)
    return ending


def serve_page(
    make_running: Callable[[Hub], RunningPage],
    *,
    scene: SceneDescription,
    file: str,
    title: str,
    clock: Clock,
    page: PageChoice,
    cameras: tuple[str, ...] = (),
    routers: Sequence[APIRouter] = (),
) -> Ending:
    """Run whatever `make_running` makes with the page `file` until a person ends it, and return how it ended.

    title: the first line on the console. cameras: whose pictures are served; routers: what else is.

    Raises:
        CathxrError: it could not start, or the server died.
        KeyboardInterrupt: Ctrl-C or SIGTERM.
    """
    hub = Hub()
    live = make_running(hub)

    def commands(command: Command) -> Mapping[str, Any]:
        return live.handle(command.name, command.args)

    server = LiveServer(
        hub, scene, commands=commands, clock=clock, port=page.port,
        lan=Lan() if page.lan else None, cameras=cameras, routers=routers,
    )  # fmt: skip
    ending, ended = None, True
    with stop_signal() as stopping:
        server.start()
        try:
            live.__enter__()
            click.echo(title)
            click.echo(access_text(server, asked_port=page.port))
            click.echo(f"Open {server.url}/{file}")
            sys.stdout.flush()
            open_browser(f"{server.url}/{file}", wanted=page.browser)
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


def _wait(stopping: threading.Event, server: LiveServer, live: RunningPage) -> Ending | None:
    """Return how it ended, None when told to stop.

    Raises:
        CathxrError: the server's thread has died.
    """
    while not stopping.is_set():
        if live.wait(_POLL_S):
            stopping.wait(_LAST_WORDS_S)
            return live.ending
        if not server.running:
            raise CathxrError(f"The server has stopped ({server.failure}); start the command again.")
    return None


def _tell_and_leave(ending: Ending | None) -> None:
    """End the process although a thread hangs, as inside a camera's driver: Python's own way out would wait for it."""
    if ending is not None and ending.saved:
        click.echo(ending.sentence)
        leave(ended=False)
    sentence = "Interrupted: stopped, and nothing half-written is left." if ending is None else ending.sentence
    click.echo(sentence if ending is None else f"Error: {sentence}", err=True)
    leave(ended=False, code=130 if ending is None else 1)
