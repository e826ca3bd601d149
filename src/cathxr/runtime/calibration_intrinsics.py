"""A camera's lens measured live: which pictures of the board are kept, what to do next, what came of it. No threads."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import cv2

from cathxr.calibration.board import Board
from cathxr.calibration.board_views import BoardView, RejectedView, find_board
from cathxr.calibration.coverage import CoverageMap, still
from cathxr.calibration.intrinsics import IntrinsicsResult, calibrate_intrinsics
from cathxr.calibration.intrinsics_drawing import coverage_png, residual_png
from cathxr.core import CalibrationError, DataError, Health, Image, Intrinsics, PixelArray
from cathxr.runtime.calibration_intrinsics_figures import progress_figures, result_figures
from cathxr.runtime.calibration_task import CANCELLED, CommandTable, Ending, Job, Keep, text_of
from cathxr.wire import calibration_messages as messages
from cathxr.wire.calibration_messages import CalibrationStage, IntrinsicsState, ResultPicture

STILL_NS = 300_000_000
"""How long the board must rest before a picture is taken by itself: less than that, and hands still tremble."""
MOST_VIEWS = 60
"""Kept at most: beyond that nothing is gained, and the pictures fill the memory."""


@dataclass(frozen=True, eq=False)
class KeptView:
    """One view of the board with its picture."""

    view: BoardView
    pixels: PixelArray


@dataclass(frozen=True, eq=False)
class Solution:
    """What came of a calibration. pictures: of the result by name, title and PNG; views: those kept by name, as PNG."""

    result: IntrinsicsResult
    pictures: Mapping[str, tuple[str, bytes]]
    views: Mapping[str, bytes]


Save = Callable[[Solution], Ending]
"""Writes the result and the views kept; raises CathxrError, and then nothing is written."""


class IntrinsicsSession:
    """Collects views of a board from one camera's pictures and works out its lens. A Task.

    date: of the result. start: a lens to begin the search with. keep: publishes result pictures. save: writes what a
    person accepts.
    """

    def __init__(
        self,
        board: Board,
        *,
        camera: str,
        size_px: tuple[int, int],
        date: str,
        keep: Keep,
        save: Save,
        start: Intrinsics | None = None,
    ) -> None:
        self.ending: Ending | None = None
        self._board, self._camera, self._size_px, self._date = board, camera, size_px, date
        self._start = start
        self._keep, self._save = keep, save
        self._stage: CalibrationStage = "collecting"
        self._coverage = CoverageMap()
        self._kept: list[KeptView] = []
        self._rejected: dict[str, str] = {}
        self._taken = 0
        self._newest: tuple[Image, BoardView | RejectedView] | None = None
        self._still_since_ns: int | None = None
        self._is_new = False
        self._by_itself = True  # it finishes when complete, until a person has asked for more
        self._generation = 0
        self._job: Job[Solution] | None = None
        self._solution: Solution | None = None
        self._pictures: tuple[ResultPicture, ...] = ()
        self._sentence = ""
        self._trouble = ""
        self._commands = CommandTable(
            {
                "calibration_capture": ((), self._capture),
                "calibration_discard": (("view",), self._discard),
                "calibration_finish": ((), self._finish),
                "calibration_continue": ((), self._continue),
                "calibration_accept": ((), self._accept),
                "calibration_cancel": ((), self._cancel),
            }
        )

    @property
    def kept(self) -> tuple[KeptView, ...]:
        """The views kept so far, in their order."""
        return tuple(self._kept)

    def examine(self, image: Image) -> BoardView | RejectedView | None:
        """Return the board in a picture; None while the pictures do not matter."""
        if self._stage != "collecting":
            return None
        return find_board(self._board, image.pixels, name=f"picture {image.seq}")

    def look(self, image: Image, found: BoardView | RejectedView | None) -> None:
        """Take a picture: show its corners, and keep it when the board is still and the view is new."""
        self._trouble = ""
        if image.size_px != self._size_px:
            (width, height), (wide, high) = image.size_px, self._size_px
            self._trouble = (
                f"The pictures are {width} x {height} and the rig's {self._camera} camera {wide} x {high}: "
                "set the camera to the rig's size, or correct size_px in the rig."
            )
            found = None
        before, self._newest = self._newest, None if found is None else (image, found)
        if not isinstance(found, BoardView):
            self._still_since_ns, self._is_new = None, False
            return
        rests = before is not None and isinstance(before[1], BoardView) and still(before[1], found)
        if not rests:
            self._still_since_ns = None
        elif self._still_since_ns is None and before is not None:
            self._still_since_ns = before[0].t_ns
        self._is_new = self._coverage.is_new(found)
        if self._stage == "collecting" and self._is_new and self._is_still and len(self._kept) < MOST_VIEWS:
            self._keep_newest()

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Carry out a command. Raises as `Task.handle`."""
        return self._commands.handle(name, args)

    def take_job(self) -> Job[Any] | None:
        """Return the solving that was asked for."""
        job, self._job = self._job, None
        return job

    def note_health(self, sources: Mapping[str, Health]) -> None:
        """Show why there are no pictures."""
        health = sources.get(self._camera)
        if health is not None and not health.running and health.last_error:
            self._trouble = health.last_error
            self._newest = None

    def state(self) -> IntrinsicsState:
        """Return what the page shows."""
        image, found = self._newest or (None, None)
        corners = found.corners_px.round(2).tolist() if isinstance(found, BoardView) else []
        rejected = [messages.BoardView(name=name, kept=False, reason=why) for name, why in self._rejected.items()]
        result = None if self._solution is None else self._solution.result
        return IntrinsicsState(
            camera=self._camera,
            stage=self._stage,
            advice=self._advice(),
            size_px=self._size_px,
            corners_px=[(x, y) for x, y in corners],
            corners_seq=-1 if image is None else image.seq,
            is_still=self._is_still,
            is_new=self._is_new,
            coverage=messages.Coverage(
                columns=self._coverage.columns,
                rows=self._coverage.rows,
                counts=[int(each) for each in self._coverage.counts.ravel()],
            ),
            kept=len(self._kept),
            wanted=self._coverage.wanted,
            views=[messages.BoardView(name=each.view.name, kept=True, reason="") for each in self._kept] + rejected,
            figures=progress_figures(self._kept_views()) if result is None else result_figures(result),
            pictures=list(self._pictures),
        )

    @property
    def _is_still(self) -> bool:
        """Whether the board has rested for long enough."""
        if self._newest is None or self._still_since_ns is None:
            return False
        return self._newest[0].t_ns - self._still_since_ns >= STILL_NS

    def _kept_views(self) -> list[BoardView]:
        return [each.view for each in self._kept]

    def _advice(self) -> str:
        """Return one sentence: what to do next."""
        if self.ending is not None:
            return self.ending.sentence
        if self._stage != "collecting":
            return (
                "The pictures are enough: the lens is being worked out." if self._stage == "solving" else self._sentence
            )
        if self._trouble:
            return self._trouble
        if self._newest is None:
            return "Waiting for the camera's pictures."
        found = self._newest[1]
        if isinstance(found, RejectedView):
            return f"Not usable: {found.reason.rstrip('.')}."
        if self._is_new:
            return "Hold the board still: this view is new."
        if len(self._kept) >= MOST_VIEWS:
            return f"{MOST_VIEWS} views are kept, as many as are of use: finish now."
        return self._coverage.advice()

    def _keep_newest(self) -> None:
        """Keep the newest picture; start the solving when that completes the views."""
        assert self._newest is not None, "there is a newest picture"
        image, view = self._newest
        assert isinstance(view, BoardView), "only views with a board are kept"
        self._taken += 1
        view = replace(view, name=f"{self._camera}_{self._taken:02d}")
        self._kept.append(KeptView(view, image.pixels))
        self._coverage = self._coverage.with_view(view)
        self._is_new = False
        if self._coverage.complete and self._by_itself:
            self._solve()

    def _capture(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self._only_in("collecting", "keep a picture")
        if self._newest is None:
            raise CalibrationError("There is no picture to keep yet: wait for the camera.")
        if isinstance(self._newest[1], RejectedView):
            raise CalibrationError(f"This picture cannot be used: {self._newest[1].reason.rstrip('.')}.")
        if len(self._kept) >= MOST_VIEWS:
            raise CalibrationError(f"{MOST_VIEWS} views are kept, as many as are of use: finish, or discard some.")
        self._keep_newest()
        return {"view": self._kept[-1].view.name}

    def _discard(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        name = text_of(args, "view")
        if self._stage == "solving":
            raise CalibrationError("The lens is being worked out: discard views when that is done.")
        left = [each for each in self._kept if each.view.name != name]
        if len(left) == len(self._kept) and name not in self._rejected:
            raise CalibrationError(f"There is no view {name!r}: it may have been discarded already.")
        self._kept = left
        self._collect()
        return {}

    def _finish(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self._only_in("collecting", "finish")
        if not self._kept:
            raise CalibrationError("No view is kept yet: hold the board before the camera first.")
        self._solve()
        return {}

    def _continue(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self._stage not in ("done", "failed"):
            raise CalibrationError("More views can be collected once there is a result; views are collected now.")
        self._by_itself = False
        self._collect()
        return {}

    def _accept(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self._stage != "done" or self._solution is None:
            raise CalibrationError("There is no result to accept yet: collect views and finish first.")
        self.ending = self._save(self._solution)
        return self.ending.result

    def _cancel(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self.ending = CANCELLED
        return self.ending.result

    def _only_in(self, stage: str, what: str) -> None:
        if self._stage != stage:
            raise CalibrationError(f"One cannot {what} now: ask to collect more views first.")

    def _collect(self) -> None:
        """Go back to collecting; what was worked out is void."""
        self._stage, self._solution, self._pictures, self._sentence = "collecting", None, (), ""
        self._rejected = {}
        self._generation += 1
        self._coverage = CoverageMap.of(self._kept_views())
        self._newest, self._still_since_ns, self._is_new = None, None, False

    def _solve(self) -> None:
        self._stage = "solving"
        self._generation += 1
        generation, kept = self._generation, self.kept

        def work() -> Solution:
            views = [each.view for each in kept]
            result = calibrate_intrinsics(self._board, views, size_px=self._size_px, date=self._date, start=self._start)
            name = f"intrinsics_{self._camera}"
            pictures = {
                f"{name}_coverage": ("Where the board was", coverage_png(result)),
                f"{name}_residuals": ("What is left over", residual_png(result)),
            }
            out = {each.name for each in result.rejected}
            # Encoded here, because that takes seconds in which a person who accepts would wait.
            return Solution(
                result, pictures, {each.view.name: _png(each) for each in kept if each.view.name not in out}
            )

        def done(solution: Solution) -> None:
            if generation == self._generation:
                self._take(solution)

        def failed(why: str) -> None:
            if generation == self._generation:
                self._stage, self._sentence = "failed", why

        self._job = Job(work, done, failed)

    def _take(self, solution: Solution) -> None:
        """Show a result."""
        self._stage, self._solution = "done", solution
        self._rejected = {each.name: each.reason for each in solution.result.rejected}
        self._kept = [each for each in self._kept if each.view.name not in self._rejected]
        try:
            self._pictures = tuple(
                ResultPicture(title=title, path=self._keep(name, png))
                for name, (title, png) in solution.pictures.items()
            )
        except ValueError as error:
            raise DataError(f"The result's pictures cannot be shown: {error}.") from error
        self._sentence = solution.result.verdict


def _png(kept: KeptView) -> bytes:
    """Return a view's picture as PNG: compressed as little as a camera's noise is worth.

    Raises:
        DataError: PNG cannot hold it.
    """
    made, data = cv2.imencode(".png", kept.pixels, [cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY])
    if not made:
        raise DataError(f"The picture {kept.view.name} of shape {kept.pixels.shape} cannot be written as PNG.")
    return data.tobytes()
