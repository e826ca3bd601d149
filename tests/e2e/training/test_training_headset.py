"""Training in an emulated headset: all by the ray, the start by a pinch, what a viewer is told, what it costs."""

from collections.abc import Callable

from ..xr.headset import Headset
from .conftest import Course
from .trainer import survey

HAND = [0.2, 1.2, -0.15]


def press_on(headset: Headset, plate: str, label: str) -> None:
    """Point the right controller at a button of a plate and press."""
    place = headset.until(f"window.__cathxr.training.button({plate!r}, {label!r})")
    headset.aim("controller-right", HAND, place)
    headset.press("right", "trigger")
    headset.frames(6)


def until_phase(headset: Headset, phase: str) -> None:
    headset.until(f"window.__cathxr.training.phase === '{phase}'")


def test_a_session_is_done_by_ray(course: Course, put_on: Callable[[Course], Headset]) -> None:
    headset, trainer = put_on(course), course.trainer
    headset.press("right", "b-button")
    headset.tab("Training")
    headset.row("Who", 3)
    for key in "P1X":
        press_on(headset, "keypad", key)
    press_on(headset, "keypad", "⌫")
    press_on(headset, "keypad", "2")
    press_on(headset, "keypad", "OK")
    headset.until("window.__cathxr.training.choice.participant === 'P12'")
    headset.row("Task", 2)
    headset.row("View", 1)
    headset.row("Trial", 0)
    until_phase(headset, "countdown")
    assert trainer.asked == [
        ("training_prepare", {"participant": "P12", "task": "insertion", "view": "2d"}),
        ("training_begin", {}),
    ]
    headset.until("/^([123]|Go) /.test(window.__cathxr.training.plate)")
    trainer.show("running", reached=1, active_s=12.0, progress=0.5)
    told = headset.until("window.__cathxr.training.plate.includes('Coronary') && window.__cathxr.training.plate")
    assert told.startswith("Coronary sinus | 2 of 4 | ")
    assert "1:48" in told
    titles = {each["title"] for each in headset.ask("window.__cathxr.xr.plates()")}
    assert {"trial", "menu"} <= titles
    headset.row("Trial", 0)
    until_phase(headset, "paused")
    headset.until("window.__cathxr.training.plate.includes('Paused')")
    headset.row("Trial", 0)
    until_phase(headset, "running")
    headset.row("Trial", 1)
    until_phase(headset, "ended")
    headset.press("right", "b-button")
    press_on(headset, "result", "Repeat")
    until_phase(headset, "ready")
    assert not headset.ask("window.__cathxr.training.button('result', 'Repeat')")
    trainer.show("ended", reached=4, outcome="completed")
    press_on(headset, "result", "Show the run")
    headset.until("window.__cathxr.training.replayS > 0.2")
    assert any("/run/" in each for each in headset.ask("window.__cathxr.xr.drawables()"))
    headset.press("right", "b-button")
    headset.row("Run", 1)
    headset.until("window.__cathxr.training.replayS === null")
    headset.press("right", "b-button")
    press_on(headset, "result", "Done")
    until_phase(headset, "idle")
    names = [name for name, _ in trainer.asked[2:]]
    assert names == [
        "training_pause",
        "training_resume",
        "training_abort",
        "training_repeat",
        "training_close",
    ]
    assert headset.complaints == []


def test_bare_hands_start_by_a_pinch(course: Course, put_on: Callable[[Course], Headset]) -> None:
    headset, trainer = put_on(course), course.trainer
    trainer.offer(study="Three views")
    headset.press("right", "b-button")
    headset.tab("Training")
    headset.hands("hand")
    headset.aim("hand-right", HAND, headset.until("window.__cathxr.xr.row('Trial', 0)"))
    headset.pinch("right", down=True)
    headset.pinch("right", down=False)
    until_phase(headset, "countdown")
    assert trainer.asked[0] == ("training_prepare", {"participant": "P01"})


def test_a_survey_is_answered_item_by_item(course: Course, put_on: Callable[[Course], Headset]) -> None:
    headset, trainer = put_on(course), course.trainer
    trainer.survey = survey()
    trainer.publish()
    press_on(headset, "survey", "Begin")
    assert headset.ask("window.__cathxr.training.asked").startswith("1 of 3 I think")
    press_on(headset, "survey", "4")
    headset.ask("window.__cathxr.xr.set({ ice: false }) ?? null")  # the plates of pictures are laid out anew
    press_on(headset, "survey", "Back")
    press_on(headset, "survey", "2")
    press_on(headset, "survey", "65")
    press_on(headset, "survey", "slight")
    assert "asked on the page" in headset.ask("window.__cathxr.training.asked")
    given = [args["answers"] for _, args in trainer.asked]
    assert given == [{"q1": 4}, {"q1": 2}, {"q2": 65}, {"q3": 1}]
    press_on(headset, "survey", "Hand in")
    headset.until("window.__cathxr.training.state.survey === null")
    assert trainer.asked[-1][1]["done"] is True
    assert headset.ask("window.__cathxr.training.asked") == ""


def test_a_viewer_is_told_how_to_pair(open_course: Callable[..., Course], put_on: Callable[[Course], Headset]) -> None:
    course = open_course(paired=True)
    headset = put_on(course)
    course.trainer.show("running", reached=1)
    headset.until("window.__cathxr.training.plate.includes('Coronary')")
    headset.press("right", "b-button")
    headset.tab("Training")
    assert headset.ask("window.__cathxr.xr.row('Trial', 0)") is None
    rows = headset.ask("window.__cathxr.xr.rows()")
    assert any("pairing code" in each for each in rows)


def test_a_trial_keeps_within_the_budget_of_draw_calls(course: Course, put_on: Callable[[Course], Headset]) -> None:
    headset, trainer = put_on(course), course.trainer
    headset.set(ice=True, landmarks=True, targets=True)
    bare = headset.report()["calls"]
    trainer.show("running", reached=3, progress=0.5)
    headset.press("right", "b-button")
    headset.tab("Training")
    headset.frames(12)
    calls = headset.report()["calls"]
    print(f"draw calls of both eyes without a heart: {bare} before, {calls} with a trial and the menu")
    assert calls <= 60
