"""Mass within a distance of single points, exactly.

All kernels work on three axes; in 1-D and 2-D the leading axes hold a single cell. A person's mass at the half instants
0, ½, 1, … is one flat array: block b starts at `offsets[b]`, is a box of radius `radii[b]` cells (on the active axes
only) with `spacings[b]` m between the cells, last axis fastest.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray, IntArray

EXACT = 1e-5
"""Probability that the risk of a spread-out person may be too high by, never too low."""


@njit(**KERNEL)
def mass_within(
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
) -> FloatArray:
    """Sum, for every point, the mass of the cells closer than `distance`; only they are looked at.

    Args:
        points: (M, 3) m, world.
        instants: (M,) block that each point meets.
        flat: the mass, with `offsets`, `radii` and `spacings` as in the module.
        offsets: (B + 1,).
        radii: (B,) cells.
        spacings: (B,) m.
        origin: (3,) m.
        rotation: (3, 3), columns are the lattice axes.
        active: (3,) 1 where the axis exists.
        distance: m.

    Returns:
        (M,) probabilities.
    """
    out = np.zeros(points.shape[0])
    low = np.zeros(3, np.int64)
    high = np.zeros(3, np.int64)
    local = np.zeros(3)
    for m in range(points.shape[0]):
        block = instants[m]
        if offsets[block] == offsets[block + 1]:
            continue
        r = radii[block]
        reach = distance * (1.0 - 1e-9) / spacings[block]
        for a in range(3):
            s = 0.0
            for b in range(3):
                s += rotation[b, a] * (points[m, b] - origin[b])
            local[a] = s / spacings[block]
            low[a] = max(-r * active[a], math.ceil(local[a] - reach))
            high[a] = min(r * active[a], math.floor(local[a] + reach))
        w1 = 2 * r * active[1] + 1
        w2 = 2 * r * active[2] + 1
        total = 0.0
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                row = offsets[block] + ((i + r * active[0]) * w1 + j + r * active[1]) * w2 + r * active[2]
                rest = reach * reach - (i - local[0]) ** 2 - (j - local[1]) ** 2
                for k in range(low[2], high[2] + 1):
                    if (k - local[2]) ** 2 <= rest:
                        total += flat[row + k]
        out[m] = min(total, 1.0)
    return out


@njit(**KERNEL)
def mass_near(
    points: FloatArray,
    instants: IntArray,
    flat: FloatArray,
    offsets: IntArray,
    radii: IntArray,
    spacings: FloatArray,
    origin: FloatArray,
    rotation: FloatArray,
    active: IntArray,
    spans: IntArray,
    span_starts: IntArray,
    outside: FloatArray,
    samples: FloatArray,
    grids: FloatArray,
) -> FloatArray:
    """Sum, for every point, Σ_x mass(x)·F(‖point − x‖) with the tabulated F of the block.

    What lies outside the spans of a block that F reaches is counted as if it were near; `EXACT` says how much that may
    be.

    Args:
        points: (M, 3) m, world.
        instants: (M,) block that each point meets.
        flat: the mass; this and the next six as for `mass_within`.
        offsets: (B + 1,).
        radii: (B,) cells.
        spacings: (B,) m.
        origin: (3,) m.
        rotation: (3, 3).
        active: (3,).
        spans: as `row_spans` returns them, and so are the next two.
        span_starts: (B + 1,).
        outside: (B,).
        samples: (B, ·) of F.
        grids: (B, 4), see `profile_value`.

    Returns:
        (M,) probabilities.
    """
    out = np.zeros(points.shape[0])
    widest = 0
    for m in range(points.shape[0]):
        widest = max(widest, radii[instants[m]])
    place = np.empty(2 * widest + 1)
    local = np.zeros(3)
    low, high = np.zeros(3, np.int64), np.zeros(3, np.int64)
    last = samples.shape[1] - 1
    for m in range(points.shape[0]):
        block = instants[m]
        if offsets[block] == offsets[block + 1]:
            continue
        r, spacing = radii[block], spacings[block]
        radius, scale, first, step = grids[block]
        far = first + step * last
        reach = (radius + scale * far / (1.0 - far)) / spacing
        reached = True
        for a in range(3):
            local[a] = 0.0
            for b in range(3):
                local[a] += rotation[b, a] * (points[m, b] - origin[b]) / spacing
            low[a] = max(-r * active[a], math.ceil(local[a] - reach))
            high[a] = min(r * active[a], math.floor(local[a] + reach))
            reached = reached and low[a] <= high[a]
        if not reached:
            continue
        r0, r1, r2 = r * active[0], r * active[1], r * active[2]
        curve = samples[block]
        per_sample, offset, top = 1.0 / step, first / step, last - 1e-9
        total = outside[block]
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                line = (i + r0) * (2 * r1 + 1) + j + r1
                aside = (i - local[0]) ** 2 + (j - local[1]) ** 2
                left, right = spans[span_starts[block] + line, 0], spans[span_starts[block] + line, 1]
                if left >= right or aside > reach * reach:
                    continue
                chord = math.sqrt(reach * reach - aside)
                left, right = max(left, math.ceil(local[2] - chord)), min(right, math.floor(local[2] + chord) + 1)
                if left >= right:
                    continue
                at = np.uintp(offsets[block] + line * (2 * r2 + 1) + r2 + left)
                n, start = np.uintp(right - left), left - local[2]
                for c in range(n):  # apart from the look-up below, so that it runs on whole registers
                    along = start + c
                    x = spacing * math.sqrt(aside + along * along) - radius
                    t = x / (abs(x) + scale) * per_sample - offset
                    place[c] = t if t < top else top
                for c in range(n):
                    q = np.uint32(place[c])
                    total += flat[at + c] * (curve[q] + (place[c] - q) * (curve[q + 1] - curve[q]))
        out[m] = min(total, 1.0)
    return out


@njit(**KERNEL)
def _none_above(flat: FloatArray, at: int, count: int, cut: float) -> bool:
    """Whether all of some numbers in a row are below `cut`; without branches, so that it runs on whole registers."""
    first, hits = np.uintp(at), np.int64(0)
    for n in range(np.uintp(count)):
        hits += np.int64(1) if flat[first + n] >= cut else np.int64(0)
    return hits == 0


@njit(**KERNEL)
def _total(flat: FloatArray, at: int, count: int) -> float:
    """Sum of some numbers in a row, four at a time: one sum alone would wait for each addition."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    last = at + count
    while at + 4 <= last:
        a, b, c, d = a + flat[at], b + flat[at + 1], c + flat[at + 2], d + flat[at + 3]
        at += 4
    while at < last:
        a += flat[at]
        at += 1
    return (a + b) + (c + d)


