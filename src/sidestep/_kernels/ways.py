"""Shortest ways over a raster: Dijkstra's algorithm with buckets instead of a heap (Dial 1969).

No move is shorter than the spacing. So cells whose values lie within one spacing of each other cannot improve one
another, and need no order among themselves: a bucket holds them, and the buckets are emptied one after another. A cell
that is improved moves to another bucket, which doubly linked lists allow at once. Four buckets reach as far as the
longest move; more are needed for the values that are given, and are used in turn.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep.types import BoolArray, FloatArray, IntArray

Cells = NDArray[np.int32]


@njit(**KERNEL)
def shortest_ways(
    values: FloatArray, free: BoolArray, shut: BoolArray, moves: IntArray, flanks: IntArray, spacing: float
) -> None:
    """Lower `values` to the shortest way from any cell to those that have one, and on from there.

    Args:
        values: (w, h) m, inf where nothing is known; written to.
        free: (w, h) the cells that ways may lead over.
        shut: (n, w, h) True where move m from this cell, and back, is not allowed; or size 0: nowhere.
        moves: (n, 2) cells, of each pair of opposite moves one.
        flanks: (n, 2, 2) from where move m begins, cells that must be free, too.
        spacing: m.
    """
    w, h = values.shape
    lengths = np.empty(moves.shape[0])
    for m in range(moves.shape[0]):
        lengths[m] = spacing * math.hypot(moves[m, 0], moves[m, 1])
    flat = values.reshape(w * h)
    least, most, longest = np.inf, 0.0, 0.0
    for c in range(flat.size):
        if flat[c] < np.inf:
            least, most = min(least, flat[c]), max(most, flat[c])
    if least == np.inf:
        return
    for m in range(lengths.size):
        longest = max(longest, lengths[m])
    count = int((most - least + longest) / spacing) + 3
    heads = np.full(count, -1, np.int32)
    after, before = np.full(flat.size, -1, np.int32), np.full(flat.size, -1, np.int32)
    waiting = 0
    for c in range(flat.size):
        if flat[c] < np.inf:
            _link(heads, after, before, c, int(flat[c] / spacing) % count)
            waiting += 1
    bucket = int(least / spacing) % count
    while waiting > 0:
        c = int(heads[bucket])
        if c < 0:
            bucket = (bucket + 1) % count
            continue
        _unlink(heads, after, before, c, bucket)
        waiting -= 1
        i, j = c // h, c % h
        for m in range(moves.shape[0]):
            for sign in (1, -1):
                a, b = i + sign * moves[m, 0], j + sign * moves[m, 1]
                if a < 0 or b < 0 or a >= w or b >= h or not free[a, b]:
                    continue
                if not (
                    free[i + sign * flanks[m, 0, 0], j + sign * flanks[m, 0, 1]]
                    and free[i + sign * flanks[m, 1, 0], j + sign * flanks[m, 1, 1]]
                ):
                    continue
                if shut.size > 0 and (shut[m, i, j] if sign == 1 else shut[m, a, b]):
                    continue
                there, way = a * h + b, flat[c] + lengths[m]
                if way < flat[there]:
                    old = int(flat[there] / spacing) % count if flat[there] < np.inf else 0
                    if before[there] >= 0 or heads[old] == there:
                        _unlink(heads, after, before, there, old)
                        waiting -= 1
                    flat[there] = way
                    _link(heads, after, before, there, int(way / spacing) % count)
                    waiting += 1


@njit(**KERNEL)
def shade(
    values: FloatArray,
    free: BoolArray,
    corner: FloatArray,
    spacing: float,
    goal: FloatArray,
    centres: FloatArray,
    radii: FloatArray,
) -> None:
    """Close the cells within discs, and take the straight way to the goal from those that have a disc in it.

    Args:
        values: (w, h) m, straight ways; set to inf where the way leads through a disc.
        free: (w, h) set to False within the discs.
        corner: (2,) m, place of cell [0, 0]; spacing: m; goal: (2,) m.
        centres: (K, 2) m; radii: (K,) m.
    """
    w, h = values.shape
    for k in range(centres.shape[0]):
        square = radii[k] * radii[k]
        u, v = centres[k, 0] - goal[0], centres[k, 1] - goal[1]
        for i in range(w):
            x = corner[0] + i * spacing - goal[0]
            for j in range(h):
                y = corner[1] + j * spacing - goal[1]
                if (x - u) * (x - u) + (y - v) * (y - v) < square:
                    values[i, j] = np.inf
                    free[i, j] = False
                elif values[i, j] < np.inf:
                    along, length = u * x + v * y, x * x + y * y
                    if 0.0 < along < length:
                        across = u * y - v * x
                        if across * across < square * length:
                            values[i, j] = np.inf


@njit(**KERNEL)
def _link(heads: Cells, after: Cells, before: Cells, cell: int, bucket: int) -> None:
    """Put a cell in front of a bucket."""
    first = heads[bucket]
    after[cell], before[cell] = first, -1
    if first >= 0:
        before[first] = cell
    heads[bucket] = cell


@njit(**KERNEL)
def _unlink(heads: Cells, after: Cells, before: Cells, cell: int, bucket: int) -> None:
    """Take a cell out of its bucket."""
    if before[cell] >= 0:
        after[before[cell]] = after[cell]
    else:
        heads[bucket] = after[cell]
    if after[cell] >= 0:
        before[after[cell]] = before[cell]
    after[cell], before[cell] = -1, -1
