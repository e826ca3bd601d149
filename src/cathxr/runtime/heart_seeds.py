"""Placing seeds in a heart's CT: commands in, states out, and what is to be segmented. No threads here."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from cathxr.core import CathxrError, ConfigError, DataError
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.seeds import NOTHING, Seed
from cathxr.heart.slices import PLANES
from cathxr.heart.volume import LabelVolume, Progress, Volume
from cathxr.runtime.calibration_task import CommandTable, Ending, text_of
from cathxr.runtime.heart_slices import HeartSlices, volumes_ml
from cathxr.wire.heart_messages import HeartSeed, HeartSeedsState, HeartStructure, SlicePlane

MOST_SEEDS = 200
_MOST_UNDO = 200
_UNNAMED_COLOUR = "#9aa7b4"
_TO_BE_TAKEN_APART = ("blood_pool", "right_heart", "left_heart")
SEEDABLE = (*(key for key, each in CATALOGUE.items() if each.blood and key not in _TO_BE_TAKEN_APART), NOTHING)
"""The structures that the page takes seeds for, in the order of its list."""


class Segmented(Protocol):
    """What a segmentation gives."""

    @property
    def labels(self) -> LabelVolume: ...
    @property
    def findings(self) -> tuple[str, ...]: ...


Segmenter = Callable[[Sequence[Seed], Progress], Segmented]
Save = Callable[[Sequence[Seed]], None]
"""Writes the seeds file. Raises DataError; its sentence is shown, so that it names no path."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """A segmentation with its volumes, mL by structure, and the seeds that it was given."""

    segmented: Segmented
    volumes: Mapping[str, float]
    seeds: tuple[Seed, ...]


@dataclass(frozen=True)
class _Placed:
    id: int
    seed: Seed


@dataclass
class _Labels:
    """What is shown over the CT, and what is known of it."""

    source: Any = "nothing"
    seeds: tuple[Seed, ...] | None = None
    findings: tuple[str, ...] = ()
    volumes: Mapping[str, float] = field(default_factory=dict)
    before: Mapping[str, float] = field(default_factory=dict)


class SeedSession:
    """The seeds of one heart while a person places them. All methods but `segment` are called by one thread at a time.

    volume: the CT. seeds: those there are already; saved: whether the seeds file holds them. labels: ready ones to
    show; without them the segmentation begins at once. key: what the page needs to be given slices.
    """

    def __init__(
        self,
        volume: Volume,
        *,
        segmenter: Segmenter,
        save: Save,
        key: str,
        seeds: Sequence[Seed] = (),
        saved: bool = False,
        labels: LabelVolume | None = None,
    ) -> None:
        """Raises DataError: a seed lies outside the CT, or the labels are not on its grid."""
        self.slices = HeartSlices(volume)
        self.ending: Ending | None = None
        self.labels: LabelVolume | None = labels
        self.stop_wanted = False
        self._segmenter, self._save, self._key = segmenter, save, key
        self._next_id = 1
        self._placed: tuple[_Placed, ...] = ()
        for number, seed in enumerate(seeds, 1):
            if self.slices.hanging.voxel_at(seed.position_mm) is None:
                raise DataError(f"Seed {number} ({seed.structure}) lies outside the CT: are these another CT's seeds?")
            self._placed += (self._new(seed),)
        self._undo: list[tuple[_Placed, ...]] = []
        self._redo: list[tuple[_Placed, ...]] = []
        self._saved = self._seeds if saved else None
        self._shown = _Labels()
        if labels is not None:
            self.slices.show(labels)
            self._shown = _Labels("file", volumes=volumes_ml(labels))
        self._running = self._closing = False
        self._wanted = labels is None
        self._trouble = ""
        self._doing: tuple[str, float | None] = ("", None)
        self._commands = CommandTable({
            "seeds_open": ((), lambda _: {"key": self._key}),
            "seeds_place": (("structure", "position_mm", "add?", "seed?"), self._place),
            "seeds_remove": (("seed",), self._remove),
            "seeds_undo": ((), lambda _: self._step(self._undo, self._redo)),
            "seeds_redo": ((), lambda _: self._step(self._redo, self._undo)),
            "seeds_segment": ((), lambda _: self._again()),
            "seeds_stop": ((), lambda _: self._stop()),
            "seeds_save": ((), lambda _: self._keep()),
            "seeds_done": ((), lambda _: self._done()),
        })  # fmt: skip

    @property
    def _seeds(self) -> tuple[Seed, ...]:
        return tuple(each.seed for each in self._placed)

    @property
    def _is_saved(self) -> bool:
        return self._seeds == (self._saved or ())  # where there are none, none need to be saved

    @property
    def findings(self) -> tuple[str, ...]:
        """What the last segmentation found, sentences."""
        return self._shown.findings

    @property
    def is_current(self) -> bool:
        """Whether the labels were made with the seeds as they are."""
        return self._shown.seeds == self._seeds

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Carry out a command and return its result.

        Raises:
            CathxrError: it cannot be done; the sentence says why.
        """
        return self._commands.handle(name, args)

    # --- commands -----------------------------------------------------------------------------------------------------

    def _new(self, seed: Seed) -> _Placed:
        placed = _Placed(self._next_id, seed)
        self._next_id += 1
        return placed

    def _place(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        structure = text_of(args, "structure")
        if structure not in SEEDABLE:
            raise ConfigError(f"There are no seeds for {structure[:40]!r}: choose a structure of the list.")
        position = _point(args["position_mm"])
        if self.slices.hanging.voxel_at(position) is None:
            raise ConfigError("That place lies outside the CT: click inside a slice.")
        of_structure = [each for each in self._placed if each.seed.structure == structure]
        moved = next((each for each in of_structure if each.id == args.get("seed")), of_structure[-1:] or None)
        if isinstance(moved, list):
            moved = moved[0]
        if args.get("add") is True or moved is None:
            if len(self._placed) >= MOST_SEEDS:
                raise ConfigError(f"{MOST_SEEDS} seeds are the most: delete some that are not needed.")
            placed = self._new(Seed(structure, position))
            self._change((*self._placed, placed))
        else:
            placed = _Placed(moved.id, Seed(structure, position, moved.seed.radius_mm))
            self._change(tuple(placed if each.id == placed.id else each for each in self._placed))
        return {"seed": placed.id}

    def _remove(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        left = tuple(each for each in self._placed if each.id != args["seed"])
        if len(left) == len(self._placed):
            raise ConfigError("That seed is not there any more.")
        self._change(left)
        return {}

    def _change(self, placed: tuple[_Placed, ...]) -> None:
        self._undo = [*self._undo[1 - _MOST_UNDO :], self._placed]
        self._redo = []
        self._placed = placed

    def _step(self, back: list[tuple[_Placed, ...]], forth: list[tuple[_Placed, ...]]) -> Mapping[str, Any]:
        if back:
            forth.append(self._placed)
            self._placed = back.pop()
        return {}

    def _again(self) -> Mapping[str, Any]:
        if self._running:
            raise ConfigError("The segmentation runs already: wait for it, or stop it first.")
        self._wanted = True
        return {}

    def _stop(self) -> Mapping[str, Any]:
        self.stop_wanted = self._running
        return {}

    def _keep(self) -> Mapping[str, Any]:
        seeds = self._seeds
        self._save(seeds)
        self._saved = seeds
        return {"sentence": _saved_words(seeds)}

    def _done(self) -> Mapping[str, Any]:
        """End, but not before the segmentation has stopped: its thread must not outlive the page."""
        self._closing, self.stop_wanted = True, self._running
        if self._running:
            return {}
        saved = self._is_saved
        told = _saved_words(self._seeds) if saved else "Closed; the last changes were not saved."
        self.ending = Ending(told, saved)
        return self.ending.result

    # --- segmentation -------------------------------------------------------------------------------------------------

    def take_work(self) -> tuple[Seed, ...] | None:
        """Return the seeds that a segmentation is to be begun with now, once; None for none."""
        if not self._wanted:
            return None
        self._wanted, self._running, self.stop_wanted = False, True, False
        self._trouble, self._doing = "", ("Beginning", None)
        return self._seeds

    def segment(self, seeds: tuple[Seed, ...], progress: Progress) -> Outcome:
        """Return a segmentation: the slow part, for a thread of its own. Touches no state.

        Raises: whatever the segmentation or `progress` raises.
        """
        segmented = self._segmenter(seeds, progress)
        return Outcome(segmented, volumes_ml(segmented.labels), seeds)

    def note_progress(self, what: str, share: float | None) -> None:
        """Take what the segmentation does now."""
        self._doing = (what, None if share is None else min(1.0, max(0.0, share)))

    def take_outcome(self, outcome: Outcome) -> None:
        """Take a segmentation that has ended well."""
        try:
            self.slices.show(outcome.segmented.labels)
        except CathxrError as error:
            self.take_failure(str(error))
            return
        before = self._shown.volumes
        self.labels = outcome.segmented.labels
        self._shown = _Labels("segmentation", outcome.seeds, outcome.segmented.findings, outcome.volumes, before)
        self.take_failure("")

    def take_failure(self, sentence: str) -> None:
        """Take why the segmentation has failed, "" where it has not, or was stopped: the labels stay as they are."""
        self._running = False
        self._trouble = sentence
        if self._closing:
            self._done()

    # --- state --------------------------------------------------------------------------------------------------------

    def state(self) -> HeartSeedsState:
        """Return what the page shows."""
        what, share = self._doing
        seen = self.slices.hanging
        columns = [*seen.ct_from_seen[:3].T.tolist()]
        return HeartSeedsState(
            stage="segmenting" if self._running else "failed" if self._trouble else "ready",
            advice=self._advice(),
            progress=share if self._running else None,
            doing=what if self._running else "",
            planes=[SlicePlane(**vars(seen.plane(name))) for name in PLANES],
            ct_from_seen=[(x, y, z) for x, y, z in columns],
            tilt_deg=round(seen.tilt_deg, 2),
            structures=self._structures(),
            seeds=[self._seed(each) for each in self._placed],
            labels_version=self.slices.version,
            labels_box=list(self.slices.box or ()),
            labels_from=self._shown.source,
            is_current=self.is_current,
            findings=list(self._shown.findings),
            can_undo=bool(self._undo),
            can_redo=bool(self._redo),
            saved=self._is_saved,
        )

    def _advice(self) -> str:
        if self._closing:
            return "The page closes once the segmentation has stopped."
        if self._running:
            return "The heart is being segmented; seeds may be placed meanwhile."
        if self._trouble:
            return self._trouble
        if self._shown.source == "nothing":
            return "There are no labels yet: place seeds, or segment without."
        if not self._placed:
            return "Where the labels are wrong, choose the structure and click into it in a slice."
        if not self.is_current:
            return "Segment again to see what the seeds do, or place more."
        if not self._is_saved:
            return "The labels follow the seeds: save them, or go on correcting."
        return "The seeds are saved."

    def _structures(self) -> list[HeartStructure]:
        shown = {key: number for number, key in self.slices.keys.items()}
        extra = [key for key in dict.fromkeys((*shown, *self._structures_of_seeds())) if key not in SEEDABLE]
        found = []
        for key in (*SEEDABLE, *extra):
            known = CATALOGUE.get(key)
            words = "Not heart" if key == NOTHING else key.replace("_", " ").capitalize()
            volume, before = (_rounded(each.get(key)) for each in (self._shown.volumes, self._shown.before))
            found.append(
                HeartStructure(
                    key=key, name=words if known is None else known.name,
                    colour=_UNNAMED_COLOUR if known is None else known.colour,
                    label=shown.get(key, 0), seedable=key not in extra, volume_ml=volume, before_ml=before,
                )
            )  # fmt: skip
        return found

    def _structures_of_seeds(self) -> tuple[str, ...]:
        return tuple(each.structure for each in self._seeds)

    def _seed(self, placed: _Placed) -> HeartSeed:
        hanging = self.slices.hanging
        voxel = hanging.voxel_at(placed.seed.position_mm)
        assert voxel is not None, "seeds outside are refused"
        position = tuple(round(float(each), 3) for each in placed.seed.position_mm)
        seen = tuple(round(each, 4) for each in hanging.to_seen(placed.seed.position_mm).tolist())
        return HeartSeed(
            id=placed.id, structure=placed.seed.structure, position_mm=(position[0], position[1], position[2]),
            seen=(seen[0], seen[1], seen[2]), radius_mm=placed.seed.radius_mm,
            hu=self.slices.hu_at(voxel), labelled=self.slices.key_at(voxel),
        )  # fmt: skip


def _point(value: Any) -> tuple[float, float, float]:
    numbers = [each for each in value if isinstance(each, int | float)] if isinstance(value, list) else []
    if len(numbers) != 3 or not all(math.isfinite(each) and abs(each) < 1e6 for each in numbers):
        raise ConfigError("position_mm must be three numbers: x, y and z in mm.")
    x, y, z = (round(float(each), 3) for each in numbers)
    return x, y, z


def _rounded(volume: float | None) -> float | None:
    return None if volume is None else round(volume, 2)


def _saved_words(seeds: Sequence[Seed]) -> str:
    return "There are no seeds." if not seeds else f"{len(seeds)} seed{'s are' if len(seeds) > 1 else ' is'} saved."
