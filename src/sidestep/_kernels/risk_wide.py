"""The wide part of the risk: blobs that are smooth at the scale of coarser lattices, summed there and brought back.

Level l is a lattice of 2^l robot cells, l = 1..3. A cell's mass is shared among the coarse cells around it, which adds
h²/6 of variance (h the coarse spacing) that is taken off the blob's own.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.risk_profile import TAIL, add_class
from sidestep.types import FloatArray, IntArray

LEVELS = 4
"""The robot's lattice itself, and three coarser ones."""
WIDE = 0.7
"""A blob is summed on a lattice of spacing h if σ ≥ WIDE·h."""
RINGS = 65
"""Samples of a kernel along its radius."""


@njit(cache=True)
def level_of(sigma: float, spacing: float) -> int:
    """Return the coarsest level at which a blob is wide; 0: none."""
    level = 0
    while level < LEVELS - 1 and sigma >= WIDE * spacing * 2 ** (level + 1):
        level += 1
    return level


@njit(cache=True)
def _kernel(
    radius: float, weights: FloatArray, sigmas: FloatArray, h: float, active: IntArray, table: FloatArray, least: float
) -> FloatArray:
    """Mixture of wide blobs, dilated by `radius`, on a lattice of spacing h out to where it falls to `least`."""
    widest = 0.0
    for c in range(sigmas.size):
        if weights[c] > 0.0:
            widest = max(widest, sigmas[c])
    reach = radius + TAIL * widest
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


@njit(cache=True)
def _share_out(
    cells: FloatArray,
    masses: FloatArray,
    origin: FloatArray,
    h: float,
    active: IntArray,
    low: IntArray,
    out: FloatArray,
) -> None:
    """Share every mass among the coarse cells around it, so that total and mean stay; what is off the box is lost."""
    w0, w1, w2 = out.shape
    for n in range(masses.size):
        c0 = (cells[n, 0] - origin[0]) / h - low[0]
        c1 = (cells[n, 1] - origin[1]) / h - low[1]
        c2 = (cells[n, 2] - origin[2]) / h - low[2]
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


@njit(cache=True)
def _coarser(fine: FloatArray, fine_low: IntArray, out: FloatArray, low: IntArray) -> None:
    """Share the masses of one level among the cells of the next; what is off the box is lost."""
    for i in range(fine.shape[0]):
        x = i + fine_low[0]
        for j in range(fine.shape[1]):
            y = j + fine_low[1]
            for k in range(fine.shape[2]):
                mass = fine[i, j, k]
                if mass == 0.0:
                    continue
                z = k + fine_low[2]
                mass /= (1 + (x & 1)) * (1 + (y & 1)) * (1 + (z & 1))
                for p in range(1 + (x & 1)):
                    a = (x >> 1) + p - low[0]
                    for q in range(1 + (y & 1)):
                        b = (y >> 1) + q - low[1]
                        for s in range(1 + (z & 1)):
                            c = (z >> 1) + s - low[2]
                            if 0 <= a < out.shape[0] and 0 <= b < out.shape[1] and 0 <= c < out.shape[2]:
                                out[a, b, c] += mass


@njit(cache=True)
def _blur(source: FloatArray, source_low: IntArray, kernel: FloatArray, out: FloatArray, low: IntArray) -> None:
    """Add source ⊗ kernel to `out`; the kernel is centred."""
    r0, r1, r2 = (kernel.shape[0] - 1) // 2, (kernel.shape[1] - 1) // 2, (kernel.shape[2] - 1) // 2
    d0, d1, d2 = source_low[0] - low[0], source_low[1] - low[1], source_low[2] - low[2]
    for i in range(max(0, -d0 - r0), min(source.shape[0], out.shape[0] - d0 + r0)):
        for j in range(max(0, -d1 - r1), min(source.shape[1], out.shape[1] - d1 + r1)):
            for k in range(max(0, -d2 - r2), min(source.shape[2], out.shape[2] - d2 + r2)):
                mass = source[i, j, k]
                if mass == 0.0:
                    continue
                x, y, z = i + d0, j + d1, k + d2
                first, last = max(0, z - r2), min(out.shape[2], z + r2 + 1)
                for a in range(max(0, x - r0), min(out.shape[0], x + r0 + 1)):
                    for b in range(max(0, y - r1), min(out.shape[1], y + r1 + 1)):
                        row = out[a, b, first:last]
                        weight = kernel[a - x + r0, b - y + r1, first - z + r2 : last - z + r2]
                        for c in range(np.uintp(row.size)):
                            row[c] += mass * weight[c]


@njit(cache=True)
def _unite(total: FloatArray, part: FloatArray) -> None:
    """1 − (1 − total)(1 − part) into `total`; `part` is left at zero."""
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            a, b = total[i, j], part[i, j]
            for k in range(a.size):
                p = min(b[k], 1.0)
                a[k] += p - a[k] * p
                b[k] = 0.0


