"""A calibration with pictures running: a thread for each camera, one that looks at the newest pictures of each.

A picture that nobody has looked at when the next one comes is passed over: the page shows the present.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any, Self

from cathxr.core import Clock, Image, Source
from cathxr.runtime.calibration_running import Outlet, RunningCalibration
from cathxr.runtime.calibration_task import Task
from cathxr.runtime.queues import Queue
from cathxr.runtime.supervisor import DeviceThread

_WAIT_S = 0.1


class LiveCalibration(RunningCalibration):
    """Runs a Task with pictures. A context manager: entering starts it, leaving stops it.

    sources: the cameras by the name that their pictures have; each picture that was looked at is published, and then
    the state that belongs to it. stills: pictures that do not change, published once.
    """

    def __init__(
        self,
        task: Task[Any],
        sources: Mapping[str, Source[Image]],
        *,
        outlet: Outlet,
        clock: Clock,
        stills: tuple[Image, ...] = (),
    ) -> None:
        devices = {
            name: DeviceThread(name, source, partial(self._take, name), clock=clock) for name, source in sources.items()
        }
        super().__init__(task, devices, outlet=outlet, clock=clock)
        self._task, self._stills = task, stills
        self._newest: dict[str, Queue[Image]] = {name: Queue(1) for name in sources}

    def __enter__(self) -> Self:
        for image in self._stills:
            self._outlet.publish_picture(image, seq=image.seq)
        return super().__enter__()

    def _take(self, name: str, image: Image) -> None:
        self._newest[name].put(image)
        self._arrived.set()

    def _look_once(self) -> None:
        """Look at the newest picture of each camera in turn."""
        self._arrived.wait(_WAIT_S)
        self._arrived.clear()
        for name in self._newest:
            image = self._newest[name].get(0.0)
            if image is not None and not self._stopping.is_set():
                self._guarded(partial(self._look_at, image))

    def _look_at(self, image: Image) -> None:
        found = self._task.examine(image)
        with self._lock:
            if self._task.ending is not None:
                return
            self._task.look(image, found)
            self._outlet.publish_picture(image, seq=image.seq)
            self._after_change()
