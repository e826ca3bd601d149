"""By how much one recorded motion lags behind another: cross-correlation, then least squares, with an honest error."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, make_smoothing_spline

from cathxr.core import CalibrationError, FloatArray

LIMIT_S = 0.4
"""Largest lag that is looked for: far more than any camera or link takes."""
SHORTEST_S = 6.0
FEWEST_TURNS = 4
LEAST_CORRELATION = 0.9
_AMBIGUOUS = 0.03
"""Another lag fits as well when 1 - correlation there is within this much (relative to what correlation can tell)."""
_GAP_PERIODS = 6.0
_STEP_S = 0.01
_ROUNDS = 12
_LEAST_STD_S = 2e-5
_EDGE_S = 0.25
"""Left out at both ends, where smoothing has only one side to go by."""
_SMOOTH_S = 0.03
"""Both signals pass the same low-pass (half amplitude at 5 Hz), whatever their rates: noise must not pose as motion."""


@dataclass(frozen=True, eq=False)
class Signal:
    """A motion as one device saw it: strictly increasing instants (N,) s on the device's stamps, values (N,)."""

    t_s: FloatArray
    value: FloatArray

    def __post_init__(self) -> None:
        if self.t_s.shape != self.value.shape or self.t_s.ndim != 1 or (np.diff(self.t_s) <= 0).any():
            raise ValueError("Signal: expected as many values as strictly increasing instants")
        if not (np.isfinite(self.t_s).all() and np.isfinite(self.value).all()):
            raise ValueError("Signal: expected finite numbers")

    def smoothed(self) -> BSpline:
        """Return the signal as a smooth function of time: a cubic spline with penalised bending."""
        rate = 1.0 / float(np.median(np.diff(self.t_s)))
        return make_smoothing_spline(self.t_s, self.value, lam=rate * _SMOOTH_S**4)

    def known_at(self, t_s: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return where the signal can be interpolated: inside, and not in a gap."""
        after = np.clip(np.searchsorted(self.t_s, t_s), 1, len(self.t_s) - 1)
        gap = self.t_s[after] - self.t_s[after - 1]
        inside = (t_s >= self.t_s[0]) & (t_s <= self.t_s[-1])
        return np.asarray(inside & (gap <= _GAP_PERIODS * np.median(np.diff(self.t_s))))


@dataclass(frozen=True, eq=False)
class Lag:
    """first(t) = offset + gain * second(t + lag_s), so `second` is stamped lag_s later than `first`.

    correlation at the best lag; std_s; hysteresis (and its std): difference between the two directions of motion, in
    the first signal's unit; lags_s, correlations: the curve; t_s, left: what the fit leaves of the first signal.
    """

    lag_s: float
    std_s: float
    gain: float
    correlation: float
    hysteresis: float
    hysteresis_std: float
    lags_s: FloatArray
    correlations: FloatArray
    t_s: FloatArray
    left: FloatArray


def lag_between(
    first: Signal, second: Signal, *, least_motion: float, names: tuple[str, str], with_hysteresis: bool = False
) -> Lag:
    """Return the lag of `second` behind `first`. least_motion: standard deviation that either must have at least.

    names: what the two are called in sentences. with_hysteresis: the first may follow the second through some play.

    Raises:
        CalibrationError: too short, too little motion, not to and fro, not the same motion, or more than one lag fits.
    """
    for signal, name in ((first, names[0]), (second, names[1])):
        _check_motion(signal, name, least_motion)
    start, end = max(first.t_s[0], second.t_s[0]), min(first.t_s[-1], second.t_s[-1])
    if end - start < SHORTEST_S:
        raise CalibrationError(
            f"{names[0]} and {names[1]} were seen together for only {max(0.0, end - start):.1f} s, {SHORTEST_S:.0f} s "
            "are needed: record 10 to 15 s of to-and-fro motion."
        )
    lags, correlations = _correlations(first, second, start + LIMIT_S, end - LIMIT_S)
    coarse = _best(lags, correlations, names)
    return _fitted(first, second, coarse, lags, correlations, with_hysteresis=with_hysteresis)


def _check_motion(signal: Signal, name: str, least: float) -> None:
    if len(signal.t_s) < 30:
        raise CalibrationError(f"{name} gave only {len(signal.t_s)} usable values: record 10 to 15 s of motion.")
    moved = float(signal.value.std())
    if moved < least:
        raise CalibrationError(
            f"{name} hardly moved ({moved:.2g}, at least {least:.2g} is needed): move the catheter to and fro by some "
            "centimetres, and turn it to and fro by a quarter turn or more."
        )
    turns = _turns(signal.value)
    if turns < FEWEST_TURNS:
        raise CalibrationError(
            f"{name} shows {turns} turns of direction, {FEWEST_TURNS} are needed: move to and fro, about every two "
            "seconds, for 10 to 15 s."
        )


def _turns(values: FloatArray) -> int:
    """Return how often a signal turns back by more than a fifth of its range."""
    room = 0.2 * float(np.ptp(values))
    low = high = float(values[0])
    rising: bool | None = None
    count = 0
    for value in values.tolist():
        low, high = min(low, value), max(high, value)
        if rising is not False and value < high - room:
            count += rising is True
            rising, low = False, value
        elif rising is not True and value > low + room:
            count += rising is False
            rising, high = True, value
    return count


def _correlations(first: Signal, second: Signal, start: float, end: float) -> tuple[FloatArray, FloatArray]:
    """Return (lags (L,), normalised correlations (L,)) on an even grid from -LIMIT_S to LIMIT_S."""
    times = np.arange(start, end, _STEP_S)
    times = times[first.known_at(times)]
    base, other = first.smoothed()(times), second.smoothed()
    steps = round(LIMIT_S / _STEP_S)
    lags = np.asarray(np.arange(-steps, steps + 1) * _STEP_S, dtype=np.float64)
    result = np.full(len(lags), -1.0)
    for index, lag in enumerate(lags):
        good = second.known_at(times + lag)
        if good.sum() > 0.5 * len(times):
            result[index] = _correlation(base[good], other(times[good] + lag), times[good])
    return lags, result


def _correlation(first: FloatArray, second: FloatArray, times: FloatArray) -> float:
    """Return the correlation of two signals without their means and slow drifts."""
    basis = np.column_stack([np.ones_like(times), times - times.mean()])
    both = np.column_stack([first, second])
    both = both - basis @ np.linalg.lstsq(basis, both, rcond=None)[0]
    norm = float(np.sqrt((both[:, 0] @ both[:, 0]) * (both[:, 1] @ both[:, 1])))
    return float(both[:, 0] @ both[:, 1]) / norm if norm > 0 else -1.0


def _best(lags: FloatArray, correlations: FloatArray, names: tuple[str, str]) -> float:
    """Return the lag of the highest peak."""
    best = int(np.argmax(correlations))
    height = float(correlations[best])
    if height < LEAST_CORRELATION:
        raise CalibrationError(
            f"{names[0]} and {names[1]} do not show the same motion (correlation {max(0.0, height):.2f}, "
            f"{LEAST_CORRELATION} is needed): check that both follow the same catheter, and repeat with a steady bend."
        )
    inner = correlations[1:-1]
    peaks = np.flatnonzero((inner >= correlations[:-2]) & (inner > correlations[2:])) + 1
    rivals = [each for each in peaks if each != best and correlations[each] > height - _AMBIGUOUS]
    if rivals:
        apart = abs(float(lags[rivals[0]] - lags[best]))
        raise CalibrationError(
            f"The motion repeats every {apart:.2f} s, so that lags of {lags[best]:+.2f} s and {lags[rivals[0]]:+.2f} s "
            "fit alike: move more slowly (about two seconds to and fro) or less evenly."
        )
    if best in (0, len(lags) - 1):
        raise CalibrationError(
            f"{names[1]} seems more than {LIMIT_S:.1f} s away from {names[0]} in time, which no device is: check that "
            "both share one clock, and move less evenly."
        )
    return float(lags[best])


def _fitted(
    first: Signal, second: Signal, lag: float, lags: FloatArray, correlations: FloatArray, *, with_hysteresis: bool
) -> Lag:
    """Return the lag by Gauss-Newton, with its error from the residuals of blocks longer than what they remember."""
    spline = second.smoothed()
    slope = spline.derivative()
    start, end = max(first.t_s[0], second.t_s[0] - lag) + _EDGE_S, min(first.t_s[-1], second.t_s[-1] - lag) - _EDGE_S
    inside = (first.t_s > start) & (first.t_s < end) & second.known_at(first.t_s + lag)
    times = first.t_s[inside]
    values = first.smoothed()(times)
    centred = times - times.mean()
    gain, design, left = 1.0, np.empty((0, 0)), values
    solution = np.zeros(0)
    for _ in range(_ROUNDS):
        at = times + lag
        rate = slope(at)
        columns = [gain * rate, spline(at), np.ones_like(at), centred]
        if with_hysteresis:
            columns.append(Signal(times, 0.5 * _direction(rate)).smoothed()(times))
        design = np.column_stack(columns)
        solution, *_ = np.linalg.lstsq(design, values, rcond=None)
        lag, gain = lag + float(solution[0]), float(solution[1])
        left = values - design @ solution
        if abs(solution[0]) < 1e-9:
            break
    covariance = _sandwich(times, design, left)
    hysteresis = (float(solution[4]), float(np.sqrt(covariance[4, 4]))) if with_hysteresis else (0.0, 0.0)
    best, std = float(np.max(correlations)), max(_LEAST_STD_S, float(np.sqrt(covariance[0, 0])))
    return Lag(lag, std, gain, best, *hysteresis, lags, correlations, times, left)


def _direction(rate: FloatArray) -> FloatArray:
    """Return the direction of motion (N,), +1 or -1, kept where it all but stands still."""
    quick = np.abs(rate) > 0.05 * float(np.abs(rate).max())
    last = np.maximum.accumulate(np.where(quick, np.arange(len(rate)), 0))
    sign = np.sign(rate[last])
    return np.asarray(np.where(sign == 0, 1.0, sign), dtype=np.float64)


def _sandwich(times: FloatArray, design: FloatArray, left: FloatArray) -> FloatArray:
    """Return the covariance of a least-squares solution whose residuals remember the recent past.

    Scores are summed over blocks (Huber's sandwich with clusters); blocks are four correlation times long, 0.3 to 2 s.
    """
    period = float(np.median(np.diff(times)))
    length = float(np.clip(4.0 * _memory(left) * period, 0.3, 2.0))
    block = np.floor((times - times[0]) / length).astype(int)
    inverse = np.linalg.pinv(design.T @ design, hermitian=True)
    scores = np.zeros((block.max() + 1, design.shape[1]))
    np.add.at(scores, block, design * left[:, None])
    count = len(np.unique(block))
    spare = max(1, count - design.shape[1])
    return np.asarray(inverse @ (scores.T @ scores) @ inverse * count / spare, dtype=np.float64)


def _memory(left: FloatArray) -> float:
    """Return the correlation time in samples: the sum of the autocorrelation until it first falls below zero."""
    centred = left - left.mean()
    power = float(centred @ centred)
    total = 1.0
    for step in range(1, len(left) // 4):
        share = float(centred[step:] @ centred[:-step]) / max(power, 1e-300)
        if share <= 0.0:
            break
        total += 2.0 * share
    return total
