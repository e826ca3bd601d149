"""From expected light to a noisy 8-bit picture: shot and read noise, gain changes, saturation. Numba, no GIL."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
NOISE_STEPS = 16.0
"""Steps of the noise bank per standard deviation."""
LEVEL_STEPS = 64.0
"""Steps of the level table per DN; int16 then reaches 511 DN."""


def noise_bank(rng: np.random.Generator, *, size: int) -> NDArray[np.int8]:
    """Return (size,) samples of a standard normal in steps of 1/NOISE_STEPS."""
    normal = rng.standard_normal(size, dtype=np.float32) * NOISE_STEPS
    return np.asarray(np.clip(np.rint(normal), -127, 127), dtype=np.int8)


def level_table(level: Float32) -> NDArray[np.int16]:
    """Return levels (H, W, 3), DN, as fixed-point numbers in steps of 1/LEVEL_STEPS, at most 500 DN."""
    steps = np.clip(level, np.float32(0.0), np.float32(500.0))
    steps *= np.float32(LEVEL_STEPS)
    return np.rint(steps, out=steps).astype(np.int16)


def deviation_table(level: Float32, *, read_noise_dn: float, electrons_per_dn: float) -> NDArray[np.uint8]:
    """Return the noise's standard deviation (H, W, 3) in steps of 1/16 DN (at most 15.9 DN)."""
    # In place and in single precision: a large picture's temporary arrays are most of the time.
    steps = np.maximum(level, np.float32(0.0))
    steps *= np.float32(1.0 / electrons_per_dn)
    steps += np.float32(read_noise_dn**2)
    np.sqrt(steps, out=steps)
    steps *= np.float32(16.0)
    np.rint(steps, out=steps)
    return np.minimum(steps, np.float32(255.0), out=steps).astype(np.uint8)


@njit(cache=True, nogil=True, inline="always")
def _hashed(key: np.uint64, row: int) -> np.uint64:
    """Return a well-mixed number of a picture's key and a row (SplitMix64's finaliser; Steele et al., OOPSLA 2014)."""
    x = key + np.uint64(row) * np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@njit(cache=True, nogil=True, fastmath=True)
def expose(level, deviation, gain, bank, key, out):  # type: ignore[no-untyped-def]
    """Fill out (H, 3 W) uint8 with a picture of what does not move.

    level (H, 3 W) int16 and deviation (H, 3 W) uint8: the tables above; gain (3 W,) float32 for column and channel;
    bank: `noise_bank`, of which each row takes a stretch chosen by `key`, so that no two pictures are the same.
    """
    height, width = out.shape
    to_level, to_noise = np.float32(1.0 / LEVEL_STEPS), np.float32(1.0 / (16.0 * NOISE_STEPS))
    half, top = np.float32(0.5), np.float32(255.0)
    for row in range(height):
        start = int(_hashed(key, row) % np.uint64(bank.size - width))
        line, spread, noise, target = level[row], deviation[row], bank[start : start + width], out[row]
        for i in range(width):
            value = np.float32(line[i]) * to_level * gain[i]
            value += np.float32(spread[i]) * np.float32(noise[i]) * to_noise + half
            target[i] = np.uint8(np.int32(min(max(value, np.float32(0.0)), top)))


@njit(cache=True, nogil=True, fastmath=True)
def expose_level(level, black, noise_of, bank, key, out):  # type: ignore[no-untyped-def]
    """Fill out (H, 3 W) uint8 with a picture of light level (H, 3 W), DN, by the same noise law as `expose`.

    black: the black level, DN; noise_of (2,): read noise DN, electrons per DN.
    """
    height, width = out.shape
    read, per_dn = np.float32(noise_of[0] * noise_of[0]), np.float32(1.0 / noise_of[1])
    to_noise, half, top = np.float32(1.0 / NOISE_STEPS), np.float32(0.5), np.float32(255.0)
    zero, base = np.float32(0.0), np.float32(black)
    for row in range(height):
        start = int(_hashed(key, row) % np.uint64(bank.size - width))
        line, noise, target = level[row], bank[start : start + width], out[row]
        for i in range(width):
            light = np.float32(line[i]) + base
            value = light + np.sqrt(read + light * per_dn) * np.float32(noise[i]) * to_noise + half
            target[i] = np.uint8(np.int32(min(max(value, zero), top)))


@njit(cache=True, nogil=True)
def expose_changed(table, veil, black, passed, added, window, gain, noise_of, bank, key, out):  # type: ignore[no-untyped-def]
    """Expose those pixels of a window of out (H, W, 3) that something moving changes, and clear the marks.

    table (H, W, 3): `level_table` of the static light, of the glare `veil` (H, W) or (0, 0), and of the black level;
    passed (H, W): the share of the static light that comes through, 1 where nothing is; added (H, W, 3): the light of
    the moving things, DN; noise_of (2,): read noise DN, electrons per DN.
    """
    left, top, right, bottom = window
    width = out.shape[1]
    for row in range(top, bottom):
        start = int(_hashed(key, row) % np.uint64(bank.size - 3 * width))
        for column in range(left, right):
            share = passed[row, column]
            if share == 1.0 and added[row, column, 0] == 0.0:
                continue
            base = black + (veil[row, column] if veil.shape[0] > 0 else 0.0)
            for c in range(3):
                light = (table[row, column, c] / LEVEL_STEPS - base) * share + added[row, column, c] + base
                deviation = np.sqrt(noise_of[0] * noise_of[0] + max(light, 0.0) / noise_of[1])
                value = light * gain[c] + deviation * bank[start + 3 * column + c] / NOISE_STEPS + 0.5
                out[row, column, c] = np.uint8(min(max(value, 0.0), 255.0))
                added[row, column, c] = 0.0
            passed[row, column] = 1.0
