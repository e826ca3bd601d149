"""What a start loads: all that tracking calls before the first live pair, and nothing that only building needs."""

import json
import subprocess
import sys
import textwrap
from typing import Any

import pytest

from cathxr.app.warm_up import scenes_for, warm_up
from cathxr.core import Status
from cathxr.storage.rig_file import example_rig
from cathxr.twin import with_readout


def _told_by(code: str) -> Any:
    """Return what a fresh interpreter prints as JSON."""
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("scene_name", ["smooth", "white", "rolling_shutter"])
def test_the_warm_up_tracks(scene_name: str) -> None:
    assert warm_up(method="model", scene_name=scene_name).status is Status.TRACKED


def test_a_box_is_warmed_up_with_what_it_needs() -> None:
    rig = example_rig()
    assert scenes_for(rig, backgrounds=False) == ("smooth",)
    rolling = with_readout(rig, 16.0)
    assert scenes_for(rolling, backgrounds=True) == ("smooth", "white", "rolling_shutter")


@pytest.mark.parametrize("more", ["skew", "white", "rolling_shutter"])
def test_nothing_is_compiled_or_loaded_for_the_first_live_pairs(more: str) -> None:
    """Of the kernels; the twin's own may come later, its cameras open in their threads."""
    left = _told_by(
        f"""
        more = {more!r}
        """
        """
        import json
        from numba.core.dispatcher import Dispatcher
        from cathxr.app.warm_up import scenes_for, warm_up
        from cathxr.app.bench_scenes import Sequence
        from cathxr.app.bench_sequence import Method

        sequences = [Sequence(name, seed=0) for name in ("smooth", more)]
        for each in scenes_for(sequences[1].rig, backgrounds=more == "white"):
            warm_up(method="model", scene_name=each)
        pairs = [list(each.pairs(4, 30.0)) for each in sequences]
        late, load = [], Dispatcher.compile

        def noted(self, signature):
            late.append(self.py_func.__name__)
            return load(self, signature)

        Dispatcher.compile = noted
        methods = [Method("model", each) for each in sequences]
        tracks = [[m.track(pair)[1] for pair in several] for m, several in zip(methods, pairs)]
        print(json.dumps([late, [each[-1].status.value for each in tracks]]))
        """
    )
    assert left == [[], ["tracked", "tracked"]]


def test_running_needs_no_library_that_only_building_needs() -> None:
    loaded = _told_by(
        """
        import json, sys
        import cathxr.app.run_command, cathxr.app.live_parts, cathxr.app.warm_up
        import cathxr.app.training_parts, cathxr.app.training_wiring, cathxr.wire.server, cathxr.wire.console
        print(json.dumps(sorted({part for name in sys.modules for part in (name, name.partition(".")[0])})))
        """
    )
    # the extra `heart`'s, and what takes long to load and is for videos, plots and https alone
    unwanted = {"SimpleITK", "vtkmodules", "trimesh", "pydicom", "skimage", "av", "matplotlib", "cryptography"}
    unwanted |= {"scipy.signal", "scipy.stats", "statsmodels", "pandas", "psycopg"}
    assert unwanted.isdisjoint(loaded)
