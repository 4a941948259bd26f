"""The wide part of the risk: blobs that are smooth at the scale of coarser lattices, summed there and brought back.

Level l is a lattice of 2^l robot cells, l = 1..3. A cell's mass is shared among the coarse cells around it, which adds
h²/6 of variance (h the coarse spacing) that is taken off the blob's own.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep._kernels.risk_profile import TAIL, add_class, blob
from sidestep.types import FloatArray, IntArray

Singles = NDArray[np.float32]

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


@njit(**KERNEL)
def level_of(sigma: float, spacing: float) -> int:
    """Return the coarsest level at which a blob is wide; 0: none."""
    level = 0
    while level < LEVELS - 1 and sigma >= WIDE * spacing * 2 ** (level + 1):
        level += 1
    return level


@njit(**KERNEL)
def _kernel(
    radius: float, weights: FloatArray, sigmas: FloatArray, h: float, most: IntArray, table: FloatArray, least: float
) -> Singles:
    """Mixture of wide blobs, dilated by `radius`, on a lattice of spacing h out to where it falls to `least`.

    It is even along every axis: only what is not negative is written, and no more than `most` (3,) cells from 0. Blobs
    of metres on a lattice of millimetres would fill the memory.
    """
    reach = _reach(radius, weights, sigmas, least)
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
    out = np.zeros((min(r, most[0]) + 1, min(r, most[1]) + 1, min(r, most[2]) + 1), np.float32)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                t = math.sqrt(i * i + j * j + k * k) * h / reach * (RINGS - 1)
                if t >= last:
                    break
                n = int(t)
                out[i, j, k] = curve[n] + (t - n) * (curve[n + 1] - curve[n])
    return out


@njit(**KERNEL)
def _reach(radius: float, weights: FloatArray, sigmas: FloatArray, least: float) -> float:
    """How far the mixture is looked at, m."""
    widest = 0.0
    for c in range(sigmas.size):
        if weights[c] > 0.0:
            widest = max(widest, sigmas[c])
    return radius + (FAR if least > FAR_SHARE else TAIL) * widest


@njit(**KERNEL)
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


@njit(**KERNEL)
def _coarsen(fine: FloatArray, low: IntArray, active: IntArray) -> tuple[FloatArray, IntArray]:
    """What `_share_out` would have given on a lattice of twice the spacing, and its lowest cell.

    Shares that fall off linearly are themselves sums of such shares on the finer lattice: ½, 1, ½.
    """
    first, count = np.zeros(3, np.int64), np.ones(3, np.int64)
    for a in range(3):
        if active[a]:
            first[a] = low[a] >> 1
            count[a] = ((low[a] + fine.shape[a]) >> 1) - first[a] + 1
    out = np.zeros((count[0], count[1], count[2]))
    for i in range(fine.shape[0]):
        x = i + low[0]
        for j in range(fine.shape[1]):
            y = j + low[1]
            for k in range(fine.shape[2]):
                mass = fine[i, j, k]
                if mass == 0.0:
                    continue
                z = k + low[2]
                part = mass / ((1 + (x & 1)) * (1 + (y & 1)) * (1 + (z & 1)))
                for p in range((x >> 1) - first[0], ((x + 1) >> 1) - first[0] + 1):
                    for q in range((y >> 1) - first[1], ((y + 1) >> 1) - first[1] + 1):
                        for r in range((z >> 1) - first[2], ((z + 1) >> 1) - first[2] + 1):
                            out[p, q, r] += part
    return out, first


@njit(**KERNEL)
def _gather(source: FloatArray, i: int, j: int, shift: int, line: Singles) -> bool:
    """line[c] += source[i, j, c + shift], where there is such a row; True if there is."""
    if i < 0 or j < 0 or i >= source.shape[0] or j >= source.shape[1]:
        return False
    first, last = max(0, -shift), min(line.size, source.shape[2] - shift)
    row, target = source[i, j, first + shift : last + shift], line[first:last]
    for c in range(np.uintp(row.size)):
        target[c] += np.float32(row[c])
    return True


@njit(**KERNEL)
def _weigh(line: Singles, kernel: Singles, sums: Singles) -> None:
    """sums[c] += kernel[0]·line[c + r] + Σ_w kernel[w]·(line[c + r − w] + line[c + r + w]), r = kernel.size − 1."""
    r = np.uintp(kernel.size - 1)
    for c in range(np.uintp(sums.size)):
        sums[c] += kernel[0] * line[c + r]
    for w in range(np.uintp(1), r + np.uintp(1)):
        weight = kernel[w]
        if weight == 0.0:
            return
        left, right = r - w, r + w
        for c in range(np.uintp(sums.size)):
            sums[c] += weight * (line[c + left] + line[c + right])


@njit(**KERNEL)
def _blur(
    source: FloatArray, source_low: IntArray, kernel: Singles, total: FloatArray, low: IntArray, size: IntArray
) -> None:
    """Unite `total` (flat, over the box `low`, `size`) with source ⊗ kernel, where the kernel reaches.

    The kernel is even, so the rows (and then the cells) on either side are added before they are weighed.
    """
    r0, r1, r2 = kernel.shape[0] - 1, kernel.shape[1] - 1, kernel.shape[2] - 1
    first = max(0, source_low[2] - r2 - low[2])
    last = min(size[2], source_low[2] + source.shape[2] + r2 - low[2])
    if first >= last:
        return
    shift = first + low[2] - r2 - source_low[2]
    line, sums = np.empty(last - first + 2 * r2, np.float32), np.empty(last - first, np.float32)
    for a in range(size[0]):
        i = a + low[0] - source_low[0]
        if i < -r0 or i >= source.shape[0] + r0:
            continue
        for b in range(size[1]):
            j = b + low[1] - source_low[1]
            if j < -r1 or j >= source.shape[1] + r1:
                continue
            sums[:] = np.float32(0.0)
            for u in range(r0 + 1):
                for v in range(r1 + 1):
                    if kernel[u, v, 0] == 0.0:
                        break
                    line[:] = np.float32(0.0)
                    some = _gather(source, i + u, j + v, shift, line)
                    if u > 0:
                        some |= _gather(source, i - u, j + v, shift, line)
                    if v > 0:
                        some |= _gather(source, i + u, j - v, shift, line)
                    if u > 0 and v > 0:
                        some |= _gather(source, i - u, j - v, shift, line)
                    if some:
                        _weigh(line, kernel[u, v], sums)
            start = (a * size[1] + b) * size[2]
            row = total[start + first : start + last]
            for c in range(np.uintp(row.size)):
                p = min(sums[c], np.float32(1.0))
                row[c] += p - row[c] * p


@njit(**KERNEL)
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


@njit(**KERNEL)
def add_wide(
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
    lows: IntArray,
    sizes: IntArray,
    starts: IntArray,
    totals: FloatArray,
) -> bool:
    """Unite the totals of every level with those blobs of one person that belong to it.

    The levels of one person are united as if they were different people; the difference is their product, which is
    nothing at the scale of the limit.

    Args:
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
        lows, sizes, starts: of `coarse_boxes`.
        totals: flat.

    Returns:
        True if anything was added.
    """
    least = LEAST * limit
    chosen, nearest = np.zeros((LEVELS, weights.size)), np.zeros(LEVELS)
    for c in range(weights.size):
        level = level_of(sigmas[c], spacing)
        if level > 0 and weights[c] > 0.0:
            chosen[level, c] = weights[c]
            nearest[level] += weights[c] * blob(gap, radius, sigmas[c], table)
    finest, coarsest, reach = LEVELS, 0, 0.0
    for level in range(1, LEVELS):
        if nearest[level] >= least:
            finest, coarsest = min(finest, level), level
            reach = max(reach, _reach(radius, chosen[level], sigmas, least))
    if coarsest == 0:
        return False
    scale = 1.0 / 2**finest
    margin = int(reach * scale / spacing) + 2 ** (coarsest - finest + 2)  # cells of what the coarsest box is read from
    low, count = np.zeros(3, np.int64), np.ones(3, np.int64)
    for a in range(3):
        if active[a]:
            low[a] = max(math.floor(bounds[0, a] * scale), lows[finest, a] - margin)
            last = min(math.floor(bounds[1, a] * scale) + 1, lows[finest, a] + sizes[finest, a] - 1 + margin)
            if last < low[a]:
                return False
            count[a] = last - low[a] + 1
    source, most = np.zeros((count[0], count[1], count[2])), np.empty(3, np.int64)  # most: cells from mass to box
    _share_out(places, masses, scale, active, low, source)
    for level in range(finest, coarsest + 1):
        if level > finest:
            source, low = _coarsen(source, low, active)
        if nearest[level] >= least:
            for a in range(3):
                last = max(low[a] + source.shape[a] - lows[level, a], lows[level, a] + sizes[level, a] - low[a]) - 1
                most[a] = max(last, 0) * active[a]
            kernel = _kernel(radius, chosen[level], sigmas, spacing * 2**level, most, table, least)
            _blur(source, low, kernel, totals[starts[level] : starts[level + 1]], lows[level], sizes[level])
    return True


@njit(**KERNEL)
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
