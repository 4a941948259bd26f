"""How near a person who keeps their velocity comes to a robot on its way."""

from __future__ import annotations

import math

from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray


@njit(**KERNEL)
def closest_approach(
    way: FloatArray, step: float, since: float, start: FloatArray, velocity: FloatArray, ahead: float
) -> tuple[float, float]:
    """Return the least distance (m) within `ahead` s, and when (s from now).

    The robot is at `way` (K, d) m every `step` s, on straight lines in between, and stays at its end; now is `since` s
    after its first instant. The person is at `start` (d,) m and moves with `velocity` (d,) m/s.
    """
    d = start.size
    last = way.shape[0] - 1
    best, when = math.inf, 0.0
    t = 0.0
    while True:
        at = (since + t) / step
        i = min(max(math.floor(at + 1e-9), 0), last)
        end = ahead if i >= last else min((i + 1) * step - since, ahead)
        share = min(max(at - i, 0.0), 1.0)
        square = slope = pace = 0.0
        for a in range(d):
            stride = 0.0 if i >= last else way[i + 1, a] - way[i, a]
            gap = start[a] + t * velocity[a] - (way[i, a] + share * stride)
            closing = velocity[a] - stride / step
            square += gap * gap
            slope += gap * closing
            pace += closing * closing
        moment = min(max(-slope / pace, 0.0), end - t) if pace > 0.0 else 0.0
        distance = math.sqrt(max(square + moment * (2.0 * slope + moment * pace), 0.0))
        if distance < best - 1e-12:
            best, when = distance, t + moment
        if end >= ahead:
            return best, when
        t = end