@njit(**KERNEL)
def row_spans(
    flat: FloatArray, offsets: IntArray, radii: IntArray, active: IntArray, tolerance: float
) -> tuple[IntArray, IntArray, FloatArray]:
    """Where the mass lies in every row of every block.

    Args:
        flat: the mass, with the next three as in the module.
        offsets: (B + 1,).
        radii: (B,) cells.
        active: (3,).
        tolerance: probability that may lie outside the spans of a block.

    Returns:
        (rows, 2) first cell and one past the last, counted from the anchor's column (equal: none), (B + 1,) where the
        rows of each block begin, and (B,) the probability outside.
    """
    blocks = radii.size
    starts = np.zeros(blocks + 1, np.int64)
    for b in range(blocks):
        lines = (2 * radii[b] * active[0] + 1) * (2 * radii[b] * active[1] + 1)
        starts[b + 1] = starts[b] + (lines if offsets[b + 1] > offsets[b] else 0)
    spans = np.zeros((starts[blocks], 2), np.int64)
    outside = np.zeros(blocks)
    for b in range(blocks):
        r = radii[b] * active[2]
        cut = max(tolerance / max(offsets[b + 1] - offsets[b], 1), 1e-300)
        for line in range(starts[b + 1] - starts[b]):
            at = offsets[b] + line * (2 * r + 1)
            if _none_above(flat, at, 2 * r + 1, cut):  # most rows
                outside[b] += _total(flat, at, 2 * r + 1)
                continue
            left, right = at, at + 2 * r + 1
            while flat[left] < cut:
                outside[b] += flat[left]
                left += 1
            while flat[right - 1] < cut:
                outside[b] += flat[right - 1]
                right -= 1
            spans[starts[b] + line, 0], spans[starts[b] + line, 1] = left - at - r, right - at - r
    return spans, starts, outside


