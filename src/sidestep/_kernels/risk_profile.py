"""F(d): the share of a Gaussian blob, centred d away, that lies in a ball of radius r.

F depends on d, r and σ through z = (r − d)/σ and s = σ/r alone, and is smooth in both, down to the step at σ = 0: one
table serves all.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray

TAIL = 5.5
"""σ beyond which F is taken for 0 or 1; what is lost is below 4e-8."""
ALONG = 401
"""Samples of z in [−TAIL, TAIL]."""
ACROSS = 161
"""Samples of s/(1 + s) in [0, 1]."""
SAMPLES = 192
"""Samples of the mixture of one person at one instant."""
FINE = 1e-3
"""Of the radius: to within this the discs of a staircase are found."""
STEPS = 6
"""Discs that stand for a narrow blob."""


@njit(**KERNEL, nogil=True)
def _normal(x: float) -> float:
    return 0.5 * math.erfc(-x * 0.7071067811865476)


@njit(**KERNEL, nogil=True)
def ball_probability(distance: float, radius: float, sigma: float, dimension: int, nodes: FloatArray) -> float:
    """F by closed form in 1-D and 3-D, in 2-D by quadrature over x = r·sin t where the blob has weight.

    Args:
        distance: m, ≥ 0.
        radius: m.
        sigma: m, per axis; at 0 a step.
        dimension: 1, 2 or 3.
        nodes: (2, n) Gauss–Legendre abscissae and weights on [−1, 1].
    """
    if sigma <= 0.0:
        return 1.0 if distance < radius else 0.0
    if dimension == 1:
        return _normal((radius - distance) / sigma) - _normal(-(radius + distance) / sigma)
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


@njit(**KERNEL, nogil=True)
def _ball_3d(distance: float, radius: float, sigma: float) -> float:
    near, far = (radius - distance) / sigma, (radius + distance) / sigma
    if distance < 1e-3 * sigma:
        inner = 1.0 - 2.0 * _normal(-radius / sigma)
        return max(0.0, inner - radius / sigma * 0.7978845608028654 * math.exp(-0.5 * near * near))
    tails = math.exp(-0.5 * near * near) - math.exp(-0.5 * far * far)
    value = _normal(near) - _normal(-far) - sigma / distance * 0.3989422804014327 * tails
    return min(1.0, max(0.0, value))


@njit(**KERNEL, nogil=True)
def _fill(dimension: int, nodes: FloatArray, along: int, across: int) -> FloatArray:
    table = np.empty((across, along))
    for j in range(across):
        v = j / (across - 1)
        for i in range(along):
            z = -TAIL + 2.0 * TAIL * i / (along - 1)
            if j == 0:
                table[j, i] = _normal(z)
            elif j == across - 1:
                table[j, i] = 0.0
            else:
                s = v / (1.0 - v)
                table[j, i] = ball_probability(abs(1.0 - z * s), 1.0, s, dimension, nodes)
    return table


@lru_cache(maxsize=3)
def blob_table(dimension: int) -> FloatArray:
    """Return (ACROSS, ALONG) F over s/(1 + s) and z; made once per dimension."""
    nodes = np.stack(np.polynomial.legendre.leggauss(40))
    return _fill(dimension, nodes, ALONG, ACROSS)


@njit(**KERNEL, nogil=True)
def blob(distance: float, radius: float, sigma: float, table: FloatArray) -> float:
    """F by bilinear interpolation in the table of `blob_table`; within 2e-4."""
    if sigma <= 1e-9:
        return 1.0 if distance <= radius * (1.0 - 1e-9) else 0.0
    z = (radius - distance) / sigma
    if z <= -TAIL:
        return 0.0
    x = (min(z, TAIL) + TAIL) * ((ALONG - 1) / (2.0 * TAIL))
    y = sigma / (radius + sigma) * (ACROSS - 1)
    i, j = min(int(x), ALONG - 2), min(int(y), ACROSS - 2)
    a, b = x - i, y - j
    low = table[j, i] + a * (table[j, i + 1] - table[j, i])
    return low + b * (table[j + 1, i] + a * (table[j + 1, i + 1] - table[j + 1, i]) - low)


@njit(**KERNEL, nogil=True)
def mixture(distance: float, radius: float, weights: FloatArray, sigmas: FloatArray, table: FloatArray) -> float:
    """Σ_c weights[c]·F(distance; σ_c)."""
    total = 0.0
    for c in range(weights.size):
        if weights[c] > 0.0:
            total += weights[c] * blob(distance, radius, sigmas[c], table)
    return total


@njit(**KERNEL, nogil=True)
def class_profiles(radius: float, sigmas: FloatArray, table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tabulate F of every class of one person for each half instant, densely around the ball's surface.

    Args:
        radius: m.
        sigmas: (B, C) m.
        table: of `blob_table`.

    Returns:
        samples (C, B, SAMPLES) and grids (B, 4), see `profile_value`.
    """
    blocks, classes = sigmas.shape
    samples = np.zeros((classes, blocks, SAMPLES))
    grids = np.empty((blocks, 4))
    distances = np.empty(SAMPLES)
    for b in range(blocks):
        finest, widest = np.inf, 0.0
        for c in range(classes):
            finest = min(finest, sigmas[b, c])
            widest = max(widest, sigmas[b, c])
        finest = min(max(finest, 0.01 * radius), radius)
        scale = 2.0 * math.sqrt(finest * max(widest, finest))
        first = -radius / (radius + scale)
        far = TAIL * widest + 1e-6
        step = (far / (far + scale) - first) / (SAMPLES - 1)
        grids[b, 0], grids[b, 1], grids[b, 2], grids[b, 3] = radius, scale, first, step
        for i in range(SAMPLES):
            t = first + i * step
            distances[i] = max(0.0, radius + scale * t / (1.0 - abs(t)))
        for c in range(classes):
            add_class(distances, radius, 1.0, sigmas[b, c], table, samples[c, b])
            samples[c, b, SAMPLES - 1] = 0.0
    return samples, grids


