"""The heart's part of `cathxr bench`: the built-in heart's labels made into a heart folder again."""

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cathxr.app.heart_threads import side_by_side
from cathxr.heart import builtin_path, read_heart
from cathxr.heart.build import LABELS, build_heart
from cathxr.heart.jobs import Together, one_after_another
from cathxr.heart.reading import read_labels


@dataclass(frozen=True)
class Spent:
    """Seconds of wall clock and of all cores' processor time."""

    wall_s: float
    cpu_s: float


def build_times() -> Mapping[str, Spent]:
    """Return what a build takes, by how its independent jobs are run; in one run, after one that is not counted."""
    source = read_heart(builtin_path())
    labels = read_labels(builtin_path() / LABELS, like=None)
    ways: Mapping[str, Together] = {"one after another": one_after_another, "side by side": side_by_side}
    spent: dict[str, Spent] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, together in [("", side_by_side), *ways.items()]:
            begun, cpu = time.perf_counter(), time.process_time()
            build_heart(
                Path(folder) / "heart",
                volume=None,
                labels=labels,
                source=source.source,
                name=source.name,
                together=together,
            )
            spent[name] = Spent(time.perf_counter() - begun, time.process_time() - cpu)
    del spent[""]
    return spent
