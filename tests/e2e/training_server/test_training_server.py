"""Training on the twin through the real server, without a browser: two operators, the numbers, a killed process."""

import json
import urllib.request
from collections.abc import Callable
from typing import Any

from cathxr.runtime.training_recordings import recorded_trial
from cathxr.storage.study_store import StudyStore

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
