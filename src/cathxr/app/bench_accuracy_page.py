"""The measured part of docs/accuracy.md: tables of the error budget, and its pictures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from cathxr.app.bench_accuracy import CLEAN, FROZEN, Errors, calibration_alone, measured
from cathxr.app.bench_accuracy_plots import place_picture, speed_picture
from cathxr.app.bench_tables import table
from cathxr.storage.rig_file import example_rig

BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"
_FIRST_SEED = 3
_DRAWS = 200
_GRID = (9, 13, 13)
_PLACES = ("smooth", "flexion", "insertion", "fast", "quick")
_BUDGETED = ("smooth", "quick")
_CLEANER: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {"clean": CLEAN, "frozen": MappingProxyType({**CLEAN, **FROZEN})}
)
_SKEWS_MS = (0.0, 8.0, 16.0)
_EXPOSURES_MS = (0.0, 4.0, 8.0)
SETTINGS = len(_PLACES) + len(_BUDGETED) * len(_CLEANER) + len(_SKEWS_MS) - 1 + len(_EXPOSURES_MS) - 1
"""How many settings are measured."""


@dataclass(frozen=True)
class Amount:
    """How much is measured of each setting: pairs of each sequence, and how many sequences."""

    pairs: int
    sequences: int
    rate_hz: float

    @property
    def seeds(self) -> tuple[int, ...]:
        """The sequences' seeds."""
        return tuple(range(_FIRST_SEED, _FIRST_SEED + self.sequences))


def accuracy_part(amount: Amount, *, pictures: Path | None, progress: Callable[[], None]) -> str:
    """Return the tables in Markdown, and write the pictures into the folder `pictures` where there is one.

    progress: called after each pair.
    """

    def errors(scene: str, changes: Mapping[str, Any] | None = None) -> tuple[Errors, Errors]:
        return measured(
            scene, seeds=amount.seeds, pairs=amount.pairs, rate_hz=amount.rate_hz, changes=changes, progress=progress
        )

    places = {scene: errors(scene) for scene in _PLACES}
    cleaner = {scene: {name: errors(scene, changes)[0] for name, changes in _CLEANER.items()} for scene in _BUDGETED}
    quick = places["quick"][0]
    exposures = {ms: quick if ms == 8.0 else errors("quick", {"exposure_ms": ms})[0] for ms in _EXPOSURES_MS}
    skews = {ms: quick if ms == 0.0 else errors("quick", {"front_skew_ms": ms})[0] for ms in _SKEWS_MS}
    alone = _alone()
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        place_picture(places, alone, pictures / "accuracy-roi.png")
        speed_picture(exposures, pictures / "accuracy-speed.png")
    return "\n\n".join(
        [
            f"{amount.sequences} sequences of {amount.pairs} synthetic pairs (the digital twin) for each line, "
            f"{amount.rate_hz:g} pairs/s, method `model`, 1280x720, 9F. RMS is what adds up in squares.",
            _budget(places, cleaner, alone),
            _everywhere(places),
            _timing(skews, exposures),
        ]
    )


@dataclass(frozen=True, eq=False)
class Alone:
    """The calibration's own error: points_box (N, 3) mm of a grid over the ROI, rms_mm (N,) each, shape of the grid."""

    points_box: Any
    rms_mm: Any
    shape: tuple[int, int, int]