@njit(cache=True)
def _refine(coarse: FloatArray, coarse_low: IntArray, out: FloatArray | NDArray[np.float32], low: IntArray) -> None:
    """Unite `out` with a lattice of twice the spacing, interpolated."""
    g0, g1, g2 = coarse_low[0], coarse_low[1], coarse_low[2]
    line = np.empty(coarse.shape[2])
    for i in range(out.shape[0]):
        x = i + low[0]
        i0, i1 = (x >> 1) - g0, ((x + 1) >> 1) - g0
        for j in range(out.shape[1]):
            y = j + low[1]
            j0, j1 = (y >> 1) - g1, ((y + 1) >> 1) - g1
            for k in range(line.size):
                line[k] = 0.25 * (coarse[i0, j0, k] + coarse[i0, j1, k] + coarse[i1, j0, k] + coarse[i1, j1, k])
            row = out[i, j]
            for k in range(row.size):
                z = k + low[2]
                p = 0.5 * (line[(z >> 1) - g2] + line[((z + 1) >> 1) - g2])
                row[k] += p - row[k] * p


@njit(cache=True)
def _grid(low: IntArray, size: IntArray, active: IntArray, wider: int, level: int) -> tuple[IntArray, FloatArray]:
    """Lowest cell and zeros of a box of the level that holds a box of the robot's lattice, `wider` cells more around."""
    first, last = np.zeros(3, np.int64), np.zeros(3, np.int64)
    for a in range(3):
        if active[a]:
            first[a] = (low[a] >> level) - 1 - wider
            last[a] = ((low[a] + size[a] - 1) >> level) + 2 + wider
    return first, np.zeros((last[0] - first[0] + 1, last[1] - first[1] + 1, last[2] - first[2] + 1))


@njit(cache=True)
def _kernel_at(
    level: int,
    radius: float,
    weights: FloatArray,
    sigmas: FloatArray,
    spacing: float,
    active: IntArray,
    table: FloatArray,
    limit: float,
) -> FloatArray:
    """Kernel of the classes that belong to a level; a single zero if there are none."""
    chosen = np.zeros(weights.size)
    found = False
    for c in range(weights.size):
        if weights[c] > 0.0 and level_of(sigmas[c], spacing) == level:
            chosen[c] = weights[c]
            found = True
    if not found:
        return np.zeros((1, 1, 1))
    return _kernel(radius, chosen, sigmas, spacing * 2**level, active, table, 0.01 * limit)


@njit(cache=True)
def add_wide(
    cells: FloatArray,
    masses: FloatArray,
    starts: IntArray,
    distances: FloatArray,
    weights: FloatArray,
    sigmas: FloatArray,
    origin: FloatArray,
    spacing: float,
    block: int,
    low: IntArray,
    active: IntArray,
    table: FloatArray,
    limit: float,
    out: NDArray[np.float32],
) -> bool:
    """Unite `out` with the wide blobs of everybody at one half instant; arguments as for `risk_raster.rasterise`.

    The levels of one person are united as if they were different people; the difference is their product, which is
    nothing at the scale of the limit.
    """
    size = np.array(out.shape)
    lows = (_grid(low, size, active, 0, 1)[0], _grid(low, size, active, 0, 2)[0], _grid(low, size, active, 0, 3)[0])
    totals = (_grid(low, size, active, 0, 1)[1], _grid(low, size, active, 0, 2)[1], _grid(low, size, active, 0, 3)[1])
    parts = (np.zeros_like(totals[0]), np.zeros_like(totals[1]), np.zeros_like(totals[2]))
    found = False
    for person in range(starts.shape[0]):
        first, last = starts[person, block], starts[person, block + 1]
        if first == last:
            continue
        r, own, sigma = distances[person], weights[person], sigmas[person, block]
        kernels = (
            _kernel_at(1, r, own, sigma, spacing, active, table, limit),
            _kernel_at(2, r, own, sigma, spacing, active, table, limit),
            _kernel_at(3, r, own, sigma, spacing, active, table, limit),
        )
        reach3 = (kernels[2].shape[2] - 1) // 2 + 1
        reach2 = max((kernels[1].shape[2] - 1) // 2 + 1, 2 * reach3 + 2 if kernels[2].size > 1 else 0)
        beyond = kernels[1].size > 1 or kernels[2].size > 1
        reach1 = max((kernels[0].shape[2] - 1) // 2 + 1, 2 * reach2 + 2 if beyond else 0)
        if not beyond and kernels[0].size == 1:
            continue
        found = True
        low1, source1 = _grid(low, size, active, reach1, 1)
        low2, source2 = _grid(low, size, active, reach2, 2)
        low3, source3 = _grid(low, size, active, reach3, 3)
        sources, corners = (source1, source2, source3), (low1, low2, low3)
        _share_out(cells[first:last], masses[first:last], origin, 2.0 * spacing, active, low1, source1)
        if beyond:
            _coarser(source1, low1, source2, low2)
        if kernels[2].size > 1:
            _coarser(source2, low2, source3, low3)
        for level in range(3):
            if kernels[level].size > 1:
                _blur(sources[level], corners[level], kernels[level], parts[level], lows[level])
                _unite(totals[level], parts[level])
    if found:
        _refine(totals[2], lows[2], totals[1], lows[1])
        _refine(totals[1], lows[1], totals[0], lows[0])
        _refine(totals[0], lows[0], out, low)
    return found
