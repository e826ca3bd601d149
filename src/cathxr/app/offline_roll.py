"""The encoder's count at the instants of recorded pictures, without play. The same rules as live: runtime.history."""

import numpy as np
from numpy.typing import NDArray

from cathxr.core import Roll
from cathxr.geometry.roll import RollFollower
from cathxr.storage.tables import RollCounts

_GAP_PERIODS = 5


class RecordedCounts:
    """Counts at any instant of a recording: linear between two readings, predicted for one sample period at most.

    The play of the gears is taken out: `Roll.angle_rad` of what `at` returns is the roll.
    """

    def __init__(self, readings: RollCounts, roll: Roll | None = None) -> None:
        """Take the readings; of several at one instant the last one counts. roll: whose play, None for no play."""
        last: NDArray[np.bool_] = np.append(np.diff(readings.t_ns) > 0, True)
        self._t_ns = readings.t_ns[last]
        self._count = readings.count[last]
        follower = None if roll is None else RollFollower(roll)
        # Every reading shows which way the gears turn, those between two pictures, too.
        followed = [0.0 if follower is None else follower.corrected(each) - each for each in map(float, readings.count)]
        self._offset = np.array(followed)[last]
        self._period_ns = float(np.median(np.diff(self._t_ns))) if len(self._t_ns) > 1 else None

    def at(self, t_ns: int) -> float | None:
        """Return the real-valued count at `t_ns`; None before the first reading, in a gap, or too late after the last.

        A gap is a stretch of more than five sample periods (their median) without a reading.
        """
        index = int(np.searchsorted(self._t_ns, t_ns))
        if index < len(self._t_ns) and self._t_ns[index] == t_ns:
            return float(self._count[index] + self._offset[index])
        if index == 0 or self._period_ns is None:
            return None
        is_predicted = index == len(self._t_ns)
        first = index - 2 if is_predicted else index - 1
        start_ns, end_ns = (int(each) for each in self._t_ns[first : first + 2])
        if end_ns - start_ns > _GAP_PERIODS * self._period_ns or (is_predicted and t_ns - end_ns > self._period_ns):
            return None
        along = (t_ns - start_ns) / (end_ns - start_ns)
        count = float(self._count[first] + along * (self._count[first + 1] - self._count[first]))
        # A prediction keeps the last side: the gears' change of sides is not something to go on in a straight line.
        share = 1.0 if is_predicted else along
        return count + float(self._offset[first] + share * (self._offset[first + 1] - self._offset[first]))
