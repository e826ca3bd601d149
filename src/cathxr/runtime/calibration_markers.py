"""The cameras' poses measured with a person's help: what was found, what is placed, what comes of it. No threads.

Every change solves again; pictures of the result are drawn afterwards, when nobody is placing anything.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cathxr.calibration.error_map import ErrorSummary, error_summary
from cathxr.calibration.marker_clicks import merged, sighting_from_points
from cathxr.calibration.marker_finding import find_markers
from cathxr.calibration.poses import PosesResult, calibrate_poses
from cathxr.calibration.poses_drawing import error_map_png, residuals_png
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import CalibrationError, ConfigError, FloatArray, Health, Image, PixelArray, Rig
from cathxr.runtime.calibration_markers_figures import result_figures
from cathxr.runtime.calibration_task import CANCELLED, CommandTable, Ending, Job, Keep, text_of
from cathxr.wire.calibration_messages import CalibrationStage, Figure, MarkersState, MarkerState, ResultPicture

_BY_EYE_PX = 0.5
"""How well a person places a fiducial's centre in an enlarged picture."""

Save = Callable[[PosesResult, Mapping[str, Sighting]], Ending]
"""Writes the result; raises CathxrError, and then nothing is written."""


Judge = Callable[[PosesResult, ErrorSummary], str]
"""Says in a sentence how good a result is, or what to do better."""


@dataclass(eq=False)
class _View:
    """One camera's pictures, what was found in them, and what a person changed of that."""

    pictures: Sequence[PixelArray]
    found: Sighting
    placed: dict[str, FoundMarker] = field(default_factory=dict)
    removed: set[str] = field(default_factory=set)

    @property
    def sighting(self) -> Sighting:
        """What counts now: what was found, without what was removed, and with what was placed."""
        if not (self.placed or self.removed):
            return self.found
        kept = [each for each in self.found.markers if each.name not in self.removed and each.name not in self.placed]
        return replace(
            self.found,
            markers=(*kept, *self.placed.values()),
            missing=tuple(each for each in self.found.missing if each not in self.placed),
            ambiguous=tuple(each for each in self.found.ambiguous if each not in self.placed),
            # With a person's word on it, the solution itself says whether the markers suffice.
            problem=None,
        )


@dataclass(frozen=True, eq=False)
class _Solution:
    result: PosesResult
    sightings: Mapping[str, Sighting]
    figures: list[Figure]
    sentence: str


