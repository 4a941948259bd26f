"""Mass within a distance: exactly at single points, and as rasters over the robot's lattice.

All kernels work on three axes; in 1-D and 2-D the leading axes hold a single cell. A person's mass at the half instants
0, ½, 1, … is one flat array: block i starts at `offsets[i]`, is a box of radius `radii[i]` cells (on the active axes
only) with `spacings[i]` m between the cells, last axis fastest.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.risk_profile import profile_value
from sidestep.types import FloatArray, IntArray


@njit(cache=True)
def mass_at(
    points: FloatArray,
    instants: IntArray,
    flat: FloatArray,
    offsets: IntArray,
    radii: IntArray,
    spacings: FloatArray,
    origin: FloatArray,
    rotation: FloatArray,
    active: IntArray,
    distance: float,
    sharp: bool,
    tables: FloatArray,
    grids: FloatArray,
    reaches: FloatArray,
) -> FloatArray:
    """Sum, for every point, the mass near it: Σ_x mass(x)·F(‖point − x‖), over the cells that can contribute.

    Args:
        points: (M, 3) m, world; instants: (M,) index of the block that each point meets.
        flat, offsets, radii, spacings: the mass (see the module).
        origin: (3,) m; rotation: (3, 3); active: (3,) 1 where the axis exists.
        distance: m; with `sharp`, F is 1 closer than this and 0 elsewhere.
        tables: (blocks, samples) of F; grids: (blocks, 4), see `profile_value`; reaches: (blocks,) m, F is 0 beyond.
            Unused when sharp.

    Returns:
        (M,) probabilities.
    """
    out = np.zeros(points.shape[0])
    low = np.zeros(3, np.int64)
    high = np.zeros(3, np.int64)
    local = np.zeros(3)
    for m in range(points.shape[0]):
        block = instants[m]
        h = spacings[block]
        r = radii[block]
        reach = distance * (1.0 - 1e-9)
        if not sharp:
            reach = reaches[block]
        for a in range(3):
            s = 0.0
            for b in range(3):
                s += rotation[b, a] * (points[m, b] - origin[b])
            local[a] = s / h
            low[a] = max(-r * active[a], math.ceil(local[a] - reach / h))
            high[a] = min(r * active[a], math.floor(local[a] + reach / h))
        w1 = 2 * r * active[1] + 1
        w2 = 2 * r * active[2] + 1
        limit = (reach / h) ** 2
        total = 0.0
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                row = offsets[block] + ((i + r * active[0]) * w1 + j + r * active[1]) * w2 + r * active[2]
                near = (i - local[0]) ** 2 + (j - local[1]) ** 2
                for k in range(low[2], high[2] + 1):
                    d2 = near + (k - local[2]) ** 2
                    if d2 <= limit:
                        mass = flat[row + k]
                        if sharp:
                            total += mass
                        elif mass > 0.0:
                            total += mass * profile_value(math.sqrt(d2) * h, tables[block], grids[block])
        out[m] = min(total, 1.0)
    return out


@njit(cache=True)
def _cutoff(block: FloatArray, tolerance: float) -> float:
    """Largest power of two such that all smaller masses together weigh at most `tolerance`."""
    weight = np.zeros(64)
    for x in block:
        if x > 0.0:
            e = -math.frexp(x)[1]
            weight[min(max(e, 0), 63)] += x
    dropped = 0.0
    for e in range(63, -1, -1):
        dropped += weight[e]
        if dropped > tolerance:
            return 0.0 if e == 63 else 2.0 ** (-e - 1)
    return 1.0


@njit(cache=True)
def compact(
    flat: FloatArray,
    offsets: IntArray,
    radii: IntArray,
    spacings: FloatArray,
    origin: FloatArray,
    rotation: FloatArray,
    active: IntArray,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """List the cells that matter; tails that weigh at most `tolerance` together are left out of each block.

    Returns:
        points (M, 3) m in the world, masses (M,), and starts (blocks + 1,) of the blocks within them.
    """
    blocks = radii.size
    cut = np.zeros(blocks)
    starts = np.zeros(blocks + 1, np.int64)
    for b in range(blocks):
        part = flat[offsets[b] : offsets[b + 1]]
        cut[b] = _cutoff(part, tolerance)
        count = 0
        for x in part:
            if x > 0.0 and x >= cut[b]:
                count += 1
        starts[b + 1] = starts[b] + count
    points = np.empty((starts[blocks], 3))
    masses = np.empty(starts[blocks])
    n = 0
    for b in range(blocks):
        r0, r1, r2 = radii[b] * active[0], radii[b] * active[1], radii[b] * active[2]
        at = offsets[b]
        for i in range(-r0, r0 + 1):
            for j in range(-r1, r1 + 1):
                for k in range(-r2, r2 + 1):
                    x = flat[at]
                    at += 1
                    if x > 0.0 and x >= cut[b]:
                        for a in range(3):
                            turned = rotation[a, 0] * i + rotation[a, 1] * j + rotation[a, 2] * k
                            points[n, a] = origin[a] + spacings[b] * turned
                        masses[n] = x
                        n += 1
    return points, masses, starts


@njit(cache=True)
def _add_ball(
    ends: FloatArray, c0: float, c1: float, c2: float, radius: float, mass: float, half: IntArray, box: IntArray
) -> None:
    """Add `mass` to all cells within `radius` of c, as differences along the middle axis; grow `box` around them."""
    reach = radius * (1.0 - 1e-9)
    for i in range(max(-half[0], math.ceil(c0 - reach)), min(half[0], math.floor(c0 + reach)) + 1):
        for k in range(max(-half[2], math.ceil(c2 - reach)), min(half[2], math.floor(c2 + reach)) + 1):
            rest = reach * reach - (i - c0) ** 2 - (k - c2) ** 2
            if rest < 0.0:
                continue
            h = math.sqrt(rest)
            low = max(-half[1], math.ceil(c1 - h)) + half[1]
            high = min(half[1], math.floor(c1 + h)) + half[1]
            if low > high:
                continue
            ii = i + half[0]
            kk = k + half[2]
            ends[ii, low, kk] += mass
            ends[ii, high + 1, kk] -= mass
            box[0] = min(box[0], ii)
            box[1] = max(box[1], ii)
            box[2] = min(box[2], low)
            box[3] = max(box[3], high)
            box[4] = min(box[4], kk)
            box[5] = max(box[5], kk)


@njit(cache=True)
def _merge(ends: FloatArray, out: NDArray[np.float32], box: IntArray) -> None:
    """Sum the differences, combine with the people before (1 − Π(1 − P)), and leave `ends` at zero."""
    for i in range(box[0], box[1] + 1):
        for j in range(box[2], box[3] + 1):
            row = ends[i, j, box[4] : box[5] + 1]
            following = ends[i, j + 1, box[4] : box[5] + 1]
            target = out[i, j, box[4] : box[5] + 1]
            for k in range(row.size):
                p = row[k]
                following[k] += p
                row[k] = 0.0
                p = min(p, 1.0) if p > 1e-12 else 0.0
                target[k] = np.float32(target[k] + p - target[k] * p)
        ends[i, box[3] + 1, box[4] : box[5] + 1] = 0.0


@njit(cache=True)
def rasterise(
    points: FloatArray,
    masses: FloatArray,
    starts: IntArray,
    distances: FloatArray,
    shares: FloatArray,
    origin: FloatArray,
    spacing: float,
    block: int,
    shift: FloatArray,
    half: IntArray,
    ends: FloatArray,
    out: NDArray[np.float32],
) -> bool:
    """Fill `out` with P(anybody within the distance) over a box of the robot's lattice, at one half instant.

    Args:
        points, masses: cells of all people; starts: (P, blocks + 1) where each person's blocks lie in them.
        distances, shares: (P, blocks, S) radii in m and weights of the steps that make up F.
        origin: (3,) m, centre of the box; spacing: m; shift: (3,) cells, added to every cell's place.
        block: half instant.
        half: (3,) cells from the centre to the faces; ends: (w0, w1 + 1, w2) zeros, left as zeros; out: (w0, w1, w2).

    Returns:
        True if any cell is above zero.
    """
    box = np.empty(6, np.int64)
    touched = False
    for person in range(starts.shape[0]):
        box[0], box[2], box[4] = out.shape[0], out.shape[1], out.shape[2]
        box[1] = box[3] = box[5] = -1
        for n in range(starts[person, block], starts[person, block + 1]):
            c0 = (points[n, 0] - origin[0]) / spacing - shift[0]
            c1 = (points[n, 1] - origin[1]) / spacing - shift[1]
            c2 = (points[n, 2] - origin[2]) / spacing - shift[2]
            for s in range(distances.shape[2]):
                share = shares[person, block, s]
                if share > 0.0:
                    _add_ball(ends, c0, c1, c2, distances[person, block, s] / spacing, masses[n] * share, half, box)
        if box[1] >= 0:
            touched = True
            _merge(ends, out, box)
    return touched


@njit(cache=True)
def rasterise_all(
    points: FloatArray,
    masses: FloatArray,
    starts: IntArray,
    distances: FloatArray,
    shares: FloatArray,
    origin: FloatArray,
    spacing: float,
    radius: int,
    active: IntArray,
    midway: bool,
) -> tuple[NDArray[np.float32], IntArray, NDArray[np.bool_]]:
    """Rasters for every half instant 1..2N that a robot can reach which moves up to `radius` cells per step.

    Instant 2k: the box of radius·k cells. Instant 2k+1: the points halfway between a cell of step k and one of step
    k+1, half a cell apart, split by parity into boxes of (radius·(2k+1) + 1)//2 cells: box p holds the
    points (2q + p)/2, p counting the axes in binary with the last axis lowest.

    Returns:
        values (flat), starts (2N + 2,), and (2N + 1,) whether anything but zero is there.
    """
    blocks = starts.shape[1] - 1
    begin = np.zeros(blocks + 1, np.int64)
    half = np.zeros(3, np.int64)
    parities = 1
    for a in range(3):
        parities *= 1 + active[a]
    for b in range(1, blocks):
        r = radius * (b // 2) if b % 2 == 0 else (radius * b + 1) // 2
        size = 1
        for a in range(3):
            size *= 2 * r * active[a] + 1
        if b % 2 == 1:
            size = size * parities if midway else 0
        begin[b + 1] = begin[b] + size
    values = np.zeros(begin[blocks], np.float32)
    some = np.zeros(blocks, np.bool_)
    shift = np.zeros(3)
    r = (radius * blocks + 1) // 2 + 1
    ends = np.zeros((2 * r * active[0] + 1) * (2 * r * active[1] + 2) * (2 * r * active[2] + 1))
    for b in range(1, blocks):
        if begin[b + 1] == begin[b]:
            continue
        odd = b % 2
        r = radius * (b // 2) if odd == 0 else (radius * b + 1) // 2
        for a in range(3):
            half[a] = r * active[a]
        w0, w1, w2 = 2 * half[0] + 1, 2 * half[1] + 1, 2 * half[2] + 1
        scratch = ends[: w0 * (w1 + 1) * w2].reshape((w0, w1 + 1, w2))
        for p in range(parities if odd else 1):
            bits = p
            for a in range(2, -1, -1):
                shift[a] = 0.5 * (bits & 1) if active[a] else 0.0
                bits >>= active[a]
            out = values[begin[b] + p * w0 * w1 * w2 : begin[b] + (p + 1) * w0 * w1 * w2].reshape((w0, w1, w2))
            if rasterise(points, masses, starts, distances, shares, origin, spacing, b, shift, half, scratch, out):
                some[b] = True
    return values, begin, some
