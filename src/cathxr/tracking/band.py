"""Symmetric positive definite systems whose unknowns meet only near neighbours: banded Cholesky. Compiled."""

import math

from numba import njit


@njit(cache=True, nogil=True)
def factorise(band, count):  # type: ignore[no-untyped-def]
    """Turn a matrix into its lower Cholesky factor in place; return whether it is positive definite.

    band (N, W): row i, column d holds the matrix's element (i, i - d); the first `count` rows count.
    """
    width = band.shape[1]
    for i in range(count):
        for d in range(min(i, width - 1), -1, -1):
            j = i - d
            total = band[i, d]
            for k in range(max(0, i - width + 1), j):
                total -= band[i, i - k] * band[j, j - k]
            if d > 0:
                band[i, d] = total / band[j, 0]
            elif total > 0.0:
                band[i, 0] = math.sqrt(total)
            else:
                return False
    return True


@njit(cache=True, nogil=True)
def forward(factor, count, right):  # type: ignore[no-untyped-def]
    """Solve L y = right (N, K) in place, for a factor of `factorise`."""
    width = factor.shape[1]
    for i in range(count):
        for axis in range(right.shape[1]):
            total = right[i, axis]
            for k in range(max(0, i - width + 1), i):
                total -= factor[i, i - k] * right[k, axis]
            right[i, axis] = total / factor[i, 0]


@njit(cache=True, nogil=True)
def backward(factor, count, right):  # type: ignore[no-untyped-def]
    """Solve L' x = right (N, K) in place, for a factor of `factorise`."""
    width = factor.shape[1]
    for i in range(count - 1, -1, -1):
        for axis in range(right.shape[1]):
            total = right[i, axis]
            for k in range(i + 1, min(count, i + width)):
                total -= factor[k, k - i] * right[k, axis]
            right[i, axis] = total / factor[i, 0]
