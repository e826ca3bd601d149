"""The jig procedure on the console: what to do, the counts as they come, and a key for each decision."""

import math
import threading
from collections.abc import Callable

import click
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.padding import Padding
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from cathxr.app.calibrate_roll_keys import END, ENTER, Keys
from cathxr.app.run_command import stop_signal
from cathxr.core import CalibrationError, CathxrError, Event, Health, Image
from cathxr.runtime.calibration_readings import ReadingsCalibration
from cathxr.runtime.calibration_running import Outlet
from cathxr.runtime.calibration_task import Ending
from cathxr.wire.calibration_messages import CalibrationState, Figure, RollCalibrationState

_POLL_S = 0.1
_BAR = 41
_TITLES = {"zero": "into the jig", "backlash": "rock", "turn": "one turn", "review": "save"}
_STYLES = {"plain": "default", "good": "green", "warn": "yellow", "bad": "red"}
_MARKS = {"plain": "", "good": " ✓", "warn": " !", "bad": " ✕"}


class _Newest:
    """An Outlet for the console: keeps the newest state."""

    def __init__(self) -> None:
        self.state: RollCalibrationState | None = None

    def publish_calibration(self, state: CalibrationState) -> None:
        assert isinstance(state, RollCalibrationState)
        self.state = state

    def publish_picture(self, image: Image, *, seq: int) -> None: ...

    def publish_event(self, event: Event) -> None: ...

    def publish_health(self, sources: tuple[Health, ...], *, t_ns: int, skew_ns: int | None = None) -> None: ...


def run_on_console(
    make_running: Callable[[Outlet], ReadingsCalibration], *, title: str, confirms_itself: bool = False
) -> Ending:
    """Run it on the console until a person has saved it, and return how it ended.

    confirms_itself: every step is confirmed when it can be, and the result saved: with a simulated hand.

    Raises:
        CalibrationError: a person cancelled it, or the input ended; KeyboardInterrupt: Ctrl-C; nothing was written.
    """
    outlet, console = _Newest(), Console()
    running = make_running(outlet)
    person = _Person(running, confirms_itself=confirms_itself)
    click.echo(f"{title} Ctrl-C ends it without writing anything.")
    with stop_signal() as stopping, Keys() as keys, running:
        if console.is_terminal:
            with Live(console=console, refresh_per_second=10, transient=True) as live:
                _until_the_end(
                    running, outlet, person, keys, stopping, lambda state: live.update(_screen(state, person))
                )
        else:
            told = _Told()
            _until_the_end(running, outlet, person, keys, stopping, told.tell)
    ending = running.ending
    if outlet.state is not None and ending is not None and ending.saved:
        console.print(_figures(outlet.state.figures))
    if ending is None:
        raise KeyboardInterrupt
    if not ending.saved:
        raise CalibrationError(ending.sentence)
    return ending


class _Person:
    """Turns keys into commands; remembers why the last one was refused."""

    def __init__(self, running: ReadingsCalibration, *, confirms_itself: bool) -> None:
        self.refused = ""
        self.confirms_itself = confirms_itself
        self._running = running

    def press(self, key: str, state: RollCalibrationState) -> None:
        """Do what a key stands for.

        Raises:
            CalibrationError: the input has ended.
        """
        if not key and self.confirms_itself and (state.can_confirm or (state.can_save and state.is_still)):
            key = ENTER
        if key == END and not self.confirms_itself:
            raise CalibrationError("The input ended before roll was measured: nothing was written.")
        command = {"r": "calibration_repeat", "q": "calibration_cancel", "b": "calibration_repeat"}.get(key)
        if key == ENTER:
            command = {
                "collecting": "calibration_confirm",
                "done": "calibration_accept",
                "failed": "calibration_repeat",
            }.get(state.stage)
        if command is None:
            # What was refused once can be done now: the reason is of the past.
            self.refused = "" if state.can_confirm or state.can_save else self.refused
            return
        self.refused = ""
        try:
            self._running.handle(command, {})
        except CathxrError as error:
            self.refused = str(error)