def _alone() -> Alone:
    roi = example_rig().roi
    axes = [np.linspace(roi.min_mm[i], roi.max_mm[i], n) for i, n in enumerate(_GRID)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Alone(points, calibration_alone(points, draws=_DRAWS, seed=_FIRST_SEED), _GRID)


def _line(name: str, errors: Errors) -> tuple[str, ...]:
    share = 100.0 * len(errors.tip_mm) / max(errors.pairs, 1)
    shape = float(np.mean(errors.shape_mm)) if errors.shape_mm else float("nan")
    return (
        name, f"{share:.1f} %", f"{errors.mean_mm:.4f}", f"{errors.rms_mm:.4f}", f"{errors.quantile_mm(0.95):.4f}",
        f"{shape:.4f}",
    )  # fmt: skip


_HEAD = ("tracked", "tip mean, mm", "tip RMS, mm", "tip p95, mm", "shape mean, mm")


def _budget(
    places: Mapping[str, tuple[Errors, Errors]], cleaner: Mapping[str, Mapping[str, Errors]], alone: Alone
) -> str:
    """Return what is left when one part after the other is switched off, and the parts."""
    rows, parts = [], []
    for scene in _BUDGETED:
        exact, posed = places[scene]
        clean, frozen = cleaner[scene]["clean"], cleaner[scene]["frozen"]
        rows += [
            _line(f"{scene}: everything", posed),
            _line(f"{scene}: exact camera poses", exact),
            _line(f"{scene}: and no sensor noise", clean),
            _line(f"{scene}: and no motion while the shutter is open", frozen),
        ]
        parts.append(
            (
                scene, _part(posed, exact), _part(exact, clean), _part(clean, frozen), f"{frozen.rms_mm:.4f}",
                f"{posed.rms_mm:.4f}",
            )
        )  # fmt: skip
    head = ("scene", "calibration", "detection (noise)", "timing (exposure)", "model (what is left)", "all")
    return (
        "### The budget\n\nOne part after the other is switched off:\n\n"
        + table(("", *_HEAD), rows)
        + "\n\nThe parts, RMS at the tip, mm: each the root of the difference of two squares above.\n\n"
        + table(head, parts)
        + f"\n\nCalibration by geometry alone ({_DRAWS} draws of both poses, points seen exactly): RMS "
        f"{float(np.sqrt(np.mean(np.square(alone.rms_mm)))):.3f} mm over the ROI, {float(alone.rms_mm.min()):.3f} mm "
        f"where it is best and {float(alone.rms_mm.max()):.3f} mm in the worst corner."
    )


def _part(more: Errors, less: Errors) -> str:
    """Return the root of the difference of two mean squares; nothing to be seen where it is not positive."""
    square = more.rms_mm**2 - less.rms_mm**2
    return f"{np.sqrt(square):.4f}" if square > 0.0 else "none seen"


def _everywhere(places: Mapping[str, tuple[Errors, Errors]]) -> str:
    rows = []
    for scene, (exact, posed) in places.items():
        rows += [_line(f"{scene}: exact poses", exact), _line(f"{scene}: poses from fiducials", posed)]
    return (
        "### Over the ROI and over speed\n\n"
        + table(("", *_HEAD), rows)
        + "\n\n![Tip error along x, y and z of the box, and the calibration's own error over the ROI]"
        "(images/accuracy-roi.png)\n\n![Tip error over the tip's speed](images/accuracy-speed.png)"
    )


def _timing(skews: Mapping[float, Errors], exposures: Mapping[float, Errors]) -> str:
    rows = [_line(f"front camera {ms:g} ms later, exposure 8 ms", each) for ms, each in skews.items()]
    rows += [_line(f"no skew, exposure {ms:g} ms", each) for ms, each in exposures.items()]
    speed = np.array(skews[0.0].speed_mm_s)
    return (
        f"### Timing\n\nScene quick, exact poses; the tip moves at {speed.mean():.0f} mm/s on average and "
        f"{speed.max():.0f} mm/s at most.\n\n" + table(("", *_HEAD), rows)
    )


def written_between(text: str, measured_part: str) -> str:
    """Return a page with what stands between its two markers replaced; the part alone where it has none."""
    if BEGIN not in text or END not in text:
        return f"# Accuracy\n\n{BEGIN}\n{measured_part}\n{END}\n"
    head, _, rest = text.partition(BEGIN)
    return f"{head}{BEGIN}\n{measured_part}\n{END}{rest.partition(END)[2]}"
