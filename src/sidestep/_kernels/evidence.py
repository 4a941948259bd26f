"""How well each hypothesis about a person explains what was measured of them."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep.types import FloatArray


@njit(cache=True)
def action_weights(
    velocities: FloatArray, displacement: FloatArray, elapsed: float, covariance: FloatArray
) -> FloatArray:
    """(n,) N(displacement; u·elapsed, Σ) of every action u, scaled so that the largest is 1; size 0 if not finite.

    Args:
        velocities: (n, d) m/s.
        displacement: (d,) m.
        elapsed: s.
        covariance: (d, d) m², Σ; made regular here.
    """
    count, d = velocities.shape
    regular = covariance.copy()
    for a in range(d):
        regular[a, a] += 1e-9 + 1e-9 * np.trace(covariance)
    precision = np.linalg.inv(regular)
    out = np.empty(count)
    highest = -np.inf
    for n in range(count):
        exponent = 0.0
        for a in range(d):
            miss = displacement[a] - elapsed * velocities[n, a]
            for b in range(d):
                exponent -= 0.5 * miss * precision[a, b] * (displacement[b] - elapsed * velocities[n, b])
        if not math.isfinite(exponent):
            return np.empty(0)
        out[n] = exponent
        highest = max(highest, exponent)
    for n in range(count):
        out[n] = math.exp(out[n] - highest)
    return out
