"""`cathxr run`: the live system with its page."""

import gc
import os
import signal
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import click

from cathxr.app.config import Config, TrackingConfig
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.live_options import PATH, chosen_config, live_options
from cathxr.app.patience import said_when_compiling
from cathxr.core import CathxrError, Event, Rig, Track

_POLL_S = 0.25


@click.command("run")
@live_options
@click.option("--port", type=click.IntRange(0, 65535), help="Port on this machine; 0: any free one.  [default: 8765]")
@click.option("--lan", is_flag=True, help="Also serve the network (https, with a pairing code): for a headset.")
@click.option("--recordings", type=PATH, help="Folder for recordings.  [default: ./recordings]")
@click.option("--video", is_flag=True, help="Recordings hold the pictures too (lossless, about 80 MB a second).")
@click.option("--speed", type=click.FloatRange(0.01, 100.0), help="Pace of a replay.  [default: 1]")
@click.option("--no-browser", is_flag=True, help="Do not open a browser.")
@click.option("--study", type=PATH, help="The folder of a study: training goes by its design and into its store.")
@click.option("--store", help="Where trials are stored: a file or postgresql://…  [default: the study's, or your own]")
@click.option("--publish-truth", is_flag=True, help="Also send the twin's exact tip as events of kind 'truth'.")
@told_in_a_sentence
def run(
    source: str,
    rig: Path | None,
    config: Path | None,
    method: str | None,
    points: int | None,
    scene: str | None,
    seed: int | None,
    port: int | None,
    lan: bool,
    recordings: Path | None,
    video: bool,
    speed: float | None,
    no_browser: bool,
    study: Path | None,
    store: str | None,
    publish_truth: bool,
) -> None:
    """Start the live system: source, tracker, server, page.

    Without options it runs on the digital twin and opens the page. Ctrl-C ends it.

    \b
    Examples:
      cathxr run
      cathxr run --scene debris --seed 3
      cathxr run --source cameras --rig rig.toml --config config.toml --lan
      cathxr run --source recordings/2026-01-31_10-00-00
      cathxr run --study views
    """
    chosen = chosen_config(config, rig=rig, method=method, points=points, scene=scene, seed=seed)
    chosen = _with_run_options(
        chosen, port=port, lan=lan, recordings=recordings, video=video, speed=speed, no_browser=no_browser
    )
    serve(source, chosen, publish_truth=publish_truth, study=study, store=store)


def serve(
    source: str, config: Config, *, publish_truth: bool = False, study: Path | None = None, store: str | None = None
) -> None:
    """Run until Ctrl-C (or SIGTERM), or until a source that does not begin again has ended.

    study: a study's folder, for training; store: where its trials go, None: the usual place.

    Raises:
        CathxrError: it cannot start.
    """
    # Imported here: loading the methods takes a second that --help and a wrong path need not wait for.
    from cathxr.app.controls import ControlsPublisher
    from cathxr.app.diag_folder import DiagFolder
    from cathxr.app.live_parts import live_parts
    from cathxr.app.setup_wiring import setup_beside
    from cathxr.app.training_parts import training_parts
    from cathxr.app.training_wiring import training_beside
    from cathxr.app.view_commands import view_commands
    from cathxr.devices.clock import MonotonicClock
    from cathxr.runtime.live import LiveSystem
    from cathxr.wire.console import access_text
    from cathxr.wire.diag_pages import make_diag_router
    from cathxr.wire.hub import Hub
    from cathxr.wire.messages import Command
    from cathxr.wire.server import Lan, LiveServer
    from cathxr.wire.training_pages import make_runs_router

    clock = MonotonicClock()
    parts = live_parts(source, config, clock=clock)
    trained = training_parts(parts, config, study=study, store=store)
    prepare(config.tracking, parts.rig)
    hub = Hub()
    options = replace(parts.options, commands={**parts.options.commands, **view_commands(hub)})
    system = LiveSystem(parts.source, clock=clock, options=options)
    system.connect("page", hub)
    if parts.optical is not None:
        parts.optical.readings.add("recorder", system.take_reading)
    if parts.world is not None:
        system.moments.add("controls", ControlsPublisher(parts.world, hub.publish_event))
    if publish_truth and parts.world is not None:
        system.truths.add("page", lambda truth: hub.publish_event(_truth_event(truth)))

    training = training_beside(system, trained, clock=clock, outlet=hub)
    setup = setup_beside(system, parts, clock=clock, hub=hub, lan=config.server.lan)

    def commands(command: Command) -> Mapping[str, Any]:
        return system.handle(command.name, command.args)

    chosen = config.server
    server = LiveServer(
        hub, parts.scene, commands=commands, clock=clock, files=parts.files, port=chosen.port,
        lan=Lan(chosen.lan_port, tuple(chosen.lan_names)) if chosen.lan else None, force_pairing=chosen.force_pairing,
        routers=(
            make_diag_router(DiagFolder(Path(config.recording.folder)).save, clock=clock),
            make_runs_router(training.run),
        ),
    )  # fmt: skip
    with stop_signal() as stopping:
        server.start()
        try:
            training.__enter__()
            setup.__enter__()
            system.__enter__()
            click.echo(f"cathxr runs on {_described(source, config)}. Ctrl-C ends it.")
            click.echo(access_text(server, asked_port=chosen.port))
            sys.stdout.flush()
            open_browser(server.url, wanted=chosen.browser)
            _wait_for_the_end(stopping, server, system)
        finally:
            closing = threading.Thread(target=server.stop, name="stop-server")
            closing.start()
            ended = system.stop()
            ended = training.close() and ended
            setup.__exit__()
            closing.join()
    click.echo("Stopped.")
    leave(ended=ended)


