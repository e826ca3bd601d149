"""A tracked pair at steady state: compiled code allocates nothing, and the rest no more than the records it returns."""

import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import _nrt_python as counters
from numba.core.runtime import rtsys

from cathxr.app.bench_scenes import ScenePair, Sequence
from cathxr.app.bench_sequence import Method
from cathxr.core import Status

_BEFORE, _PAIRS = 8, 12
_RECORDS_BYTES = 100_000
"""Both Detections, the Observation and the Track: two views of at most 111 midline points of 7 numbers and 96 outline
points of 3, and 50 points of 3 numbers, all of 8 bytes, are 18 kB; NumPy's temporary copies while they are checked,
and Python's own objects, are a few times that. A picture is 2.8 MB, one grey level of it 0.9 MB."""


@pytest.fixture(scope="module")
def pairs() -> list[ScenePair]:
    return list(Sequence("flexion", seed=3).pairs(_BEFORE + _PAIRS, 30.0))


@pytest.fixture
def steady(pairs: list[ScenePair]) -> tuple[Method, list[ScenePair]]:
    """A method that has tracked the first pairs, so that everything is loaded, and the others."""
    method = Method("model", Sequence("flexion", seed=3))
    for pair in pairs[:_BEFORE]:
        method.track(pair)
    return method, pairs[_BEFORE:]


def _arrays(value: Any) -> int:
    """How many arrays compiled code is handed: each gets a small descriptor, which is counted as an allocation."""
    if isinstance(value, np.ndarray):
        return 1
    return sum(_arrays(each) for each in value) if isinstance(value, tuple) else 0


def _counting(kernel: Dispatcher, calls: Counter[str], made: Counter[str]) -> Callable[..., Any]:
    name = kernel.py_func.__name__

    def counted(*args: Any) -> Any:
        before = rtsys.get_allocation_stats().alloc
        result = kernel(*args)
        calls[name] += 1
        made[name] += rtsys.get_allocation_stats().alloc - before - _arrays(args)
        return result

    return counted


def test_compiled_code_allocates_nothing(
    steady: tuple[Method, list[ScenePair]], monkeypatch: pytest.MonkeyPatch
) -> None:
    method, rest = steady
    calls: Counter[str] = Counter()
    made: Counter[str] = Counter()
    for name, module in list(sys.modules.items()):
        if not name.startswith(("cathxr.vision", "cathxr.tracking", "cathxr.geometry")):
            continue
        for key, value in list(vars(module).items()):
            if isinstance(value, Dispatcher):
                monkeypatch.setattr(module, key, _counting(value, calls, made))
    enabled = counters.memsys_stats_enabled()
    counters.memsys_enable_stats()
    try:
        for pair in rest:
            observation, track, _ = method.track(pair)
            assert observation.predicted
            assert track.status is Status.TRACKED
    finally:
        if not enabled:
            counters.memsys_disable_stats()
    assert calls["measure"] == 2 * len(rest)
    assert calls["gauss_newton"] >= len(rest)
    assert {name: count for name, count in made.items() if count} == {}


def test_a_pair_takes_no_more_memory_than_its_records(steady: tuple[Method, list[ScenePair]]) -> None:
    method, rest = steady
    tracemalloc.start()
    try:
        kept, peaks = [], []
        for pair in rest:
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            kept.append(method.track(pair)[1])
            peaks.append(tracemalloc.get_traced_memory()[1] - before)
    finally:
        tracemalloc.stop()
    assert all(each.status is Status.TRACKED for each in kept)
    assert max(peaks) < _RECORDS_BYTES
