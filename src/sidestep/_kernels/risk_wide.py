"""The wide part of the risk: blobs that are smooth at the scale of coarser lattices, summed there and brought back.

Level l is a lattice of 2^l robot cells, l = 1..3. A cell's mass is shared among the coarse cells around it, which adds
h²/6 of variance (h the coarse spacing) that is taken off the blob's own.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.risk_profile import TAIL, add_class, blob
from sidestep.types import FloatArray, IntArray

LEVELS = 4
"""The robot's lattice itself, and three coarser ones."""
WIDE = 0.7
"""A blob is summed on a lattice of spacing h if σ ≥ WIDE·h."""
RINGS = 49
"""Samples of a kernel along its radius."""
FAR = 4.0
"""σ beyond which less than `FAR_SHARE` of a blob reaches a ball."""
FAR_SHARE = 3.2e-5
LEAST = 0.01
"""Part of the limit below which a blob is cut off."""


@njit(cache=True, error_model="numpy")
def level_of(sigma: float, spacing: float) -> int:
    """Return the coarsest level at which a blob is wide; 0: none."""
    level = 0
    while level < LEVELS - 1 and sigma >= WIDE * spacing * 2 ** (level + 1):
        level += 1
    return level


@njit(cache=True, error_model="numpy")
def _kernel(
    radius: float, weights: FloatArray, sigmas: FloatArray, h: float, active: IntArray, table: FloatArray, least: float
) -> FloatArray:
    """Mixture of wide blobs, dilated by `radius`, on a lattice of spacing h out to where it falls to `least`."""
    widest = 0.0
    for c in range(sigmas.size):
        if weights[c] > 0.0:
            widest = max(widest, sigmas[c])
    reach = radius + (FAR if least > FAR_SHARE else TAIL) * widest
    rings = np.empty(RINGS)
    for n in range(RINGS):
        rings[n] = reach * n / (RINGS - 1)
    curve = np.zeros(RINGS)
    for c in range(sigmas.size):
        if weights[c] > 0.0:
            add_class(rings, radius, weights[c], math.sqrt(sigmas[c] ** 2 - h * h / 6.0), table, curve)
    last = RINGS - 1
    while last > 1 and curve[last - 1] < least:
        last -= 1
    r = int(rings[last] / h) + 1
    by_square = np.zeros(3 * r * r + 1)  # cells equally far away have the same value
    for q in range(r * r + 1):
        t = h * math.sqrt(q) / reach * (RINGS - 1)
        if t < last:
            n = int(t)
            by_square[q] = curve[n] + (t - n) * (curve[n + 1] - curve[n])
    out = np.empty((2 * r * active[0] + 1, 2 * r * active[1] + 1, 2 * r * active[2] + 1))
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            near = (i - r * active[0]) ** 2 + (j - r * active[1]) ** 2
            for k in range(out.shape[2]):
                out[i, j, k] = by_square[near + (k - r * active[2]) ** 2]
    return out


@njit(cache=True, error_model="numpy")
def _share_out(
    places: FloatArray, masses: FloatArray, scale: float, active: IntArray, low: IntArray, out: FloatArray
) -> None:
    """Share every mass among the coarse cells around it, so that total and mean stay; what is off the box is lost."""
    w0, w1, w2 = out.shape
    for n in range(masses.size):
        c0, c1, c2 = places[n, 0] * scale - low[0], places[n, 1] * scale - low[1], places[n, 2] * scale - low[2]
        i, j, k = math.floor(c0), math.floor(c1), math.floor(c2)
        if i < 0 or j < 0 or k < 0 or i + active[0] >= w0 or j + active[1] >= w1 or k + active[2] >= w2:
            continue
        a, b, c = c0 - i, c1 - j, c2 - k
        for p in range(1 + active[0]):
            for q in range(1 + active[1]):
                part = masses[n] * (a if p else 1.0 - a) * (b if q else 1.0 - b)
                out[i + p, j + q, k] += part * (1.0 - c)
                if active[2]:
                    out[i + p, j + q, k + 1] += part * c


@njit(cache=True, error_model="numpy")
def _blur(
    source: FloatArray, source_low: IntArray, kernel: FloatArray, out: FloatArray, low: IntArray, size: IntArray
) -> None:
    """Add source ⊗ kernel to `out` (flat, over the box `low`, `size`); the kernel is centred."""
    r0, r1, r2 = (kernel.shape[0] - 1) // 2, (kernel.shape[1] - 1) // 2, (kernel.shape[2] - 1) // 2
    for i in range(source.shape[0]):
        x = i + source_low[0] - low[0]
        for j in range(source.shape[1]):
            y = j + source_low[1] - low[1]
            for k in range(source.shape[2]):
                mass = source[i, j, k]
                if mass == 0.0:
                    continue
                z = k + source_low[2] - low[2]
                first, last = max(0, z - r2), min(size[2], z + r2 + 1)
                if first >= last:
                    continue
                for a in range(max(0, x - r0), min(size[0], x + r0 + 1)):
                    for b in range(max(0, y - r1), min(size[1], y + r1 + 1)):
                        at = (a * size[1] + b) * size[2]
                        row = out[at + first : at + last]
                        weight = kernel[a - x + r0, b - y + r1, first - z + r2 : last - z + r2]
                        for c in range(np.uintp(row.size)):
                            row[c] += mass * weight[c]