@njit(**KERNEL)
def _cutoff(
    flat: FloatArray, first: int, width: int, spans: IntArray, dropped: float, cells: int, tolerance: float
) -> float:
    """Largest power of two such that all smaller masses of a block together weigh at most `tolerance`.

    Rows of `width` cells, the anchor's column of the first at `first`; outside their spans there is `dropped`.
    """
    if tolerance <= 0.0:
        return 0.0
    weight = np.zeros(64)
    exponents = flat.view(np.int64)
    least = 1e-3 * tolerance / max(cells, 1)  # most cells; they need no place among the others
    for line in range(spans.shape[0]):
        for n in range(first + line * width + spans[line, 0], first + line * width + spans[line, 1]):
            if flat[n] < least:
                dropped += flat[n]
                continue
            e = 1022 - (exponents[n] >> 52)
            weight[min(max(e, 0), 63)] += flat[n]
    for e in range(63, -1, -1):
        dropped += weight[e]
        if dropped > tolerance:
            return 0.0 if e == 63 else 2.0 ** (-e - 1)
    return 1.0


@njit(**KERNEL)
def compact(
    flat: FloatArray,
    offsets: IntArray,
    radii: IntArray,
    spacings: FloatArray,
    origin: FloatArray,
    rotation: FloatArray,
    active: IntArray,
    spans: IntArray,
    span_starts: IntArray,
    outside: FloatArray,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """List the cells that matter; tails that weigh at most `tolerance` together are left out of each block.

    Args:
        flat: the mass, with `offsets`, `radii` and `spacings` as in the module.
        offsets: (B + 1,).
        radii: (B,) cells.
        spacings: (B,) m.
        origin: (3,) m.
        rotation: (3, 3), columns are the lattice axes.
        active: (3,) 1 where the axis exists.
        spans: as `row_spans` returns them for no more than `tolerance`, and so are the next two.
        span_starts: (B + 1,).
        outside: (B,).
        tolerance: probability.

    Returns:
        cells (M, 3) m in the world, masses (M,), and starts (B + 1,) of the blocks within them.
    """
    blocks = radii.size
    cut = np.zeros(blocks)
    starts = np.zeros(blocks + 1, np.int64)
    for b in range(blocks):
        rows, r = spans[span_starts[b] : span_starts[b + 1]], radii[b] * active[2]
        first, width = offsets[b] + r, 2 * r + 1
        cells_of_block = offsets[b + 1] - offsets[b]
        cut[b] = max(_cutoff(flat, first, width, rows, outside[b], cells_of_block, tolerance), 1e-300)
        count = 0
        for line in range(rows.shape[0]):
            at = np.uintp(first + line * width + rows[line, 0])
            for n in range(np.uintp(rows[line, 1] - rows[line, 0])):
                count += np.int64(1) if flat[at + n] >= cut[b] else np.int64(0)
        starts[b + 1] = starts[b] + count
    cells = np.empty((starts[blocks], 3))
    masses = np.empty(starts[blocks])
    n = 0
    for b in range(blocks):
        if starts[b + 1] == starts[b]:
            continue
        r0, r1, r2 = radii[b] * active[0], radii[b] * active[1], radii[b] * active[2]
        first, width, line = offsets[b] + r2, 2 * r2 + 1, span_starts[b]
        for i in range(-r0, r0 + 1):
            for j in range(-r1, r1 + 1):
                for k in range(spans[line, 0], spans[line, 1]):
                    x = flat[first + (line - span_starts[b]) * width + k]
                    if x >= cut[b]:
                        for a in range(3):
                            turned = rotation[a, 0] * i + rotation[a, 1] * j + rotation[a, 2] * k
                            cells[n, a] = origin[a] + spacings[b] * turned
                        masses[n] = x
                        n += 1
                line += 1
    return cells, masses, starts
