"""Two loops that do nothing but what the machine does best: the ceilings that other kernels are measured against."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL

Line = NDArray[np.float32]


@njit(**KERNEL, fastmath=True)  # a ceiling, no result: rounding is of no consequence
def min_plus_repeatedly(values: Line, out: Line, rounds: int) -> None:
    """Four additions and four minima per element and round, all within the first cache."""
    n = values.size
    for i in range(n):
        out[i] = np.float32(1e30)
    for r in range(rounds):
        a = np.float32(r * 1e-6)
        b, c, d = a + np.float32(0.25), a + np.float32(0.5), a + np.float32(0.75)
        for i in range(n):
            v = values[i]
            out[i] = min(min(out[i], v + a), min(min(v + b, v + c), v + d))


@njit(**KERNEL)
def copy_repeatedly(source: Line, target: Line, rounds: int) -> None:
    """Copy a block that does not fit into any cache."""
    for r in range(rounds):
        for i in range(source.size):
            target[i] = source[i] + np.float32(r)