@njit(cache=True, error_model="numpy")
def coarse_boxes(low: IntArray, size: IntArray, active: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Lowest cells and numbers of cells (LEVELS, 3) of every level that a box of the robot's lattice is read from.

    And (LEVELS + 1,) where levels 1, 2 and 3 start if they lie one after the other.
    """
    first, count = np.zeros((LEVELS, 3), np.int64), np.ones((LEVELS, 3), np.int64)
    starts = np.zeros(LEVELS + 1, np.int64)
    for level in range(LEVELS):
        for a in range(3):
            if level == 0:
                first[level, a], count[level, a] = low[a], size[a]
            elif active[a]:
                first[level, a] = (low[a] >> level) - 1
                count[level, a] = ((low[a] + size[a] - 1) >> level) + 3 - first[level, a]
        starts[level + 1] = starts[level] + (count[level, 0] * count[level, 1] * count[level, 2] if level else 0)
    return first, count, starts


@njit(cache=True, error_model="numpy")
def add_wide(
    level: int,
    places: FloatArray,
    masses: FloatArray,
    bounds: FloatArray,
    radius: float,
    weights: FloatArray,
    sigmas: FloatArray,
    gap: float,
    spacing: float,
    active: IntArray,
    table: FloatArray,
    limit: float,
    low: IntArray,
    size: IntArray,
    total: FloatArray,
    part: FloatArray,
) -> bool:
    """Unite `total`, over a box of a level, with those blobs of one person that belong to it.

    The levels of one person are united as if they were different people; the difference is their product, which is
    nothing at the scale of the limit.

    Args:
        level: 1, 2 or 3.
        places: (M, 3) robot cells from the robot, where the mass is.
        masses: (M,).
        bounds: (2, 3) lowest and highest of the places.
        radius: m.
        weights: (C,) of the spread classes.
        sigmas: (C,) m.
        gap: m between what is asked for and the nearest mass, at least.
        spacing: m, of the robot's lattice.
        active: (3,).
        table: of `blob_table`.
        limit: risk limit.
        low: (3,) lowest cell of the box.
        size: (3,) its cells.
        total: flat, over the box.
        part: zeros, at least as many; left as zeros.

    Returns:
        True if anything was added.
    """
    least = LEAST * limit
    chosen = np.zeros(weights.size)
    nearest = 0.0
    for c in range(weights.size):
        if weights[c] > 0.0 and level_of(sigmas[c], spacing) == level:
            chosen[c] = weights[c]
            nearest += weights[c] * blob(gap, radius, sigmas[c], table)
    if nearest < least:
        return False
    kernel = _kernel(radius, chosen, sigmas, spacing * 2**level, active, table, least)
    scale = 1.0 / 2**level
    r = (kernel.shape[2] - 1) // 2
    first, last = np.zeros(3, np.int64), np.zeros(3, np.int64)
    for a in range(3):
        if active[a]:
            first[a] = max(math.floor(bounds[0, a] * scale), low[a] - r)
            last[a] = min(math.floor(bounds[1, a] * scale) + 1, low[a] + size[a] - 1 + r)
            if last[a] < first[a]:
                return False
    source = np.zeros((last[0] - first[0] + 1, last[1] - first[1] + 1, last[2] - first[2] + 1))
    _share_out(places, masses, scale, active, first, source)
    _blur(source, first, kernel, part, low, size)
    for n in range(np.uintp(total.size)):
        p = min(part[n], 1.0)
        total[n] += p - total[n] * p
        part[n] = 0.0
    return True


@njit(cache=True, error_model="numpy")
def refine(
    coarse: FloatArray,
    coarse_low: IntArray,
    coarse_size: IntArray,
    out: FloatArray | NDArray[np.float32],
    low: IntArray,
    size: IntArray,
) -> None:
    """Unite `out` with a lattice of twice the spacing, interpolated; both flat over their boxes."""
    line = np.empty(coarse_size[2])
    for i in range(low[0], low[0] + size[0]):
        i0, i1 = (i >> 1) - coarse_low[0], ((i + 1) >> 1) - coarse_low[0]
        for j in range(low[1], low[1] + size[1]):
            j0, j1 = (j >> 1) - coarse_low[1], ((j + 1) >> 1) - coarse_low[1]
            n = np.uintp(coarse_size[2])
            a, b = np.uintp((i0 * coarse_size[1] + j0) * n), np.uintp((i0 * coarse_size[1] + j1) * n)
            c, d = np.uintp((i1 * coarse_size[1] + j0) * n), np.uintp((i1 * coarse_size[1] + j1) * n)
            for k in range(n):
                line[k] = 0.25 * (coarse[a + k] + coarse[b + k] + coarse[c + k] + coarse[d + k])
            at = ((i - low[0]) * size[1] + j - low[1]) * size[2]
            row = out[at : at + size[2]]
            for k in range(size[2]):
                z = k + low[2]
                p = 0.5 * (line[(z >> 1) - coarse_low[2]] + line[((z + 1) >> 1) - coarse_low[2]])
                row[k] += p - row[k] * p
