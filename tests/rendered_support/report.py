"""The document about the rendered recordings: a table, and a sheet with a picture of each."""

import re
from collections import Counter
from pathlib import Path

import cv2
import numpy as np

from cathxr.core import PixelArray, Status
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import read_rig
from cathxr.storage.track_csv import read_track_csv

from .score import Score
from .worlds import World

_COLUMNS, _TILE = 6, (280, 210)
_LINE = (60, 200, 255)
"""BGR of the tracked centreline, thinner than the catheter."""

_INTRODUCTION = """\
# Proof: pictures of another renderer

The digital twin and the tracker were made by the same people, so that both may share a mistake. These recordings are
drawn by a path tracer instead (Mitsuba 3): two glowing panels that also light the catheter from the side, walls that
reflect, coloured and metal surfaces, a thin lens, distortion, vignetting, noise, gamma, sharpening and JPEG.
**Synthetic** pictures with exact truth and exact rigs, {pairs} pairs each at 30 pairs/s, through `cathxr track`.
Made by `make prove ARGS="tests/e2e/test_rendered.py"`, which draws every recording anew. What each is made of is in
`tests/rendered_support/worlds.py`: 1280x720, 9F and a rounded end where nothing else is said here.

![A top picture of each recording, with the tracked centreline](images/proof-rendered.jpg)

Errors are of tracked pairs; of the others the status says that they are not. Error / sigma: RMS of the tip's error over
the `sigma_mm` of its pair, 1 where that is honest.

"""

Scores = list[tuple[World, Score]]


def folder_of(root: Path, world: World) -> Path:
    """Return where a recording is kept below `root`."""
    return root / world.name.replace(" ", "_")


def write_report(docs: Path, root: Path, scores: Scores, *, pairs: int) -> None:
    """Write docs/proof-rendered.md and its picture; each recording is below `root`, with its track.csv."""
    tracked = sum(len(score.tip_mm) for _, score in scores)
    wrong = sum(score.wrong for _, score in scores)
    text = (
        _INTRODUCTION.format(pairs=pairs)
        + "| recording | what | tracked | tip mean / p95 / max, mm | shape mean, mm | tangent, ° | error / sigma |\n"
        "|---|---|---|---|---|---|---|\n" + "\n".join(_row(*each) for each in scores) + "\n\n"
        f"Tracked with a tip that is more than 2 mm off: {wrong} of {tracked}.\n\n"
        f"Why pairs were not tracked: {_reasons(scores)}.\n"
    )
    (docs / "proof-rendered.md").write_text(text, encoding="utf-8", newline="\n")
    sheet = _sheet([_tile(folder_of(root, world), world.name) for world, _ in scores])
    if not cv2.imwrite(str(docs / "images" / "proof-rendered.jpg"), sheet, [cv2.IMWRITE_JPEG_QUALITY, 85]):
        raise OSError("the picture of the report cannot be written")


def _row(world: World, score: Score) -> str:
    tip = score.tip_mm
    return (
        f"| {world.name} | {world.what} | {100.0 * score.tracked:.0f} % | "
        f"{tip.mean():.3f} / {np.percentile(tip, 95):.3f} / {tip.max():.3f} | {score.shape_mm.mean():.3f} | "
        f"{score.direction_deg.mean():.2f} | {score.normalised_rms:.2f} |"
    )


def _reasons(scores: Scores) -> str:
    counts: Counter[str] = Counter()
    for _, score in scores:
        for reason, count in score.reasons.items():
            counts[re.sub(r" by [\d.]+ px", "", reason)] += count
    return "; ".join(f"{reason} ({count})" for reason, count in counts.most_common()) or "all were"


def _sheet(tiles: list[PixelArray]) -> PixelArray:
    """Return the tiles in rows of _COLUMNS on black."""
    blank = np.zeros_like(tiles[0])
    whole = tiles + [blank] * (-len(tiles) % _COLUMNS)
    return np.vstack([np.hstack(whole[at : at + _COLUMNS]) for at in range(0, len(whole), _COLUMNS)])


def _tile(folder: Path, name: str) -> PixelArray:
    """Return the picture in the middle of a recording, small, with what was tracked on it."""
    rows = read_track_csv(folder / "track.csv")
    row = next((each for each in rows[len(rows) // 2 :] if each.status is Status.TRACKED), rows[-1])
    picture = np.asarray(cv2.imread(str(folder / "top" / f"{row.seq:05d}.png")), dtype=np.uint8)
    scale = _TILE[1] / picture.shape[0]
    small = np.asarray(cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    if row.shape_box is not None:
        seen = CameraModel.of(read_rig(folder / "rig.toml").cameras["top"]).project(row.shape_box)
        line = np.round(16.0 * (scale * (seen + 0.5) - 0.5)).astype(np.int32)
        cv2.polylines(small, [line], False, _LINE, 1, cv2.LINE_AA, shift=4)
    cut = (small.shape[1] - _TILE[0]) // 2
    tile = np.ascontiguousarray(small[:, cut : cut + _TILE[0]])
    cv2.rectangle(tile, (0, 0), (9 * len(name) + 12, 20), (0, 0, 0), cv2.FILLED)
    cv2.putText(tile, name, (6, 15), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 1, cv2.LINE_AA)
    return tile
