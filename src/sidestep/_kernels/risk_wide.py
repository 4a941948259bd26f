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
    out = np.zeros((2 * r * active[0] + 1, 2 * r * active[1] + 1, 2 * r * active[2] + 1))
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            near = (i - r * active[0]) ** 2 + (j - r * active[1]) ** 2
            for k in range(out.shape[2]):
                t = h * math.sqrt(near + (k - r * active[2]) ** 2) / reach * (RINGS - 1)
                if t < last:
                    n = int(t)
                    out[i, j, k] = curve[n] + (t - n) * (curve[n + 1] - curve[n])
    return out


@njit(cache=True)
def _share_out(
    cells: FloatArray, masses: FloatArray, origin: FloatArray, h: float, active: IntArray, out: FloatArray
) -> None:
    """Share every mass among the coarse cells around it, so that total and mean stay; what is off the box is lost."""
    w0, w1, w2 = out.shape
    h0, h1, h2 = (w0 - 1) // 2, (w1 - 1) // 2, (w2 - 1) // 2
    for n in range(masses.size):
        c0 = (cells[n, 0] - origin[0]) / h + h0
        c1 = (cells[n, 1] - origin[1]) / h + h1
        c2 = (cells[n, 2] - origin[2]) / h + h2
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
def _coarser(fine: FloatArray, out: FloatArray) -> None:
    """Share the masses of one level among the cells of the next; what is off the box is lost."""
    f0, f1, f2 = (fine.shape[0] - 1) // 2, (fine.shape[1] - 1) // 2, (fine.shape[2] - 1) // 2
    h0, h1, h2 = (out.shape[0] - 1) // 2, (out.shape[1] - 1) // 2, (out.shape[2] - 1) // 2
    for i in range(-f0, f0 + 1):
        for j in range(-f1, f1 + 1):
            for k in range(-f2, f2 + 1):
                mass = fine[i + f0, j + f1, k + f2]
                if mass == 0.0:
                    continue
                for p in range(1 + (i & 1)):
                    a = (i >> 1) + p + h0
                    for q in range(1 + (j & 1)):
                        b = (j >> 1) + q + h1
                        for s in range(1 + (k & 1)):
                            c = (k >> 1) + s + h2
                            if 0 <= a < out.shape[0] and 0 <= b < out.shape[1] and 0 <= c < out.shape[2]:
                                out[a, b, c] += mass / ((1 + (i & 1)) * (1 + (j & 1)) * (1 + (k & 1)))


@njit(cache=True)
def _blur(source: FloatArray, kernel: FloatArray, out: FloatArray) -> None:
    """Add source ⊗ kernel to `out`; all three are boxes around the same centre, odd along each axis."""
    s0, s1, s2 = (source.shape[0] - 1) // 2, (source.shape[1] - 1) // 2, (source.shape[2] - 1) // 2
    r0, r1, r2 = (kernel.shape[0] - 1) // 2, (kernel.shape[1] - 1) // 2, (kernel.shape[2] - 1) // 2
    h0, h1, h2 = (out.shape[0] - 1) // 2, (out.shape[1] - 1) // 2, (out.shape[2] - 1) // 2
    for i in range(max(-s0, -h0 - r0), min(s0, h0 + r0) + 1):
        for j in range(max(-s1, -h1 - r1), min(s1, h1 + r1) + 1):
            for k in range(max(-s2, -h2 - r2), min(s2, h2 + r2) + 1):
                mass = source[i + s0, j + s1, k + s2]
                if mass == 0.0:
                    continue
                first, last = max(-h2, k - r2), min(h2, k + r2)
                for a in range(max(-h0, i - r0), min(h0, i + r0) + 1):
                    for b in range(max(-h1, j - r1), min(h1, j + r1) + 1):
                        row = out[a + h0, b + h1, first + h2 : last + h2 + 1]
                        weight = kernel[a - i + r0, b - j + r1, first - k + r2 : last - k + r2 + 1]
                        for c in range(row.size):
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
def _refine(coarse: FloatArray, out: FloatArray | NDArray[np.float32]) -> None:
    """Unite `out` with a lattice of twice the spacing around the same centre, interpolated."""
    g0, g1, g2 = (coarse.shape[0] - 1) // 2, (coarse.shape[1] - 1) // 2, (coarse.shape[2] - 1) // 2
    h0, h1, h2 = (out.shape[0] - 1) // 2, (out.shape[1] - 1) // 2, (out.shape[2] - 1) // 2
    line = np.empty(coarse.shape[2])
    for i in range(-h0, h0 + 1):
        i0, i1 = (i >> 1) + g0, ((i + 1) >> 1) + g0
        for j in range(-h1, h1 + 1):
            j0, j1 = (j >> 1) + g1, ((j + 1) >> 1) + g1
            for k in range(line.size):
                line[k] = 0.25 * (coarse[i0, j0, k] + coarse[i0, j1, k] + coarse[i1, j0, k] + coarse[i1, j1, k])
            row = out[i + h0, j + h1]
            for k in range(-h2, h2 + 1):
                p = 0.5 * (line[(k >> 1) + g2] + line[((k + 1) >> 1) + g2])
                row[k + h2] += p - row[k + h2] * p


@njit(cache=True)
def _grid(half: IntArray, wider: int, level: int) -> FloatArray:
    """Zeros over `half` robot cells and a little more, widened by `wider` cells of the level."""
    s0, s1, s2 = 0, 0, 0
    if half[0] > 0:
        s0 = ((half[0] - 1) >> level) + 2 + wider
    if half[1] > 0:
        s1 = ((half[1] - 1) >> level) + 2 + wider
    if half[2] > 0:
        s2 = ((half[2] - 1) >> level) + 2 + wider
    return np.zeros((2 * s0 + 1, 2 * s1 + 1, 2 * s2 + 1))


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
    half: IntArray,
    active: IntArray,
    table: FloatArray,
    limit: float,
    out: NDArray[np.float32],
) -> bool:
    """Unite `out` with the wide blobs of everybody at one half instant; arguments as for `risk_raster.rasterise`.

    The levels of one person are united as if they were different people; the difference is their product, which is
    nothing at the scale of the limit.
    """
    totals = (_grid(half, 0, 1), _grid(half, 0, 2), _grid(half, 0, 3))
    parts = (_grid(half, 0, 1), _grid(half, 0, 2), _grid(half, 0, 3))
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
        sources = (_grid(half, reach1, 1), _grid(half, reach2, 2), _grid(half, reach3, 3))
        _share_out(cells[first:last], masses[first:last], origin, 2.0 * spacing, active, sources[0])
        if beyond:
            _coarser(sources[0], sources[1])
        if kernels[2].size > 1:
            _coarser(sources[1], sources[2])
        for level in range(3):
            if kernels[level].size > 1:
                _blur(sources[level], kernels[level], parts[level])
                _unite(totals[level], parts[level])
    if found:
        _refine(totals[2], totals[1])
        _refine(totals[1], totals[0])
        _refine(totals[0], out)
    return found
