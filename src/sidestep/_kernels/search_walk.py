"""The walk along what `search` has found: of a base that may do anything next, or of one of limited acceleration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep._kernels.search_costs import Costs, charge, grow_into, halfway_risk, row_at
from sidestep.types import FloatArray, IntArray

MOVES = 3200
"""About so many moves `walk_abreast` looks at per step: from fewer states where every one has more of them."""
FEWEST = 16
"""States that it keeps per step at least."""


class Seen(NamedTuple):
    """Risk at half instants 1..2N, each over its box of the robot's lattice.

    Attributes:
        values: flat; starts: (B + 1,) where the half instants start in them; some: (B,) whether any is above zero.
        low: (B, 3) lowest cells of the boxes, counted from the robot; size: (B, 3) cells.
    """

    values: Costs
    starts: IntArray
    some: NDArray[np.bool_]
    low: IntArray
    size: IntArray


class Known(NamedTuple):
    """What the walk looks up; arguments of `solve`, and what its sweeps have found.

    Attributes:
        radius, active, taps, effort, first, stage, blocked_halfway, weights, limit, steep, share, low, size: as given.
        arrive: cost of arriving in each cell at each step and of all that follows; begin: where each step starts in it.
    """

    radius: int
    active: IntArray
    taps: IntArray
    effort: Costs
    first: Costs
    stage: Costs
    blocked_halfway: NDArray[np.bool_]
    weights: tuple[float, float]
    limit: float
    steep: FloatArray
    share: float
    low: IntArray
    size: IntArray
    arrive: Costs
    begin: IntArray


@njit(**KERNEL)
def _wide_boxes(known: Known) -> IntArray:
    """(N, 2, 3) the boxes over which arriving is known at each step: lowest cell and number of cells."""
    wide = np.empty((known.steep.size, 2, 3), np.int64)
    for k in range(known.steep.size):
        grow_into(known.low[k], known.size[k], known.radius, known.radius, known.active, wide[k, 0], wide[k, 1])
    return wide


@njit(**KERNEL)
def walk(known: Known, seen: Seen) -> tuple[float, IntArray]:
    """Follow the minimisers from the centre; ties go to the earlier tap.

    What a tap costs is written out, here and below: to hand the tuples to a function takes ten times as long as that.
    """
    _, active, taps, effort, first, _, blocked_halfway, weights, limit, steep, share, _, _, arrive, begin = known
    wide = _wide_boxes(known)
    f0, f1 = (blocked_halfway.shape[1] - 1) // 2, (blocked_halfway.shape[2] - 1) // 2
    f2 = (blocked_halfway.shape[3] - 1) // 2
    chosen = np.zeros(steep.size, np.int64)
    y0, y1, y2 = 0, 0, 0
    total = np.inf
    for k in range(steep.size):
        best, pick = np.inf, 0
        end, mid = 2 * k + 2, 2 * k + 1
        for t in range(taps.shape[0]):
            a, b, c = taps[t, 0], taps[t, 1], taps[t, 2]
            n0, n1, n2 = y0 + a, y1 + b, y2 + c
            cost = float(effort[t]) + float(arrive[begin[k + 1] + row_at(n0, n1, n2, wide[k, 0], wide[k, 1])])
            if cost >= best:
                continue
            part = share if t == 0 else 1.0
            if t == 0 and seen.some[end]:
                risk = seen.values[seen.starts[end] + row_at(n0, n1, n2, seen.low[end], seen.size[end])]
                cost -= (1.0 - share) * charge(float(risk), weights[0], limit, steep[k])
            if seen.some[mid]:
                values = seen.values[seen.starts[mid] :]
                risk = halfway_risk(2 * y0 + a, 2 * y1 + b, 2 * y2 + c, values, seen.low[mid], seen.size[mid])
                cost += part * charge(risk, weights[1], limit, steep[k])
            if k == 0:
                cost += first[t]
            elif blocked_halfway.size > 0:
                parity = ((a & 1) * (1 + active[1]) + (b & 1)) * (1 + active[2]) + (c & 1)
                if blocked_halfway[parity, y0 + (a >> 1) + f0, y1 + (b >> 1) + f1, y2 + (c >> 1) + f2]:
                    cost = np.inf
            if cost < best:
                best, pick = cost, t
        if k == 0:
            total = best
        if not best < np.inf:
            break
        chosen[k] = pick
        y0, y1, y2 = y0 + taps[pick, 0], y1 + taps[pick, 1], y2 + taps[pick, 2]
    return total, chosen


@njit(**KERNEL)
def _neighbours(taps: IntArray, change: float) -> tuple[IntArray, IntArray]:
    """The taps that differ by at most `change` cells from each: those of tap t at starts[t] ≤ e < starts[t + 1]."""
    n = taps.shape[0]
    starts, which = np.zeros(n + 1, np.int64), np.empty(n * n, np.int64)
    end = 0
    for t in range(n):
        for u in range(n):
            square = 0
            for axis in range(3):
                square += (taps[t, axis] - taps[u, axis]) ** 2
            if square <= change * change:
                which[end] = u
                end += 1
        starts[t + 1] = end
    return starts, which


@njit(**KERNEL)
def _slot(pairs: IntArray, pair: int) -> int:
    """Where a pair is among hashed ones, or where it may be put: from its own place on, the first that is free."""
    last = pairs.size - 1
    slot = (pair * 40503) & last
    while pairs[slot] >= 0 and pairs[slot] != pair:
        slot = (slot + 1) & last
    return slot


@njit(**KERNEL)
def walk_abreast(known: Known, seen: Seen, change: float) -> tuple[float, IntArray]:
    """Go from the centre by taps that differ by at most `change` cells from the one before; the first may be any.

    What is known of a cell holds for whoever may do anything next, so it is never more than what going on costs at the
    tap that was taken last: the bound of A*. Step by step all pairs of cell and tap that can be come to are looked at,
    each at the least cost so far; those whose bound on the whole is least are kept. Where there are no more,
    nothing is cheaper than what is found. To keep all of them takes `taps` times what a search without inertia takes.
    """
    _, active, taps, effort, first, stage, blocked_halfway, weights, limit, steep, share, low, size, arrive, begin = (
        known
    )
    horizon, n = steep.size, taps.shape[0]
    f0, f1 = (blocked_halfway.shape[1] - 1) // 2, (blocked_halfway.shape[2] - 1) // 2
    f2 = (blocked_halfway.shape[3] - 1) // 2
    h0, h1, h2 = stage.shape[0] // 2, stage.shape[1] // 2, stage.shape[2] // 2
    wide = _wide_boxes(known)
    starts, which = _neighbours(taps, change)
    widest = 0
    for t in range(n):
        widest = max(widest, starts[t + 1] - starts[t])
    breadth = max(MOVES // widest, FEWEST)
    room = max(breadth * widest, n)
    slots = 1
    while slots < 2 * room:
        slots *= 2
    pairs, numbers = np.empty(slots, np.int64), np.empty(slots, np.int64)  # hashed: which are there, and where
    tap, parent = np.empty((horizon, room), np.int64), np.empty((horizon, room), np.int64)
    cell, spent, bound = np.empty((2, room, 3), np.int64), np.empty((2, room)), np.empty(room)
    keep = np.empty(breadth, np.int64)
    cell[0, 0, 0], cell[0, 0, 1], cell[0, 0, 2], spent[0, 0] = 0, 0, 0, 0.0
    keep[0] = 0
    kept, count = 1, 0
    for k in range(horizon):
        here, there, count = k % 2, (k + 1) % 2, 0
        end, mid = 2 * k + 2, 2 * k + 1
        pairs[:] = -1
        for s in range(kept):
            state = keep[s]
            y0, y1, y2 = cell[here, state, 0], cell[here, state, 1], cell[here, state, 2]
            before = tap[k - 1, state] if k > 0 else 0
            for e in range(starts[before] if k > 0 else 0, starts[before + 1] if k > 0 else n):
                t = which[e] if k > 0 else e
                a, b, c = taps[t, 0], taps[t, 1], taps[t, 2]
                n0, n1, n2 = y0 + a, y1 + b, y2 + c
                whole = float(arrive[begin[k + 1] + row_at(n0, n1, n2, wide[k, 0], wide[k, 1])])  # and what follows
                if not whole < np.inf:
                    continue
                own, part = float(stage[n0 + h0, n1 + h1, n2 + h2]), share if t == 0 else 1.0
                if seen.some[end]:
                    risk = seen.values[seen.starts[end] + row_at(n0, n1, n2, seen.low[end], seen.size[end])]
                    price = charge(float(risk), weights[0], limit, steep[k])
                    own += part * price
                    whole -= (1.0 - part) * price if t == 0 else 0.0
                going = float(effort[t])
                if seen.some[mid]:
                    values = seen.values[seen.starts[mid] :]
                    risk = halfway_risk(2 * y0 + a, 2 * y1 + b, 2 * y2 + c, values, seen.low[mid], seen.size[mid])
                    going += part * charge(risk, weights[1], limit, steep[k])
                if k == 0:
                    going += first[t]
                elif blocked_halfway.size > 0:
                    parity = ((a & 1) * (1 + active[1]) + (b & 1)) * (1 + active[2]) + (c & 1)
                    if blocked_halfway[parity, y0 + (a >> 1) + f0, y1 + (b >> 1) + f1, y2 + (c >> 1) + f2]:
                        continue
                own, whole = own + going, whole + going
                if not whole < np.inf:
                    continue
                pair = row_at(n0, n1, n2, low[k + 1], size[k + 1]) * n + t
                slot = _slot(pairs, pair)
                at = numbers[slot]
                if pairs[slot] < 0:
                    at = count
                    count += 1
                    pairs[slot], numbers[slot] = pair, at
                elif not spent[here, state] + own < spent[there, at]:
                    continue
                cell[there, at, 0], cell[there, at, 1], cell[there, at, 2] = n0, n1, n2
                tap[k, at], parent[k, at] = t, state
                spent[there, at], bound[at] = spent[here, state] + own, spent[here, state] + whole
        if count == 0:
            return np.inf, np.zeros(horizon, np.int64)
        highest = np.inf
        if count > breadth:
            highest = np.partition(bound[:count], breadth - 1)[breadth - 1]
        kept = 0
        for at in range(count):
            if bound[at] <= highest and kept < breadth:
                keep[kept] = at
                kept += 1
    best = 0
    for at in range(count):
        if bound[at] < bound[best]:
            best = at
    chosen, total = np.empty(horizon, np.int64), bound[best]
    for k in range(horizon - 1, -1, -1):
        chosen[k] = tap[k, best]
        best = parent[k, best]
    return total, chosen
