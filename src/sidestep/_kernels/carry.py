"""A motion carried on past its end, and seen from later on."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray


@njit(**KERNEL)
def head_for(path: FloatArray, known: int, goal: FloatArray, stride: float) -> None:
    """Fill `path` (K+1, d) m from row `known` ≥ 1 on: from row known − 1 straight to `goal`, `stride` m per step."""
    d = path.shape[1]
    length = 0.0
    for a in range(d):
        length += (goal[a] - path[known - 1, a]) ** 2
    length = math.sqrt(length)
    for k in range(known, path.shape[0]):
        part = min(stride * (k - known + 1) / length, 1.0) if length > 0.0 else 0.0
        for a in range(d):
            path[k, a] = path[known - 1, a] + part * (goal[a] - path[known - 1, a])


@njit(**KERNEL)
def grown(path: FloatArray, goal: FloatArray, steps: int) -> FloatArray:
    """(steps+1, d) m: `path` as far as it goes, and on to `goal` at the length of its last stride."""
    known, d = min(path.shape[0], steps + 1), path.shape[1]
    out = np.empty((steps + 1, d))
    for k in range(known):
        for a in range(d):
            out[k, a] = path[k, a]
    stride = 0.0
    if known > 1:
        for a in range(d):
            stride += (path[known - 1, a] - path[known - 2, a]) ** 2
    head_for(out, known, goal, math.sqrt(stride))
    return out


@njit(**KERNEL)
def shifted(positions: FloatArray, shift: float, start: FloatArray, goal: FloatArray, steps: int) -> FloatArray:
    """(steps+1, d) m: `positions` (K+1, d) from instant `shift` (steps) on, moved to begin at `start`, then `grown`."""
    last, d = positions.shape[0] - 1, positions.shape[1]
    known = 1  # the first instant always; those before the end of the plan as well
    while known <= steps and known + shift < last:
        known += 1
    part = np.empty((known, d))
    for k in range(known):
        instant = min(k + shift, float(last))
        low = min(int(instant), max(last - 1, 0))
        for a in range(d):
            rise = positions[min(low + 1, last), a] - positions[low, a]
            part[k, a] = positions[low, a] + (instant - low) * rise
    out = grown(part, goal, steps)
    for a in range(d):
        offset = start[a] - out[0, a]
        for k in range(steps + 1):
            out[k, a] += offset
    return out
