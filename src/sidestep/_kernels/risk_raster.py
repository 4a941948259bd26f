"""Risk over the robot's lattice: each person's mass, blurred and dilated by the clearance, combined over people.

Narrow blobs are drawn as a few discs by differences along the middle axis. Wide ones are smooth: they are summed on
lattices that are 2, 4 and 8 times coarser, where a cell's mass is shared among its neighbours (which adds h²/6 of
variance that is taken off the blob's own), and brought back by interpolation.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.risk_profile import TAIL, mixture
from sidestep.types import FloatArray, IntArray

LEVELS = 4
"""The robot's lattice itself, and three coarser ones."""
WIDE = 0.8
"""A blob is summed on a lattice of spacing h if σ ≥ WIDE·h."""
STEPS = 6
"""Discs that stand for a narrow blob."""
HEAVY = 0.25
"""Cells below this part of the limit are drawn as one disc; a staircase would make no difference."""


@njit(cache=True)
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
        if s == count - 1:
            level = 0.05 * anchor
        else:
            level = anchor ** ((s + 1.0) / (count - 1.0))
        if level >= top and s < count - 1:
            continue
        low, high = 0.0, radius + TAIL * widest
        for _ in range(14):
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


@njit(cache=True)
def _add_ball(
    ends: FloatArray, c0: float, c1: float, c2: float, radius: float, mass: float, half: IntArray, box: IntArray
) -> None:
    """Add `mass` to all cells within `radius` of c, as differences along the middle axis; grow `box` around them."""
    reach = radius * (1.0 - 1e-9)
    first = max(-half[2], math.ceil(c2 - reach))
    last = min(half[2], math.floor(c2 + reach))
    if first > last or c1 - reach > half[1] or c1 + reach < -half[1]:
        return
    for i in range(max(-half[0], math.ceil(c0 - reach)), min(half[0], math.floor(c0 + reach)) + 1):
        ii = i + half[0]
        box[0] = min(box[0], ii)
        box[1] = max(box[1], ii)
        for k in range(first, last + 1):
            rest = reach * reach - (i - c0) ** 2 - (k - c2) ** 2
            if rest < 0.0:
                continue
            h = math.sqrt(rest)
            low = max(-half[1], math.ceil(c1 - h)) + half[1]
            high = min(half[1], math.floor(c1 + h)) + half[1]
            if low > high:
                continue
            ends[ii, low, k + half[2]] += mass
            ends[ii, high + 1, k + half[2]] -= mass
            box[2] = min(box[2], low)
            box[3] = max(box[3], high)
    box[4] = min(box[4], first + half[2])
    box[5] = max(box[5], last + half[2])


@njit(cache=True)
def _integrate(ends: FloatArray, box: IntArray) -> None:
    """Turn the differences within `box` into sums."""
    for i in range(box[0], box[1] + 1):
        for j in range(box[2], box[3] + 1):
            row = ends[i, j, box[4] : box[5] + 1]
            following = ends[i, j + 1, box[4] : box[5] + 1]
            if j == box[3]:
                following[:] = 0.0
            else:
                for k in range(row.size):
                    following[k] += row[k]


@njit(cache=True)
def _merge(ends: FloatArray, out: NDArray[np.float32], box: IntArray) -> bool:
    """Combine one person's probabilities with those before, 1 − Π(1 − P), and leave zeros; True if any is positive."""
    largest = 0.0
    for i in range(box[0], box[1] + 1):
        for j in range(box[2], box[3] + 1):
            row = ends[i, j, box[4] : box[5] + 1]
            target = out[i, j, box[4] : box[5] + 1]
            for k in range(row.size):
                p = row[k]
                row[k] = 0.0
                p = min(p, 1.0) if p > 1e-12 else 0.0
                largest = max(largest, p)
                target[k] = np.float32(target[k] + p - target[k] * p)
    return largest > 0.0


