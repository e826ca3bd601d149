"""A heart being registered by touching landmarks with the tip: Tracks and a person's word in, states out. No threads.

Nothing is written before a person accepts.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from cathxr.core import FloatArray, Health, RegistrationError, Track
from cathxr.registration import Kind, LandmarkPair, Registration, Solution, register
from cathxr.registration.drawing import HeartPicture, HeartShape, heart_pictures, tre_png
from cathxr.runtime.calibration_task import CANCELLED, CommandTable, Ending, Job, Keep, text_of
from cathxr.runtime.registration_rest import LEAST_S, Rest, RestFinder
from cathxr.runtime.registration_words import closing_advice, missing_sentence, solution_figures
from cathxr.wire.calibration_messages import CalibrationStage, HeartView, ResultPicture, TouchedLandmark, TouchState
from cathxr.wire.message import Vector2

_MOVED_ON_MM = 3.0
"""After a landmark is taken the tip must leave it by this much: one rest is not two landmarks."""
_KINDS: Mapping[Kind, Literal["rigid", "similarity", "affine"]] = MappingProxyType(
    {Kind.RIGID: "rigid", Kind.SIMILARITY: "similarity", Kind.AFFINE: "affine"}
)

Save = Callable[[Registration], Ending]
"""Writes the registration, or raises."""
OnLandmark = Callable[[str | None], None]


@dataclass(frozen=True, eq=False)
class Wanted:
    """A landmark to be touched: its key and name, and where it is, ct_mm (3,) in `ct`."""

    key: str
    name: str
    ct_mm: FloatArray


class TouchSession:
    """Registers a heart by touched landmarks. A `Steps` that also takes Tracks.

    keep: keeps the pictures. save: writes the registration. on_landmark: hears which landmark is to be touched next,
    for a simulated hand.
    """

    def __init__(
        self,
        wanted: Sequence[Wanted],
        shape: HeartShape,
        *,
        kind: Kind,
        method: str,
        date: str,
        keep: Keep,
        save: Save,
        on_landmark: OnLandmark | None = None,
    ) -> None:
        self.ending: Ending | None = None
        self.stage: CalibrationStage = "collecting"
        self._wanted = {each.key: each for each in wanted}
        self._shape, self._method, self._date, self._keep, self._save = shape, method, date, keep, save
        self._kind = kind
        self._is_simulated, self._on_landmark = on_landmark is not None, on_landmark or _nobody
        self._rests: dict[str, Rest] = {}
        self._skipped: set[str] = set()
        self._finder = RestFinder()
        self._left: FloatArray | None = None
        self._tip: FloatArray | None = None
        self._trouble = "No Track has come yet."
        self._solution: Solution | None = None
        self._failure = ""
        self._pictures: list[ResultPicture] = []
        self._job: Job[Any] | None = None
        self._serial = 0
        self._heart = heart_pictures(shape, np.stack([each.ct_mm for each in wanted]))
        self._views = [_view(index, each, keep) for index, each in enumerate(self._heart)]
        self._commands = CommandTable(
            {
                "registration_take": ((), self._take_rest),
                "registration_skip": ((), self._skip),
                "registration_choose": (("landmark",), self._choose),
                "registration_kind": (("kind",), self._set_kind),
                "calibration_finish": ((), self._finish),
                "calibration_continue": ((), self._continue),
                "calibration_accept": ((), self._accept),
                "calibration_cancel": ((), self._cancel),
            }
        )
        self._current: str | None = None
        self._go_to(next(iter(self._wanted)))

    # --- Steps --------------------------------------------------------------------------------------------------------

    def take(self, tracks: Sequence[Track]) -> None:
        """Take the Tracks since the last time, in order."""
        for track in tracks:
            self._finder.add(track)
            self._tip = track.tip_box
            self._trouble = track.reason
        if self._left is not None and self._tip is not None and _apart(self._tip, self._left) > _MOVED_ON_MM:
            self._left = None

    def note_health(self, sources: Mapping[str, Health]) -> None:
        """Take note of a device that has gone."""
        errors = [each.last_error for each in sources.values() if not each.running and each.last_error]
        if errors:
            self._trouble, self._tip = errors[0], None

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Carry out a command. Raises as `Steps.handle`."""
        return self._commands.handle(name, args)

    def take_job(self) -> Job[Any] | None:
        """Return what is to be worked out."""
        job, self._job = self._job, None
        return job

    def state(self) -> TouchState:
        """Return what the page shows."""
        why = self._why_not()
        solution = self._solution
        rest = self._finder.rest
        collecting = self.stage == "collecting"
        return TouchState(
            stage=self.stage,
            advice=self._advice(),
            is_simulated=self._is_simulated,
            kind=_KINDS[self._kind],
            landmarks=[self._landmark(each) for each in self._wanted.values()],
            current=self._current,
            views=self._views,
            tip_places=self._tip_places(),
            is_tracked=self._tip is not None,
            trouble="" if self._tip is not None else self._trouble,
            rest_share=0.0 if rest is None or not collecting else round(min(1.0, rest.seconds / LEAST_S), 2),
            rest_spread_mm=None if rest is None else round(rest.spread_mm, 2),
            can_take=collecting and not why,
            why=why,
            can_finish=collecting and not missing_sentence(len(self._rests), self._kind),
            can_save=self.stage == "done" and self.ending is None,
            doubts=self._doubts(),
            is_grave=solution is not None and solution.is_grave,
            figures=[] if solution is None else solution_figures(solution),
            pictures=self._pictures if self.stage == "done" else [],
        )

    @property
    def solution(self) -> Solution | None:
        """The registration by the landmarks so far, None before there are enough."""
        return self._solution

    # --- commands -----------------------------------------------------------------------------------------------------

    def _take_rest(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self._only_while_collecting()
        if why := self._why_not():
            raise RegistrationError(why)
        rest, taken = self._finder.rest, self._current
        assert rest is not None
        assert taken is not None
        self._rests[taken] = rest
        self._skipped.discard(taken)
        self._left = rest.mean_box
        self._solve(final=False)
        self._go_on()
        return {"landmark": taken, "box_mm": rest.mean_box.tolist(), "spread_mm": rest.spread_mm}

    def _skip(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self._only_while_collecting()
        if self._current is None:
            raise RegistrationError("There is no landmark to skip.")
        self._skipped.add(self._current)
        if self._rests.pop(self._current, None) is not None:
            self._solve(final=False)
        self._go_on()
        return {}

    def _choose(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        key = text_of(args, "landmark")
        if key not in self._wanted:
            raise RegistrationError(f"There is no landmark {key!r} here: there are {', '.join(self._wanted)}.")
        if self.stage in ("done", "failed"):
            self._continue({})
        self._only_while_collecting()
        self._go_to(key)
        return {}

    def _set_kind(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        value = text_of(args, "kind")
        if value not in _KINDS.values():
            raise RegistrationError(f"kind must be rigid, similarity or affine; {value!r} was given.")
        if self.stage == "solving":
            raise RegistrationError("A registration is being worked out: wait a moment.")
        self._kind = Kind(value)
        self._solve(final=self.stage in ("done", "failed"))
        return {}

    def _finish(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self._only_while_collecting()
        if missing := missing_sentence(len(self._rests), self._kind):
            raise RegistrationError(missing)
        self._solve(final=True)
        return {}

    def _continue(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self.stage not in ("done", "failed"):
            raise RegistrationError("There is nothing to go back from.")
        self.stage = "collecting"
        if self._current is None:
            self._go_on()
        return {}

    def _accept(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self.stage != "done" or self._solution is None:
            raise RegistrationError("There is no result to save yet: finish first.")
        self.ending = self._save(self._solution.registration)
        return self.ending.result

    def _cancel(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self.ending = CANCELLED
        return self.ending.result

    # --- inside -------------------------------------------------------------------------------------------------------

    def _only_while_collecting(self) -> None:
        if self.stage != "collecting":
            raise RegistrationError("Go back to touching landmarks first.")

    def _go_on(self) -> None:
        """Make the next landmark that waits the current one."""
        keys = list(self._wanted)
        start = 0 if self._current is None else keys.index(self._current) + 1
        waiting = [key for key in keys[start:] + keys[:start] if key not in self._rests and key not in self._skipped]
        self._go_to(waiting[0] if waiting else None)

    def _go_to(self, key: str | None) -> None:
        self._current = key
        self._finder.clear()
        self._on_landmark(key)

    def _why_not(self) -> str:
        """Return why the present rest cannot be taken; empty: it can."""
        rest = self._finder.rest
        if self._current is None:
            return "All landmarks are done: choose one in the list to touch it again."
        if self._tip is None:
            return f"The tip is not tracked: {self._trouble}" if self._trouble else "The tip is not tracked."
        if self._left is not None:
            return f"Move the tip on to the {self._wanted[self._current].name.lower()}."
        if rest is None or not rest.is_enough:
            return "The tip does not rest yet: hold it still for a second."
        return ""

    def _advice(self) -> str:
        if self.stage == "solving":
            return "Working out the registration."
        if self.stage == "failed":
            return self._failure
        if self.stage == "done" and self._solution is not None:
            return closing_advice(self._solution)
        if self._current is None:
            missing = missing_sentence(len(self._rests), self._kind)
            return f"{missing} Choose one in the list." if missing else "All landmarks are done: finish."
        again = " again" if self._current in self._rests else ""
        return f"Touch the {self._wanted[self._current].name.lower()}{again} with the tip, hold it still, and take it."

    def _doubts(self) -> list[str]:
        if self._solution is None:
            return [self._failure] if self._failure and self.stage == "collecting" else []
        return [each.sentence for each in self._solution.doubts]

    def _landmark(self, wanted: Wanted) -> TouchedLandmark:
        rest = self._rests.get(wanted.key)
        pairs = () if self._solution is None else self._solution.registration.landmarks
        pair = next((each for each in pairs if each.name == wanted.key), None)
        return TouchedLandmark(
            name=wanted.key,
            label=wanted.name,
            status="touched" if rest is not None else "skipped" if wanted.key in self._skipped else "waiting",
            places=_places(self._heart, wanted.ct_mm),
            spread_mm=None if rest is None else round(rest.spread_mm, 2),
            residual_mm=None if pair is None else pair.residual_mm,
            held_out_mm=None if pair is None else pair.held_out_mm,
        )

    def _tip_places(self) -> list[Vector2]:
        """Return where the landmarks so far put the tip; empty without them or far outside the pictures."""
        if self._tip is None or self._solution is None:
            return []
        places = _places(self._heart, self._solution.registration.ct(self._tip))
        return places if all(-0.2 <= share <= 1.2 for place in places for share in place) else []

    def _solve(self, *, final: bool) -> None:
        """Have the registration worked out from what was touched; final: with its picture, and shown as the result."""
        self._solution, self._failure, self._job = None, "", None
        self._serial += 1
        pairs = [
            LandmarkPair(key, self._rests[key].mean_box, each.ct_mm, box_std_mm=self._rests[key].position_std_mm)
            for key, each in self._wanted.items()
            if key in self._rests
        ]
        if missing := missing_sentence(len(pairs), self._kind):
            if final:
                self._fail(missing)
            return
        kind, heart_ct = self._kind, self._shape.vertices_ct

        def work() -> tuple[Solution, bytes]:
            found = register(pairs, kind, method=self._method, date=self._date, heart_ct=heart_ct)
            return found, tre_png(found, self._shape) if final else b""

        self.stage = "solving" if final else "collecting"
        serial = self._serial
        self._job = Job(work, partial(self._solved, serial), partial(self._unsolved, serial))

    def _solved(self, serial: int, result: tuple[Solution, bytes]) -> None:
        if serial != self._serial:
            return  # other landmarks count by now
        self._solution, picture = result
        if picture:
            self._pictures = [ResultPicture(title="Predicted error", path=self._keep("registration", picture))]
        if self.stage == "solving":
            self.stage = "done"

    def _unsolved(self, serial: int, sentence: str) -> None:
        if serial == self._serial:
            self._fail(sentence)

    def _fail(self, sentence: str) -> None:
        self._failure = sentence
        self.stage = "failed" if self.stage in ("solving", "done") else "collecting"


def _nobody(key: str | None) -> None:
    pass


def _apart(first: FloatArray, second: FloatArray) -> float:
    return float(np.linalg.norm(first - second))


def _view(index: int, picture: HeartPicture, keep: Keep) -> HeartView:
    return HeartView(title=picture.view.title, path=keep(f"heart-{index}", picture.png), size_px=picture.size_px)


def _places(pictures: Sequence[HeartPicture], point_ct: FloatArray) -> list[Vector2]:
    """Return where a point (3,) is in each picture, rounded to what can be seen."""
    found = [each.places(point_ct[None])[0] for each in pictures]
    return [(round(float(x), 4), round(float(y), 4)) for x, y in found]
