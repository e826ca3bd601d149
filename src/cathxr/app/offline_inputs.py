"""The inputs and outputs of `cathxr track`, all looked at before any work starts."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cathxr.app.offline_pairs import pair_count
from cathxr.app.offline_roll import RecordedCounts
from cathxr.core import ConfigError, PixelArray, Rig
from cathxr.storage.atomic import check_writable
from cathxr.storage.pictures import Pictures, check_size, open_pictures, read_picture
from cathxr.storage.rig_file import read_rig
from cathxr.storage.tables import PictureTimes, read_roll, read_times


@dataclass(frozen=True)
class TrackOptions:
    """What a person asked `cathxr track` for."""

    rig: Path
    top: Path
    front: Path
    out: Path
    times: Path | None = None
    roll: Path | None = None
    method: str = "model"
    points: int = 50
    background_top: Path | None = None
    background_front: Path | None = None
    overlay: Path | None = None


@dataclass(frozen=True, eq=False)
class TrackInputs:
    """What was found at those paths. pair_count: None when only the end of the videos tells."""

    rig: Rig
    top: Pictures
    front: Pictures
    times: PictureTimes | None
    counts: RecordedCounts | None
    backgrounds: Mapping[str, PixelArray]
    pair_count: int | None
    notes: tuple[str, ...]


def open_inputs(options: TrackOptions) -> TrackInputs:
    """Return the inputs after checking them and the places of the outputs.

    Raises:
        ConfigError, DataError: one sentence about the first thing that is wrong.
    """
    _check_outputs(options)
    rig = read_rig(options.rig)
    top = open_pictures(options.top, rig.cameras["top"])
    front = open_pictures(options.front, rig.cameras["front"])
    times = None if options.times is None else read_times(options.times)
    if options.roll is not None and rig.roll is None:
        raise ConfigError(
            f"{options.rig}: --roll needs the rig's table [roll] (counts per turn, gear ratio, zero), and there is none"
            "; add it or leave --roll out."
        )
    counts = None if options.roll is None else RecordedCounts(read_roll(options.roll), rig.roll)
    backgrounds = {}
    for name, path in (("top", options.background_top), ("front", options.background_front)):
        if path is not None:
            backgrounds[name] = read_picture(path)
            height, width = backgrounds[name].shape[:2]
            check_size((width, height), rig.cameras[name], where=str(path))
    notes = []
    if backgrounds and options.method == "paper":
        notes.append("the paper method does not use background pictures")
    return TrackInputs(rig, top, front, times, counts, backgrounds, pair_count(top, front, times), tuple(notes))


def _check_outputs(options: TrackOptions) -> None:
    """Return when the outputs can be made and are none of the inputs.

    Raises:
        ConfigError, DataError: they cannot or are.
    """
    inputs = {
        "--rig": options.rig, "--top": options.top, "--front": options.front, "--times": options.times,
        "--roll": options.roll, "--background-top": options.background_top,
        "--background-front": options.background_front,
    }  # fmt: skip
    taken = {os.path.realpath(path): name for name, path in inputs.items() if path is not None}
    if os.path.realpath(options.top) == os.path.realpath(options.front):
        raise ConfigError(f"{options.top}: --top and --front are the same; give each camera's own pictures.")
    for name, path, what in (("--out", options.out, "the table"), ("--overlay", options.overlay, "the overlay video")):
        if path is None:
            continue
        real = os.path.realpath(path)
        if real in taken:
            raise ConfigError(f"{path}: {name} is the same file as {taken[real]}; choose another name for the output.")
        taken[real] = name
        check_writable(path, what=what)