class _Told:
    """Tells each new piece of advice once, where there is no terminal to draw on."""

    def __init__(self) -> None:
        self._last = ""

    def tell(self, state: RollCalibrationState) -> None:
        if state.advice != self._last:
            self._last = state.advice
            click.echo(f"[{_number(state)}] {state.advice}")


def _until_the_end(
    running: ReadingsCalibration,
    outlet: _Newest,
    person: _Person,
    keys: Keys,
    stopping: threading.Event,
    show: Callable[[RollCalibrationState], object],
) -> None:
    while not running.wait(0.0):
        state = outlet.state
        assert state is not None, "a running calibration has a state"
        show(state)
        if state.stage == "solving":  # what is being written is written, whatever is pressed
            running.wait(_POLL_S)
            continue
        key = keys.poll(_POLL_S)
        if stopping.is_set():
            return
        person.press(key, state)
        if person.refused and not Console().is_terminal:
            click.echo(person.refused)
            person.refused = ""


# --- what is drawn ---------------------------------------------------------------------------------------------------


def _screen(state: RollCalibrationState, person: _Person) -> RenderableType:
    body: list[RenderableType] = [Text(state.advice, style=_advice_style(state)), Text()]
    body.append(_live_line(state))
    if state.rocking is not None:
        body.append(_rocking_line(state))
    elif state.turned_rad is not None and state.step == "turn":
        body.append(Text(f"  {_bar(state.turned_rad / (2.0 * math.pi))}  one turn"))
    if state.figures:
        body += [Text(), _figures(state.figures)]
    if person.refused:
        body += [Text(), Text(person.refused, style="yellow")]
    elif state.why:
        body += [Text(), Text(state.why, style="dim")]
    body += [Text(), Text(_keys_line(state), style="bold")]
    return Panel(Padding(Group(*body), (0, 1)), title=f"{_number(state)} {_TITLES[state.step]}", title_align="left")


def _live_line(state: RollCalibrationState) -> Text:
    if state.count is None or state.turned_rad is None:
        return Text("  waiting for the encoder", style="dim")
    rate = "" if state.rate_hz is None else f"   {state.rate_hz:.0f} Hz"
    still = "still" if state.is_still else "moving"
    return Text(f"  count {state.count:>8d}   turned {math.degrees(state.turned_rad):+9.2f}°{rate}   {still}")


def _rocking_line(state: RollCalibrationState) -> Text:
    rocking = state.rocking
    assert rocking is not None
    low, high = rocking.low_rad, rocking.high_rad
    width = high - low
    at = 0.5 if width <= 0.0 or state.turned_rad is None else (state.turned_rad - low) / width
    place = round(min(1.0, max(0.0, at)) * (_BAR - 1))
    track = "".join("█" if each == place else "─" for each in range(_BAR))
    stops = min(rocking.stops, rocking.wanted)
    style = "red" if width > rocking.limit_rad else "green" if stops == rocking.wanted else "default"
    return Text(f"  ├{track}┤  {math.degrees(width):.2f}°   stops {stops} of {rocking.wanted} each", style=style)


def _bar(share: float) -> str:
    filled = round(min(1.0, abs(share)) * _BAR)
    return "█" * filled + "·" * (_BAR - filled)


def _figures(figures: list[Figure]) -> Table:
    table = Table(box=None, show_header=False, padding=(0, 2))
    for each in figures:
        table.add_row(each.label, Text(f"{each.value}{_MARKS[each.level]}", style=_STYLES[each.level]))
    return table


def _advice_style(state: RollCalibrationState) -> str:
    return {"failed": "bold red", "done": "bold green"}.get(state.stage, "bold")


def _number(state: RollCalibrationState) -> str:
    return f"{state.steps.index(state.step) + 1}/{len(state.steps)}"


def _keys_line(state: RollCalibrationState) -> str:
    if state.stage == "solving":
        return ""
    if state.stage == "done":
        what = f"write {state.writes} and save" if state.writes else "save"
        return f"Enter: {what}   b: begin again   q: cancel"
    if state.stage == "failed":
        return "Enter: begin again   q: cancel"
    return "Enter: confirm   r: repeat this step   q: cancel"
