"""A calibration with the encoder running: one thread reads it, another gives all that came to the task."""

from cathxr.core import Clock, Reading, Source
from cathxr.runtime.calibration_running import Outlet, RunningCalibration
from cathxr.runtime.calibration_task import ReadingsTask
from cathxr.runtime.queues import Queue
from cathxr.runtime.supervisor import DeviceThread

ENCODER = "encoder"
_STEP_S = 0.05
"""How often the page is told: a hand is slower than that."""
_HELD = 4096


class ReadingsCalibration(RunningCalibration):
    """Runs a ReadingsTask. A context manager: entering starts it, leaving stops it.

    Unlike pictures, no reading is passed over: a turning point may be in any of them.
    """

    _what = "a reading"

    def __init__(self, task: ReadingsTask, encoder: Source[Reading], *, outlet: Outlet, clock: Clock) -> None:
        self._readings: Queue[Reading] = Queue(_HELD)
        device = DeviceThread(ENCODER, encoder, self._readings.put, clock=clock)
        super().__init__(task, {ENCODER: device}, outlet=outlet, clock=clock)
        self._task = task

    def _look_once(self) -> None:
        self._stopping.wait(_STEP_S)
        readings = []
        while (reading := self._readings.get(0.0)) is not None:
            readings.append(reading)
        if not self._stopping.is_set():
            self._guarded(lambda: self._give(readings))

    def _give(self, readings: list[Reading]) -> None:
        with self._lock:
            if self._task.ending is None:
                self._task.take(readings)
                self._after_change()