@njit(cache=True)
def _share_out(
    cells: FloatArray,
    masses: FloatArray,
    origin: FloatArray,
    h: float,
    half: IntArray,
    active: IntArray,
    out: FloatArray,
) -> None:
    """Share every mass among the coarse cells around it, so that total and mean stay; cells beyond the box are lost."""
    for n in range(masses.size):
        c0 = (cells[n, 0] - origin[0]) / h
        c1 = (cells[n, 1] - origin[1]) / h
        c2 = (cells[n, 2] - origin[2]) / h
        i, j, k = int(math.floor(c0)), int(math.floor(c1)), int(math.floor(c2))
        a, b, c = c0 - i, c1 - j, c2 - k
        i, j, k = i + half[0], j + half[1], k + half[2]
        w0, w1, w2 = out.shape
        if i < 0 or j < 0 or k < 0 or i + active[0] >= w0 or j + active[1] >= w1 or k + active[2] >= w2:
            continue
        for p in range(1 + active[0]):
            f0 = (a if p else 1.0 - a) * masses[n]
            for q in range(1 + active[1]):
                f1 = f0 * (b if q else 1.0 - b)
                out[i + p, j + q, k] += f1 * (1.0 - c)
                if active[2]:
                    out[i + p, j + q, k + 1] += f1 * c


@njit(cache=True)
def _blur(source: FloatArray, kernel: FloatArray, out: FloatArray) -> None:
    """Add source ⊗ kernel to `out`; all three are boxes around the same centre, odd along each axis."""
    s0, s1, s2 = (source.shape[0] - 1) // 2, (source.shape[1] - 1) // 2, (source.shape[2] - 1) // 2
    r0, r1, r2 = (kernel.shape[0] - 1) // 2, (kernel.shape[1] - 1) // 2, (kernel.shape[2] - 1) // 2
    h0, h1, h2 = (out.shape[0] - 1) // 2, (out.shape[1] - 1) // 2, (out.shape[2] - 1) // 2
    for i in range(-s0, s0 + 1):
        for j in range(-s1, s1 + 1):
            for k in range(-s2, s2 + 1):
                mass = source[i + s0, j + s1, k + s2]
                if mass == 0.0:
                    continue
                first, last = max(-h2, k - r2), min(h2, k + r2)
                if first > last:
                    continue
                for a in range(max(-h0, i - r0), min(h0, i + r0) + 1):
                    for b in range(max(-h1, j - r1), min(h1, j + r1) + 1):
                        row = out[a + h0, b + h1, first + h2 : last + h2 + 1]
                        weight = kernel[a - i + r0, b - j + r1, first - k + r2 : last - k + r2 + 1]
                        for c in range(row.size):
                            row[c] += mass * weight[c]


