"""Training on the twin through the real server, without a browser: two operators, the numbers, a killed process."""

import json
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from typing import Any

import pytest

from cathxr.core import Status
from cathxr.runtime.training_recordings import recorded_trial
from cathxr.storage.study_store import StudyStore

from ...training_support.surveys import WITH_WORDS
from .conftest import Place
from .kit import Operator

Operators = Callable[[int], Operator]


def begin(operator: Operator, **prepared: Any) -> str:
    """Begin a trial, past its countdown; return its id."""
    operator.done("training_prepare", **prepared)
    trial = str(operator.until_phase("ready")["run"]["id"])
    operator.done("training_begin", run=trial)
    operator.until_phase("running")
    return trial


def numbers(operator: Operator) -> dict[str, Any]:
    """Return the result of the trial that has ended, with its numbers."""
    operator.until_phase("ended")
    operator.until(lambda: operator.state()["result"]["run"] and "Stored" in operator.state()["result"]["stored"], "it")
    return dict(operator.state()["result"])


def test_a_session_from_the_link_and_one_that_is_killed(place: Place, operator: Operators) -> None:
    with place.running() as (process, port):
        first, second = operator(port), operator(port)
        offer = first.until(lambda: first.newest.get("training_offer"), "offer")
        assert "insertion" in [each["key"] for each in offer["tasks"] if not each["problem"]]
        trial = begin(first, participant="P01", task="insertion", view="2d")
        assert first.newest["lock"]["values"] == {"mode": "2d"}
        assert "holds its recording" in second.refused("record_stop")
        assert "is on" in second.refused("training_prepare", participant="P02", task="insertion")
        first.close()  # its link is lost, and the trial goes on
        if second.until_phase("running", "paused")["phase"] == "running":  # a machine that stalls has paused it already
            second.ask("training_pause")
        second.until_phase("paused")
        second.done("training_resume", run=trial)
        second.until_phase("running")
        second.reach()
        result = numbers(second)
        assert (result["outcome"], result["reached"], result["of"]) == ("completed", 4, 4)
        second.until(lambda: second.newest["lock"]["values"] == {}, "the view")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}{result['run']}") as answer:
            run = json.load(answer)
        assert [key for key, _ in run["reached"]] == [each["key"] for each in second.state()["run"]["targets"]]
        assert len(run["t"]) == len(run["tip"]) == len(run["beam"]) == len(run["shape"]) > 20
        recorded = recorded_trial(place.recordings / result["recording"], trial)
        assert recorded.is_same
        said = [each.payload for each in recorded.recorded]
        assert [each["what"] for each in second.training(trial)] == [each["what"] for each in said][
            -len(second.training(trial)) :
        ]
        killed = begin(second, participant="P01", task="insertion", view="2d")
        second.reach(1)
        heard = len(second.events)
        second.until(
            lambda: second.state()["now"]["active_s"] > second.state()["now"]["reached"] + 1.5, "a second more"
        )
        assert heard <= len(second.events)
        process.kill()
        process.wait()
    with place.running() as (_, port):
        third = operator(port)
        (cut,) = third.until(lambda: third.newest.get("training_offer", {}).get("unfinished"), "the killed trial")
        assert (cut["id"], cut["can_continue"]) == (killed, True)
        third.done("training_continue", trial=killed)
        third.until_phase("ready")
        third.done("training_begin")
        now = third.until_phase("running")["now"]
        assert now["reached"] == 1
        third.reach()
        result = numbers(third)
        assert (result["outcome"], result["reached"]) == ("completed", 4)
        whole = recorded_trial(place.recordings / result["recording"], killed)
        assert whole.is_same
        assert len(whole.parts) == 2
    with StudyStore.open(place.store, study="training") as store:
        assert [(each.id, each.number, each.outcome.value) for each in store.trials()] == [
            (trial, 1, "completed"),
            (killed, 2, "completed"),
        ]
        assert store.unfinished() == ()


@pytest.mark.proof
def test_a_study_on_rendered_pictures_with_the_real_tracker(place: Place, operator: Operators) -> None:
    folder = place.folder / "study"
    study("init", str(folder), "--task", "insertion")
    text = (folder / "study.toml").read_text(encoding="utf-8")
    head = text[: text.index("[[surveys]]")].replace("per_condition = 3", "per_condition = 1")
    head = head[: head.index("[practice]")] + head[head.index("[participants]") :]
    (folder / "study.toml").write_text(
        head + '[[surveys]]\nsurvey = "course"\nasked = "each"\n', encoding="utf-8", newline="\n"
    )
    (folder / "surveys").mkdir(exist_ok=True)
    (folder / "surveys" / "course.toml").write_text(WITH_WORDS, encoding="utf-8", newline="\n")
    study("init", str(folder))
    study("allocate", "P01", "--study", str(folder))
    with place.running("--study", str(folder), rendered=True) as (_, port):
        hand = operator(port)
        for count in (1, 2):
            hand.done("training_prepare", participant="P01")
            run = hand.until_phase("ready")["run"]
            assert "is not that" in hand.refused("training_prepare", participant="P01", task="roll")
            hand.done("training_begin", run=run["id"])
            hand.until_phase("running")
            hand.reach()
            assert numbers(hand)["reached"] == 4
            survey = hand.until(lambda: hand.state()["survey"], "the survey")
            assert survey["occasion"] == f"after:{'2d' if run['view'] == '2d' else '3d'}"
            meant = {"survey": "course", "occasion": survey["occasion"]}
            assert "not answered yet" in hand.refused("survey_answer", **meant, answers={"remark": "x"}, done=True)
            answers = {"clear": 4.0, "remark": f"the {count}. time"}
            hand.done("survey_answer", **meant, answers=answers, done=True)
            hand.until(lambda: hand.state()["survey"] is None, "the end of the survey")
        assert "done" in hand.refused("training_prepare", participant="P01")
    with StudyStore.open(folder / "study.sqlite", study="study") as store:
        trials, given = store.trials(), store.answers()
    assert [each.text for each in given if each.item == "remark"] in (
        ["the 1. time", "the 2. time"], ["the 2. time", "the 1. time"],
    )  # fmt: skip
    assert len(trials) == 2
    for each in trials:
        recorded = recorded_trial(place.recordings / each.session, each.id)
        assert recorded.is_same
        assert each.measures["nT"] == 4
        assert each.unseen_share < 0.1
        seen = [track for track in recorded.tracks if track.status is Status.TRACKED]
        assert seen
        assert all(track.sigma_mm is not None and track.sigma_mm > 0.0 for track in seen)
    study("report", "--study", str(folder))
    assert "the 2. time" in (folder / "report" / "report.html").read_text(encoding="utf-8")


def study(*arguments: str) -> None:
    """Give a command of `cathxr study`."""
    done = subprocess.run(
        [sys.executable, "-m", "cathxr", "study", *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
