"""The board's clock in the host's: lateness, drift, the 32-bit wrap."""

import numpy as np
import pytest

from cathxr.devices.encoder_clock import BoardClock

LEAST_NS = 3_000_000
"""Latch to arrival at the least: it stays in the stamps."""


def stamps(
    *,
    seconds: float,
    drift: float = 0.0,
    start_us: int = 0,
    lateness_s: float = 0.001,
    batch: int = 1,
    rate: float = 200,
) -> np.ndarray:
    """Return the error of every stamp, seconds, for reports that come late by an exponential time, in batches."""
    rng = np.random.default_rng(3)
    clock, errors = BoardClock(), []
    latched = 10**12 + (np.arange(int(seconds * rate)) * 1e9 / rate).astype(np.int64)
    board_us = (start_us + (latched - latched[0]) * (1 - drift) / 1000).astype(np.int64) // 4 * 4
    arrived = latched + LEAST_NS + rng.exponential(lateness_s * 1e9, len(latched)).astype(np.int64)
    last = len(latched) - len(latched) % batch
    for begin in range(0, last, batch):
        arrival = int(arrived[begin : begin + batch].max())
        for index in range(begin, begin + batch):
            stamp = clock.stamp_ns(int(board_us[index]) % 2**32, arrival)
            assert stamp <= arrival
            errors.append((stamp - latched[index] - LEAST_NS) * 1e-9)
    return np.array(errors)


@pytest.mark.parametrize("drift", [0.0, 50e-6, -50e-6, 0.005, -0.005])
def test_stamps_are_right_whatever_the_clocks_rate(drift: float) -> None:
    errors = stamps(seconds=60, drift=drift)
    settled = errors[400:]
    # 50 arrivals in every quarter of a second, each late by 1 ms in the mean: the earliest of them by 20 us in the
    # mean. The line through two such points is off by no more than a few times that; micros() has steps of 4 us.
    assert np.abs(settled).max() < 0.0003
    # At first drift cannot be told from lateness: 0.5 % over the second until it can.
    assert np.abs(errors).max() < 0.0002 + 1.1 * max(abs(drift), 0.005)


def test_batches_of_a_usb_adapter_do_not_blur_them() -> None:
    # An FTDI adapter hands over every 16 ms: three or four reports at a time, of which the last came just now.
    errors = stamps(seconds=30, drift=0.002, batch=4)
    assert np.abs(errors[400:]).max() < 0.0005


def test_the_wrap_of_the_32_bit_microseconds_is_nothing() -> None:
    errors = stamps(seconds=20, start_us=2**32 - 10_000_000, drift=50e-6)
    assert np.abs(errors[400:]).max() < 0.0003


def test_a_long_pause_is_bridged() -> None:
    clock = BoardClock()
    for index in range(1000):
        clock.stamp_ns(5000 * index, 10**12 + 5_000_000 * index)
    pause_us = 3_600_000_000
    arrival = 10**12 + 5_000_000 * 1000 + 1000 * pause_us
    assert abs(clock.stamp_ns((5_000_000 + pause_us) % 2**32, arrival) - arrival) < 1000


def test_drift_is_measured() -> None:
    clock = BoardClock()
    for index in range(4000):
        clock.stamp_ns(5000 * index, round(10**12 + 5_000_000 * index * 1.003))
    assert clock.drift == pytest.approx(0.003, abs=1e-6)
