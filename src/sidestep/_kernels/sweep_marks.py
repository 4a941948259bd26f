"""Which actions are best from every cell of a box: bits, found axis by axis.

The least cost of an action is found as in a sweep, one min-plus pass per axis. Each pass also tells in which rows a
component can be part of a best action at all; only there are the components of the other axes looked at. Layout as in
`sweep`, bits as in `sweep_choices`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import Values, axis_radius, row_count
from sidestep.types import IntArray

WORD = 62
"""Actions per word of a mask."""


@njit(**KERNEL, nogil=True)
def _least_of_row(source: Values, row: int, start: int, width: int, taps: Values, target: Values) -> None:
    """target[row, c] = min_u taps[0, 2, u] + source[row, c + u − reach], start ≤ c < start + width."""
    count = taps.shape[2]
    i, begin, end = np.uintp(row), np.uintp(start), np.uintp(start + width)
    if count == 5:
        t0, t1, t2, t3, t4 = taps[0, 2, 0], taps[0, 2, 1], taps[0, 2, 2], taps[0, 2, 3], taps[0, 2, 4]
        one, two = np.uintp(1), np.uintp(2)
        for c in range(begin, end):
            a = t0 + source[i, c - two]
            b = t1 + source[i, c - one]
            e = t2 + source[i, c]
            f = t3 + source[i, c + one]
            q = t4 + source[i, c + two]
            a = a if a < b else b
            e = e if e < f else f
            a = a if a < e else e
            target[i, c] = a if a < q else q
        return
    for u in range(count):
        tap, shift = taps[0, 2, u], np.uintp(count // 2)
        for c in range(begin, end):
            q = tap + source[i, c + np.uintp(u) - shift]
            target[i, c] = q if u == 0 or q < target[i, c] else target[i, c]


@njit(**KERNEL, nogil=True)
def _least_of_rows(
    source: Values, row: int, stride: int, start: int, width: int, taps: Values, axis: int, target: Values, to_row: int
) -> None:
    """target[to_row, c] = min_u taps[0, axis, u] + source[row + (u − reach)·stride, c], start ≤ c < start + width."""
    count = taps.shape[2]
    o, begin, end = np.uintp(to_row), np.uintp(start), np.uintp(start + width)
    for u in range(count):
        tap, i = taps[0, axis, u], np.uintp(row + (u - count // 2) * stride)
        for c in range(begin, end):
            q = tap + source[i, c]
            target[o, c] = q if u == 0 or q < target[o, c] else target[o, c]


@njit(**KERNEL, nogil=True)
def _any_within(values: Values, row: int, tap: float, start: int, width: int, limits: Values) -> bool:
    """Whether tap + values[row, c] ≤ limits[0, c] for any start ≤ c < start + width."""
    i, zero, hits = np.uintp(row), np.uintp(0), np.int32(0)
    added = limits.dtype.type(tap)
    for c in range(np.uintp(start), np.uintp(start + width)):
        hits = np.int32(hits | (np.int32(1) if added + values[i, c] <= limits[zero, c] else np.int32(0)))
    return hits != 0


@njit(**KERNEL, nogil=True)
def _mark_group(
    cost: Values, row: int, aside: float, start: int, width: int, taps: Values, limits: Values,
    groups: NDArray[np.int32], masks: IntArray, action: int, column: int,
) -> None:  # fmt: skip
    """Set the bits of the actions `action` + u within their limits, u the component along the last axis."""
    count = taps.shape[2]
    i, begin, n, zero = np.uintp(row), np.uintp(start), np.uintp(width), np.uintp(0)
    for u in range(count):
        tap, from_ = limits.dtype.type(aside) + taps[0, 2, u], begin + np.uintp(u) - np.uintp(count // 2)
        bit, none = np.int32(1 << u), np.int32(0)
        for c in range(n):
            hit = bit if tap + cost[i, from_ + c] <= limits[zero, begin + c] else none
            groups[c] = hit if u == 0 else groups[c] | hit
    word, shift, to = np.uintp(action // WORD), np.int64(action % WORD), np.uintp(column)
    whole = (np.int64(1) << np.int64(WORD)) - 1
    for c in range(n):
        masks[word, to + c] |= (np.int64(groups[c]) << shift) & whole
    if shift + count > WORD:
        for c in range(n):
            masks[word + np.uintp(1), to + c] |= np.int64(groups[c]) >> (np.int64(WORD) - shift)


@njit(**KERNEL, nogil=True)
def _mark_row(
    cost: Values, taps: Values, row: int, start: int, width: int, rows: int, dimension: int, tolerance: float,
    along: Values, across: Values, limits: Values, groups: NDArray[np.int32], masks: IntArray, column: int,
) -> None:  # fmt: skip
    """Bits of a row of cells, where `along` and `across` hold what the rows around it cost at least."""
    count = taps.shape[2]
    r0, r1 = axis_radius(count // 2, dimension)
    zero, begin, end = np.uintp(0), np.uintp(start), np.uintp(start + width)
    nothing = limits.dtype.type(-1.0)
    if dimension == 3:
        _least_of_rows(across, row, rows, start, width, taps, 0, limits, 0)
    elif dimension == 2:
        _least_of_rows(along, row, 1, start, width, taps, 1, limits, 0)
    else:
        for c in range(begin, end):
            limits[zero, c] = along[zero, c]
    for c in range(begin, end):
        best = limits[zero, c]
        limits[zero, c] = best + (tolerance * abs(best) + 1e-12) if best < np.inf else nothing
    for word in range(np.uintp(masks.shape[0])):
        for c in range(np.uintp(column), np.uintp(column + width)):
            masks[word, c] = 0
    for u0 in range(-r0, r0 + 1):
        far = row + u0 * rows
        first = taps[0, 0, u0 + count // 2]
        if r0 > 0 and not _any_within(across, far, first, start, width, limits):
            continue
        for u1 in range(-r1, r1 + 1):
            both = first + taps[0, 1, u1 + count // 2]
            if r1 > 0 and not _any_within(along, far + u1, both, start, width, limits):
                continue
            action = ((u0 + r0) * (2 * r1 + 1) + u1 + r1) * count
            _mark_group(cost, far + u1, both, start, width, taps, limits, groups, masks, action, column)


@njit(**KERNEL, nogil=True)
def mark_box(
    cost: Values,
    taps: Values,
    radius: int,
    centre: int,
    dimension: int,
    tolerance: float,
    along: Values,
    across: Values,
    limits: Values,
    groups: NDArray[np.int32],
    masks: IntArray,
    column: int,
) -> None:
    """Bits of the actions within `tolerance` of the least cost, for every cell of a box; none if nothing is admissible.

    Args:
        cost: (rows, C) of arriving at a cell with the first action, on the box of `radius` + reach.
        taps: (M, 3, T), [0] is the cost of the first action's components.
        radius: of the box.
        centre: index of the anchor.
        dimension: d.
        tolerance: relative; costs this close are tied.
        along: (rows, C) scratch.
        across: the same in 3-D.
        limits: (≥ 1, C) scratch.
        groups: (C,) scratch.
        masks: written from `column` on.
        column: where the box begins.
    """
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    r0, r1 = axis_radius(taps.shape[2] // 2, dimension)
    start, width = centre - radius, 2 * radius + 1
    for i0 in range(c0 - b0 - r0, c0 + b0 + r0 + 1):
        for i1 in range(c1 - b1 - r1, c1 + b1 + r1 + 1):
            _least_of_row(cost, i0 * rows + i1, start, width, taps, along)
        for i1 in range(c1 - b1, c1 + b1 + 1 if dimension == 3 else c1 - b1):
            _least_of_rows(along, i0 * rows + i1, 1, start, width, taps, 1, across, i0 * rows + i1)
    for i0 in range(c0 - b0, c0 + b0 + 1):
        for i1 in range(c1 - b1, c1 + b1 + 1):
            _mark_row(
                cost, taps, i0 * rows + i1, start, width, rows, dimension, tolerance, along, across, limits, groups,
                masks, column,
            )  # fmt: skip
            column += width


@njit(**KERNEL, nogil=True)
def mark_part(
    cost: Values, taps: Values, part: IntArray, tolerance: float, along: Values, limits: Values,
    groups: NDArray[np.int32], masks: IntArray, corner: int, pitch: int,
) -> None:  # fmt: skip
    """The same in 2-D for a part of the lattice (see `sweep_near`) alone.

    Args:
        cost: (rows, C), on the part and reach around it; the other arguments are those of `mark_box`.
        part: (rows + 1, 2) columns of every row.
        corner: where in `masks` column 0 of row 0 would be.
        pitch: between rows.
    """
    reach, top, bottom = taps.shape[2] // 2, part[-1, 0], part[-1, 1]
    for row in range(top - reach, bottom + reach + 1):
        first, last = along.shape[1], -1
        for near in range(max(row - reach, top), min(row + reach, bottom) + 1):
            if part[near, 0] <= part[near, 1]:
                first, last = min(first, part[near, 0]), max(last, part[near, 1])
        if first <= last:
            _least_of_row(cost, row, first, last - first + 1, taps, along)
    for row in range(top, bottom + 1):
        first, last = part[row, 0], part[row, 1]
        if first <= last:
            _mark_row(
                cost, taps, row, first, last - first + 1, 0, 2, tolerance, along, along, limits, groups, masks,
                corner + row * pitch + first,
            )  # fmt: skip
