"""P(‖y + σ·n‖ < r) for a standard normal n: the share of a Gaussian blob, centred a distance away, that lies in a ball."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep.types import FloatArray


@njit(cache=True)
def _normal(x: float) -> float:
    return 0.5 * math.erfc(-x * 0.7071067811865476)


@njit(cache=True)
def ball_probability(distance: float, radius: float, sigma: float, dimension: int, nodes: FloatArray) -> float:
    """Probability that a Gaussian (isotropic, σ = `sigma` m) around a point `distance` m away falls within `radius` m.

    Closed forms in 1-D and 3-D; in 2-D the integral over x = r·sin t, or over x = d + σ·s where the blob is the
    narrower one. `nodes`: (2, n) Gauss–Legendre abscissae and weights on [−1, 1].
    """
    if sigma <= 0.0:
        return 1.0 if distance < radius else 0.0
    z = (radius - distance) / sigma
    if z < -9.0:
        return 0.0
    if dimension == 1:
        return _normal(z) - _normal(-(radius + distance) / sigma)
    if dimension == 3:
        return _ball_3d(distance, radius, sigma)
    low, high = max(-radius, distance - 7.0 * sigma), min(radius, distance + 7.0 * sigma)
    if low >= high:
        return 0.0
    t0, t1 = math.asin(low / radius), math.asin(high / radius)
    total = 0.0
    for i in range(nodes.shape[1]):
        t = 0.5 * (t0 + t1) + 0.5 * (t1 - t0) * nodes[0, i]
        x = radius * math.sin(t)
        half = radius * math.cos(t)
        across = math.erf(half / sigma * 0.7071067811865476)
        along = math.exp(-0.5 * ((x - distance) / sigma) ** 2) / (sigma * 2.5066282746310002)
        total += nodes[1, i] * along * across * half
    return min(1.0, 0.5 * (t1 - t0) * total)


@njit(cache=True)
def _ball_3d(distance: float, radius: float, sigma: float) -> float:
    near, far = (radius - distance) / sigma, (radius + distance) / sigma
    if distance < 1e-4 * sigma:
        value = (
            1.0 - 2.0 * _normal(-radius / sigma) - radius / sigma * 0.7978845608028654 * math.exp(-0.5 * near * near)
        )
        return max(0.0, value)
    tails = math.exp(-0.5 * near * near) - math.exp(-0.5 * far * far)
    value = _normal(near) - _normal(-far) - sigma / distance * 0.3989422804014327 * tails
    return min(1.0, max(0.0, value))


@njit(cache=True)
def profile_index(distance: float, radius: float, scale: float) -> float:
    """Place of a distance on the table's axis, in (−1, 1): dense around the ball's surface, sparse far from it."""
    x = distance - radius
    return x / (abs(x) + scale)


@njit(cache=True)
def profile_value(distance: float, table: FloatArray, grid: FloatArray) -> float:
    """Read F(distance) by linear interpolation; `grid` = (radius m, scale m, first place, places per sample)."""
    t = (profile_index(distance, grid[0], grid[1]) - grid[2]) / grid[3]
    i = int(t)
    if i >= table.size - 1:
        return 0.0
    return table[i] + (t - i) * (table[i + 1] - table[i])


@njit(cache=True)
def class_profiles(
    radius: float, sigmas: FloatArray, dimension: int, nodes: FloatArray, samples: int
) -> tuple[FloatArray, FloatArray]:
    """Tabulate F(distance) for each half instant and class.

    Args:
        radius: m; sigmas: (blocks, C) m; samples: points per table.

    Returns:
        tables (blocks, C, samples) and grids (blocks, 4), see `profile_value`.
    """
    blocks, classes = sigmas.shape
    tables = np.empty((blocks, classes, samples))
    grids = np.empty((blocks, 4))
    for b in range(blocks):
        finest = radius
        for s in sigmas[b]:
            if s > 0.0:
                finest = min(finest, s)
        scale = 3.0 * finest
        first = profile_index(0.0, radius, scale)
        last = profile_index(radius + 5.0 * max(np.max(sigmas[b]), finest), radius, scale)
        grids[b, 0], grids[b, 1], grids[b, 2], grids[b, 3] = radius, scale, first, (last - first) / (samples - 1)
        for i in range(samples):
            t = first + i * grids[b, 3]
            distance = max(0.0, radius + scale * t / (1.0 - abs(t)))
            for c in range(classes):
                tables[b, c, i] = ball_probability(distance, radius, sigmas[b, c], dimension, nodes)
    return tables, grids


@njit(cache=True)
def staircase(tables: FloatArray, grids: FloatArray, levels: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bound each falling profile F from above by steps.

    Args:
        tables: (blocks, samples); grids: (blocks, 4); levels: (S,) falling values at which a step ends.

    Returns:
        radii (blocks, S) m and shares (blocks, S): F(d) ≤ Σ_s shares[s]·[d ≤ radii[s]] wherever F > levels[-1].
    """
    blocks, samples = tables.shape
    radii = np.zeros((blocks, levels.size))
    shares = np.zeros((blocks, levels.size))
    for b in range(blocks):
        top = tables[b, 0]
        i = 0
        for s in range(levels.size):
            while i < samples and tables[b, i] > levels[s]:
                i += 1
            t = grids[b, 2] + min(i, samples - 1) * grids[b, 3]
            radii[b, s] = max(0.0, grids[b, 0] + grids[b, 1] * t / (1.0 - abs(t)))
            below = levels[s] if s < levels.size - 1 else 0.0
            if top > below:
                shares[b, s] = top - below
                top = below
    return radii, shares