def leave(*, ended: bool, code: int = 0) -> None:
    """End the process at once where a thread has not ended in time, for example inside a camera's driver.

    code: the exit code. Python's own way out stops such a thread within native code, which then aborts the whole
    process.
    """
    if not ended:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _wait_for_the_end(stopping: threading.Event, server: Any, system: Any) -> None:
    """Return when told to stop or when the source has ended.

    Raises:
        CathxrError: the server's thread has died.
    """
    while not stopping.wait(_POLL_S):
        if not server.running:
            raise CathxrError(f"The server has stopped ({server.failure}); start cathxr again.")
        if system.ended:
            click.echo("The source has ended.")
            return


def _with_run_options(
    config: Config,
    *,
    port: int | None,
    lan: bool,
    recordings: Path | None,
    video: bool,
    speed: float | None,
    no_browser: bool,
) -> Config:
    server: dict[str, Any] = {} if port is None else {"port": port}
    server |= {"lan": True} if lan else {}
    server |= {"browser": False} if no_browser else {}
    recording: dict[str, Any] = {} if recordings is None else {"folder": str(recordings)}
    recording |= {"videos": True} if video else {}
    replay = {} if speed is None else {"speed": speed}
    return config.model_copy(
        update={
            "server": config.server.model_copy(update=server),
            "recording": config.recording.model_copy(update=recording),
            "replay": config.replay.model_copy(update=replay),
        }
    )


def prepare(tracking: TrackingConfig, rig: Rig) -> None:
    """Compile what tracking in a box needs and is not compiled yet, and say so when that takes a while."""
    import cv2

    from cathxr.app.warm_up import scenes_for, warm_up

    # Each thread here is busy with its own camera: OpenCV's own threads would only take the cores from the others.
    cv2.setNumThreads(1)
    with said_when_compiling():
        backgrounds = tracking.background_top is not None or tracking.background_front is not None
        for scene_name in scenes_for(rig, backgrounds=backgrounds):
            warm_up(method=tracking.method, scene_name=scene_name)
    # What is loaded now stays: the collector need not walk through it again and again while Tracks wait.
    gc.collect()
    gc.freeze()


def _truth_event(truth: Track) -> Event:
    """Return the twin's exact tip as an event, for tests and demonstrations."""
    tip = None if truth.tip_box is None else [float(each) for each in truth.tip_box]
    return Event(truth.t_ns, "truth", {"seq": truth.seq, "tip": tip})


def _described(source: str, config: Config) -> str:
    if source == "twin":
        return f"the digital twin (scene {config.twin.scene}, seed {config.twin.seed}; no hardware)"
    return "the cameras" if source == "cameras" else f"the recording {source}"


def open_browser(url: str, *, wanted: bool) -> None:
    """Open a page where there is a screen to show it on."""
    has_screen = sys.platform in ("win32", "darwin") or any(
        os.environ.get(each) for each in ("DISPLAY", "WAYLAND_DISPLAY")
    )
    if wanted and has_screen and not os.environ.get("CI"):
        threading.Thread(target=webbrowser.open, args=(url,), name="browser", daemon=True).start()


class stop_signal:  # noqa: N801  (used like a function)
    """Gives an Event that Ctrl-C and SIGTERM set, until the end. A second Ctrl-C ends at once."""

    def __enter__(self) -> threading.Event:
        self._stopping = threading.Event()
        self._old: dict[int, Callable[[int, FrameType | None], Any] | int | None] = {}
        for number in (signal.SIGINT, signal.SIGTERM):
            self._old[number] = signal.signal(number, self._stop)
        return self._stopping

    def _stop(self, number: int, frame: FrameType | None) -> None:
        if self._stopping.is_set() and number == signal.SIGINT:
            raise KeyboardInterrupt
        self._stopping.set()

    def __exit__(self, *_: object) -> None:
        for number, handler in self._old.items():
            signal.signal(number, handler)