@njit(**KERNEL, nogil=True)
def mixed_profiles(weights: FloatArray, samples: FloatArray) -> FloatArray:
    """Return Σ_c weights[c]·samples[c], (B, SAMPLES) of `class_profiles`."""
    out = np.zeros(samples.shape[1:])
    total = out.reshape(-1)
    for c in range(weights.size):
        one = samples[c].reshape(-1)
        for i in range(np.uintp(total.size)):
            total[i] += weights[c] * one[i]
    return out


@njit(**KERNEL, nogil=True)
def add_class(
    distances: FloatArray, radius: float, weight: float, sigma: float, table: FloatArray, out: FloatArray
) -> None:
    """Add weight·F at all distances for one σ."""
    if sigma <= 1e-9:
        for i in range(out.size):
            out[i] += weight if distances[i] <= radius * (1.0 - 1e-9) else 0.0
        return
    y = sigma / (radius + sigma) * (ACROSS - 1)
    j = min(int(y), ACROSS - 2)
    near, next_to, part = table[j], table[j + 1], y - j
    for i in range(out.size):
        z = (radius - distances[i]) / sigma
        if z <= -TAIL:
            continue
        x = (min(z, TAIL) + TAIL) * ((ALONG - 1) / (2.0 * TAIL))
        k = min(np.uint32(x), np.uint32(ALONG - 2))
        one = near[k] + part * (next_to[k] - near[k])
        other = near[k + 1] + part * (next_to[k + 1] - near[k + 1])
        out[i] += weight * (one + (x - k) * (other - one))


@njit(**KERNEL, nogil=True)
def profile_value(distance: float, samples: FloatArray, grid: FloatArray) -> float:
    """Read a profile by linear interpolation; `grid` = (radius m, scale m, first place, places per sample)."""
    x = distance - grid[0]
    t = (x / (abs(x) + grid[1]) - grid[2]) / grid[3]
    i = int(t)
    if i >= samples.size - 1:
        return 0.0
    return samples[i] + (t - i) * (samples[i + 1] - samples[i])


@njit(**KERNEL, nogil=True)
def staircase(
    radius: float,
    weights: FloatArray,
    sigmas: FloatArray,
    table: FloatArray,
    limit: float,
    count: int,
    radii: FloatArray,
    shares: FloatArray,
) -> int:
    """Stand discs for a mixture F of narrow blobs; return how many.

    F(d) ≤ Σ_s shares[s]·[d ≤ radii[s]] wherever F > 0.05·limit, and the bound is close at the limit.

    Args:
        radius: m.
        weights: (C,) of the classes, 0 for those that are not narrow.
        sigmas: (C,) m.
        table: of `blob_table`.
        limit: risk limit that the raster shall serve.
        count: discs wanted.
        radii: (STEPS,) out, m.
        shares: (STEPS,) out.
    """
    top = mixture(0.0, radius, weights, sigmas, table)
    widest = 0.0
    whole = 0.0
    for c in range(weights.size):
        whole += weights[c]
        if weights[c] > 0.0:
            widest = max(widest, sigmas[c])
    if whole <= 0.0:
        return 0
    if widest <= 1e-9:
        radii[0], shares[0] = radius, whole
        return 1
    used = 0
    anchor = 0.9 * min(limit, 0.5)
    for s in range(count):
        level = 0.05 * anchor if s == count - 1 else anchor ** ((s + 1.0) / (count - 1.0))
        if level >= top and s < count - 1:
            continue
        low, high = (0.0 if used == 0 else radii[used - 1]), radius + TAIL * widest
        while high - low > max(FINE * radius, 1e-9):  # rounding could keep a smaller bracket open for ever
            middle = 0.5 * (low + high)
            if mixture(middle, radius, weights, sigmas, table) > level:
                low = middle
            else:
                high = middle
        below = level if s < count - 1 else 0.0
        radii[used], shares[used] = high, top - below
        top = below
        used += 1
    return used