@njit(cache=True)
def _refine(coarse: FloatArray, half: IntArray, active: IntArray, out: FloatArray) -> None:
    """Add a lattice of twice the spacing, by interpolation, to the box of `half` cells at the start of `out`."""
    g0, g1, g2 = (coarse.shape[0] - 1) // 2, (coarse.shape[1] - 1) // 2, (coarse.shape[2] - 1) // 2
    line = np.empty(coarse.shape[2])
    for i in range(-half[0], half[0] + 1):
        i0, i1 = (i >> 1) + g0, ((i + 1) >> 1) + g0
        for j in range(-half[1], half[1] + 1):
            j0, j1 = (j >> 1) + g1, ((j + 1) >> 1) + g1
            for k in range(line.size):
                line[k] = 0.25 * (coarse[i0, j0, k] + coarse[i0, j1, k] + coarse[i1, j0, k] + coarse[i1, j1, k])
            row = out[i + half[0], j + half[1]]
            if not active[2]:
                row[0] += line[0]
                continue
            odd = half[2] & 1
            base = g2 + ((-half[2] + odd) >> 1)
            for k in range((2 * half[2] + 1 - odd + 1) // 2):
                row[odd + 2 * k] += line[base + k]
            base = g2 + ((-half[2] + 1 - odd - 1) >> 1)
            for k in range((2 * half[2] + 1 - (1 - odd) + 1) // 2):
                row[1 - odd + 2 * k] += 0.5 * (line[base + k] + line[base + k + 1])


@njit(cache=True)
def _kernel(
    radius: float, weights: FloatArray, sigmas: FloatArray, h: float, active: IntArray, table: FloatArray, least: float
) -> FloatArray:
    """Mixture of wide blobs, dilated by `radius`, sampled on a lattice of spacing h out to where it falls to `least`."""
    narrowed = np.empty(sigmas.size)
    widest = 0.0
    for c in range(sigmas.size):
        narrowed[c] = math.sqrt(max(sigmas[c] ** 2 - h * h / 6.0, 0.0))
        if weights[c] > 0.0:
            widest = max(widest, sigmas[c])
    reach = radius + TAIL * widest
    while reach > radius and mixture(reach - 0.25 * h, radius, weights, narrowed, table) < least:
        reach -= 0.25 * h
    r = int(math.ceil(reach / h))
    out = np.zeros((2 * r * active[0] + 1, 2 * r * active[1] + 1, 2 * r * active[2] + 1))
    for i in range(r * active[0] + 1):
        for j in range(r * active[1] + 1):
            for k in range(r * active[2] + 1):
                d = h * math.sqrt(i * i + j * j + k * k)
                value = mixture(d, radius, weights, narrowed, table) if d <= reach else 0.0
                for p in range(-1, 2, 2):
                    for q in range(-1, 2, 2):
                        for s in range(-1, 2, 2):
                            a, b, c = p * i + r * active[0], q * j + r * active[1], s * k + r * active[2]
                            out[a, b, c] = value
    return out


@njit(cache=True)
def _wide(
    cells: FloatArray,
    masses: FloatArray,
    radius: float,
    weights: FloatArray,
    sigmas: FloatArray,
    levels: IntArray,
    origin: FloatArray,
    spacing: float,
    half: IntArray,
    active: IntArray,
    table: FloatArray,
    least: float,
    out: FloatArray,
) -> None:
    """Add the wide blobs of one person at one instant to `out`, coarsest lattice first."""
    above = np.zeros((1, 1, 1))
    carried = False
    chosen = np.zeros(weights.size)
    for level in range(LEVELS - 1, 0, -1):
        found = False
        for c in range(weights.size):
            chosen[c] = weights[c] if levels[c] == level else 0.0
            found = found or chosen[c] > 0.0
        if not found and not carried:
            continue
        h = spacing * 2**level
        box = np.empty(3, np.int64)
        for a in range(3):
            box[a] = ((half[a] + (1 << level) - 1) // (1 << level) + 1) * active[a]
        grid = np.zeros((2 * box[0] + 1, 2 * box[1] + 1, 2 * box[2] + 1))
        if found:
            kernel = _kernel(radius, chosen, sigmas, h, active, table, least)
            wider = np.empty(3, np.int64)
            for a in range(3):
                wider[a] = box[a] + (kernel.shape[a] - 1) // 2
            source = np.zeros((2 * wider[0] + 1, 2 * wider[1] + 1, 2 * wider[2] + 1))
            _share_out(cells, masses, origin, h, wider, active, source)
            _blur(source, kernel, grid)
        if carried:
            _refine(above, box, active, grid)
        above = grid
        carried = True
    if carried:
        _refine(above, half, active, out)


@njit(cache=True)
def rasterise(
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
    ends: FloatArray,
    out: NDArray[np.float32],
) -> bool:
    """Fill `out` with P(anybody within their distance) over a box of the robot's lattice, at one half instant.

    Args:
        cells: (·, 3) m, of all people.
        masses: beside them.
        starts: (P, B + 1) where each person's blocks lie in them.
        distances: (P,) m.
        weights: (P, C) of the spread classes.
        sigmas: (P, B, C) m.
        origin: (3,) m, centre of the box.
        spacing: m.
        block: half instant.
        half: (3,) cells from the centre to the faces.
        active: (3,) 1 where the axis exists.
        table: of `blob_table`.
        limit: risk limit that the raster shall serve.
        ends: (w0, w1 + 1, w2) zeros; left as zeros.
        out: (w0, w1, w2).

    Returns:
        True if any cell is above zero.
    """
    box = np.empty(6, np.int64)
    classes = weights.shape[1]
    levels = np.empty(classes, np.int64)
    narrow = np.empty(classes)
    radii, shares = np.empty(STEPS), np.empty(STEPS)
    touched = False
    for person in range(starts.shape[0]):
        first, last = starts[person, block], starts[person, block + 1]
        if first == last:
            continue
        box[0], box[2], box[4] = out.shape[0], out.shape[1], out.shape[2]
        box[1] = box[3] = box[5] = -1
        wide = False
        for c in range(classes):
            levels[c] = 0
            while levels[c] < LEVELS - 1 and sigmas[person, block, c] >= WIDE * spacing * 2 ** (levels[c] + 1):
                levels[c] += 1
            narrow[c] = weights[person, c] if levels[c] == 0 else 0.0
            wide = wide or (levels[c] > 0 and weights[person, c] > 0.0)
        used = staircase(distances[person], narrow, sigmas[person, block], table, limit, STEPS, radii, shares)
        whole = 0.0
        for s in range(used):
            whole += shares[s]
        for n in range(first, last):
            c0 = (cells[n, 0] - origin[0]) / spacing
            c1 = (cells[n, 1] - origin[1]) / spacing
            c2 = (cells[n, 2] - origin[2]) / spacing
            if masses[n] < HEAVY * limit:
                _add_ball(ends, c0, c1, c2, distances[person] / spacing, masses[n] * whole, half, box)
                continue
            for s in range(used):
                _add_ball(ends, c0, c1, c2, radii[s] / spacing, masses[n] * shares[s], half, box)
        if box[1] >= 0:
            _integrate(ends, box)
        if wide:
            _wide(
                cells[first:last], masses[first:last], distances[person], weights[person], sigmas[person, block], levels,
                origin, spacing, half, active, table, 0.01 * limit, ends,
            )  # fmt: skip
            for a in range(3):
                box[2 * a], box[2 * a + 1] = 0, out.shape[a] - 1
        if box[1] >= 0 and _merge(ends, out, box):
            touched = True
    return touched


@njit(cache=True)
def rasterise_all(
    cells: FloatArray,
    masses: FloatArray,
    starts: IntArray,
    distances: FloatArray,
    weights: FloatArray,
    sigmas: FloatArray,
    origin: FloatArray,
    spacing: float,
    radius: int,
    active: IntArray,
    table: FloatArray,
    limit: float,
    midway: bool,
) -> tuple[NDArray[np.float32], IntArray, NDArray[np.bool_]]:
    """Rasters for every half instant 1..2N that a robot can reach which moves up to `radius` cells per step.

    Half instant b covers the box of (radius·b + 1)//2 cells around the robot.

    Args:
        cells: as for `rasterise`, and so are the other arguments that it has.
        masses: beside them.
        starts: (P, B + 1).
        distances: (P,) m.
        weights: (P, C).
        sigmas: (P, B, C) m.
        origin: (3,) m, the robot.
        spacing: m.
        radius: cells per step.
        active: (3,).
        table: of `blob_table`.
        limit: risk limit.
        midway: False leaves the odd half instants out.

    Returns:
        values (flat), starts (B + 1,), and (B,) whether anything but zero is there.
    """
    blocks = starts.shape[1] - 1
    begin = np.zeros(blocks + 1, np.int64)
    half = np.zeros(3, np.int64)
    for b in range(1, blocks):
        size = 1
        for a in range(3):
            size *= 2 * ((radius * b + 1) // 2) * active[a] + 1
        begin[b + 1] = begin[b] + (size if midway or b % 2 == 0 else 0)
    values = np.zeros(begin[blocks], np.float32)
    some = np.zeros(blocks, np.bool_)
    r = (radius * blocks + 1) // 2
    ends = np.zeros((2 * r * active[0] + 1) * (2 * r * active[1] + 2) * (2 * r * active[2] + 1))
    for b in range(1, blocks):
        if begin[b + 1] == begin[b]:
            continue
        for a in range(3):
            half[a] = ((radius * b + 1) // 2) * active[a]
        w0, w1, w2 = 2 * half[0] + 1, 2 * half[1] + 1, 2 * half[2] + 1
        some[b] = rasterise(
            cells, masses, starts, distances, weights, sigmas, origin, spacing, b, half, active, table, limit,
            ends[: w0 * (w1 + 1) * w2].reshape((w0, w1 + 1, w2)),
            values[begin[b] : begin[b + 1]].reshape((w0, w1, w2)),
        )  # fmt: skip
    return values, begin, some