class MarkersSession:
    """Solves the poses from pictures with the crosses in them, and lets a person place what was not found. A Task.

    pictures: by camera, one or several from the same place. date: of the result. judge: says how good it is. keep:
    publishes result pictures. save: writes what a person accepts.
    """

    def __init__(
        self,
        rig: Rig,
        pictures: Mapping[str, Sequence[PixelArray]],
        *,
        date: str,
        judge: Judge,
        keep: Keep,
        save: Save,
    ) -> None:
        self.ending: Ending | None = None
        self._rig, self._date, self._judge, self._keep, self._save = rig, date, judge, keep, save
        self._pictures_of = {name: tuple(each) for name, each in pictures.items()}
        self._names = {marker.name: marker.colour for group in rig.markers.values() for marker in group}
        self._views: dict[str, _View] = {}
        self._stage: CalibrationStage = "solving"
        self._sentence = "Looking for the fiducials."
        self._solution: _Solution | None = None
        self._result_pictures: tuple[ResultPicture, ...] = ()
        self._generation = 0
        self._job: Job[Any] | None = Job(self._find, self._take_found, self._fail)
        self._commands = CommandTable(
            {
                "calibration_place": (("camera", "marker", "pixel", "exact?"), self._place),
                "calibration_unplace": (("camera", "marker"), self._unplace),
                "calibration_accept": ((), self._accept),
                "calibration_cancel": ((), self._cancel),
            }
        )

    def examine(self, image: Image) -> None:
        """Return nothing: the pictures here do not change."""

    def look(self, image: Image, found: None) -> None:
        """Do nothing: the pictures here do not change."""

    def note_health(self, sources: Mapping[str, Health]) -> None:
        """Do nothing: there are no cameras here."""

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Carry out a command. Raises as `Task.handle`."""
        return self._commands.handle(name, args)

    def take_job(self) -> Job[Any] | None:
        """Return what is to be worked out."""
        job, self._job = self._job, None
        return job

    def state(self) -> MarkersState:
        """Return what the page shows."""
        solution = self._solution
        return MarkersState(
            stage=self._stage,
            advice=self._sentence if self.ending is None else self.ending.sentence,
            sizes_px={name: self._rig.cameras[name].size_px for name in self._pictures_of},
            markers=[each for camera in self._views for each in self._marker_states(camera)],
            can_save=self._can_save,
            figures=[] if solution is None else solution.figures,
            pictures=list(self._result_pictures),
        )

    @property
    def _can_save(self) -> bool:
        return self._stage == "done" and self._solution is not None and self.ending is None

    def _marker_states(self, camera: str) -> list[MarkerState]:
        """Return the camera's own fiducials, and those of the other cross as far as anything is known of them."""
        sighting = self._views[camera].sighting
        seen = {each.name: each for each in sighting.markers}
        own = [each.name for each in self._rig.markers.get(camera, ())]
        removed = self._views[camera].removed
        others = [
            name for name in self._names
            if name not in own and name in {*seen, *sighting.missing, *sighting.ambiguous, *removed}
        ]  # fmt: skip
        residuals = {}
        if self._solution is not None:
            residuals = {
                each.name: each.residual_px for each in self._solution.result.residuals if each.camera == camera
            }
        states = []
        for name in (*own, *others):
            marker = seen.get(name)
            unclear = name in sighting.ambiguous
            residual = residuals.get(name) if marker is not None else None
            states.append(
                MarkerState(
                    camera=camera,
                    name=name,
                    colour=self._names[name],
                    pixel=None if marker is None else _rounded(marker.centre_px),
                    origin=("placed" if marker.placed else "found")
                    if marker
                    else "ambiguous"
                    if unclear
                    else "missing",
                    residual=None if residual is None else _rounded(residual, decimals=3),
                    residual_px=None if residual is None else round(float(np.linalg.norm(residual)), 3),
                )
            )
        return states

    # --- work ---------------------------------------------------------------------------------------------------------

    def _find(self) -> dict[str, Sighting]:
        """Return what the pictures show."""
        found = {}
        for name, pictures in self._pictures_of.items():
            sightings = [find_markers(self._rig, name, each) for each in pictures]
            found[name] = sightings[0] if len(sightings) == 1 else merged(sightings)
        return found

    def _take_found(self, found: Mapping[str, Sighting]) -> None:
        self._views = {name: _View(self._pictures_of[name], each) for name, each in found.items()}
        self._solve()

    def _fail(self, sentence: str) -> None:
        self._stage, self._sentence, self._solution = "failed", sentence, None

    def _solve(self) -> None:
        """Have the poses worked out from what counts now."""
        self._stage, self._sentence = "solving", "Working out the poses."
        self._generation += 1
        generation = self._generation
        sightings = {name: view.sighting for name, view in self._views.items()}

        def work() -> _Solution:
            result = calibrate_poses(self._rig, tuple(sightings.values()), date=self._date)
            summary = error_summary(result.rig)
            return _Solution(result, sightings, result_figures(result, summary), self._judge(result, summary))

        def done(solution: _Solution) -> None:
            if generation == self._generation:
                self._solution, self._stage, self._sentence = solution, "done", solution.sentence
                self._draw(solution, generation)

        def failed(sentence: str) -> None:
            if generation == self._generation:
                # Not a failure while a person may still place what is missing.
                self._stage, self._sentence = "collecting", sentence
                self._solution, self._result_pictures = None, ()

        self._job = Job(work, done, failed)

    def _draw(self, solution: _Solution, generation: int) -> None:
        """Have the result's pictures drawn."""

        def work() -> dict[str, tuple[str, bytes]]:
            return {
                "expected_error": ("Expected error in the region of interest", error_map_png(solution.result.rig)),
                "markers_residuals": ("What is left over at the fiducials", residuals_png(solution.result)),
            }

        def done(pictures: Mapping[str, tuple[str, bytes]]) -> None:
            if generation == self._generation:
                self._result_pictures = tuple(
                    ResultPicture(title=title, path=self._keep(name, png)) for name, (title, png) in pictures.items()
                )

        def failed(sentence: str) -> None:
            if generation == self._generation:
                self._result_pictures = ()

        self._job = Job(work, done, failed)

    # --- commands -----------------------------------------------------------------------------------------------------

    def _place(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        view, name = self._named(args)
        pixel = self._pixel(args)
        if args.get("exact") is True:
            marker = FoundMarker(name, self._names[name], pixel, _BY_EYE_PX, placed=True)
        else:
            marker = self._refined(view, name, pixel)
        view.placed[name] = marker
        view.removed.discard(name)
        self._solve()
        return {"pixel": list(_rounded(marker.centre_px))}

    def _unplace(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        view, name = self._named(args)
        was_found = any(each.name == name for each in view.found.markers)
        if name in view.placed:
            del view.placed[name]
        elif name in view.removed:
            view.removed.discard(name)
        elif was_found:
            view.removed.add(name)
        else:
            raise CalibrationError(f"There is no {name} in the {view.found.camera} picture to take away.")
        self._solve()
        return {}

    def _accept(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if self._stage == "solving":
            raise CalibrationError("The poses are being worked out: accept them in a moment.")
        if not self._can_save or self._solution is None:
            raise CalibrationError(f"There is nothing to accept yet. {self._sentence}")
        self.ending = self._save(self._solution.result, self._solution.sightings)
        return self.ending.result

    def _cancel(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        self.ending = CANCELLED
        return self.ending.result

    def _named(self, args: Mapping[str, Any]) -> tuple[_View, str]:
        """Return the view and the marker that a command names."""
        camera, name = text_of(args, "camera"), text_of(args, "marker")
        if not self._views:
            raise CalibrationError("The fiducials are still being looked for: place them in a moment.")
        if camera not in self._views:
            raise ConfigError(f"There is no picture of a camera {camera!r}: there are {', '.join(self._views)}.")
        if name not in self._names:
            raise ConfigError(f"The rig has no fiducial {name!r}: it has {', '.join(self._names)}.")
        return self._views[camera], name

    def _refined(self, view: _View, name: str, pixel: FloatArray) -> FoundMarker:
        """Return a fiducial at the spot under a person's click, in the picture that shows it best."""
        placed = []
        for picture in view.pictures:
            sighting = sighting_from_points(self._rig, view.found.camera, picture, {name: pixel})
            placed += [each for each in sighting.markers if each.name == name]
        if not placed:
            raise CalibrationError(f"{name} cannot be placed there: choose another place.")
        return min(placed, key=lambda each: each.sigma_px)

    def _pixel(self, args: Mapping[str, Any]) -> FloatArray:
        """Return the pixel (2,) that a command names."""
        value, (width, height) = args["pixel"], self._rig.cameras[text_of(args, "camera")].size_px
        numbers = isinstance(value, list) and len(value) == 2
        numbers = numbers and all(isinstance(each, (int, float)) and not isinstance(each, bool) for each in value)
        if not numbers or not all(math.isfinite(each) for each in value):
            raise ConfigError(f"pixel must be two numbers, {value!r} was given.")
        if not (-0.5 <= value[0] <= width - 0.5 and -0.5 <= value[1] <= height - 0.5):
            raise ConfigError(f"The pixel {value[0]:g}, {value[1]:g} is not in a picture of {width} x {height}.")
        return np.array(value, dtype=np.float64)


def _rounded(values: FloatArray, *, decimals: int = 2) -> tuple[float, float]:
    x, y = np.round(values, decimals).tolist()
    return x, y
