"""Backward induction over the robot's lattice (Eq. 9) and the walk along the minimisers.

Only a box of cells is looked at per step (see `search_tube`); what is off it is forbidden.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.min_plus import WIDTH, lower, lower_by_two
from sidestep._kernels.options import KERNEL
from sidestep._kernels.search_costs import (
    Costs,
    arrival_costs,
    cells_of,
    grown,
    halfway_costs,
    row_at,
    stand,
)
from sidestep._kernels.search_walk import Known, Seen, walk, walk_abreast
from sidestep.types import FloatArray, IntArray


@njit(**KERNEL)
def _shifts(taps: IntArray, low: IntArray, table_low: IntArray, size: IntArray) -> IntArray:
    """How far apart, for every tap, its end lies in a table from where a row starts in it that begins at `low`."""
    out = np.empty(taps.shape[0], np.int64)
    for t in range(taps.shape[0]):
        out[t] = (taps[t, 0] * size[1] + taps[t, 1]) * size[2] + taps[t, 2] + low[2] - table_low[2]
    return out


@njit(**KERNEL)
def _halfway_shifts(taps: IntArray, active: IntArray, low: IntArray, table_low: IntArray, size: IntArray) -> IntArray:
    """The same for the points halfway, which lie in one table per parity."""
    out = np.empty(taps.shape[0], np.int64)
    for t in range(taps.shape[0]):
        a, b, c = taps[t, 0], taps[t, 1], taps[t, 2]
        parity = ((a & 1) * (1 + active[1]) + (b & 1)) * (1 + active[2]) + (c & 1)
        place = ((a >> 1) * size[1] + (b >> 1)) * size[2] + (c >> 1) + low[2] - table_low[2]
        out[t] = parity * size[0] * size[1] * size[2] + place
    return out


@njit(**KERNEL)
def _sweep(
    active: IntArray,
    taps: IntArray,
    effort: Costs,
    low: IntArray,
    size: IntArray,
    stay: Costs,
    stay_low: IntArray,
    stay_size: IntArray,
    risk: Costs,
    risk_low: IntArray,
    risk_size: IntArray,
    price: tuple[float, float, float],
    has_halfway: bool,
    halfway: Costs,
    halfway_low: IntArray,
    halfway_size: IntArray,
    arrive: Costs,
    arrive_low: IntArray,
    arrive_size: IntArray,
    value: Costs,
) -> None:
    """Cost to go over the box `low`, `size`: the least of standing still and value(y) = e(u) + halfway + arrive(y + u).

    Whole lines are written, beyond the end of a row: so a row begins only when the one before it is done.
    """
    goals = _shifts(taps, low, arrive_low, arrive_size)
    middles = _halfway_shifts(taps, active, low, halfway_low, halfway_size)
    count, n = taps.shape[0], size[2]
    for i in range(low[0], low[0] + size[0]):
        for j in range(low[1], low[1] + size[1]):
            at = row_at(i, j, low[2], low, size)
            stand(
                i, j, low[2], value[at : at + n], stay, stay_low, stay_size, risk, risk_low, risk_size, price[0],
                price[1], price[2],
            )  # fmt: skip
            goal = row_at(i, j, arrive_low[2], arrive_low, arrive_size)
            if has_halfway:
                middle = row_at(i, j, halfway_low[2], halfway_low, halfway_size)
                lower_by_two(1, count, effort, halfway, middles, middle, arrive, goals, goal, value, at, n)
            else:
                lower(1, count, effort, arrive, goals, goal, value, at, n)


@njit(**KERNEL)
def induce(
    horizon: int,
    radius: int,
    active: IntArray,
    taps: IntArray,
    effort: Costs,
    first: Costs,
    stage: Costs,
    terminal: Costs,
    blocked: NDArray[np.bool_],
    blocked_halfway: NDArray[np.bool_],
    seen: Seen,
    weights: tuple[float, float],
    limit: float,
    steep: FloatArray,
    share: float,
    low: IntArray,
    size: IntArray,
) -> Known:
    """Find what it costs to go on from every cell at every step, whatever was done before.

    Args:
        horizon: N ≥ 1; radius: K, largest tap per axis; active: (3,) 1 where an axis exists.
        taps: (n, 3) integer displacements, the first is standing still; effort: (n,) their costs, 0 first.
        first: (n,) further cost of each tap at the first step (inf forbids it).
        stage: (2KN+1 per active axis) cost of being in a cell at any step; terminal: the same shape, added at step N.
        blocked: the same shape, or empty; blocked_halfway: (parities, boxes of radius (K(2N−1)+1)//2), or empty.
            Walls do not count for the first step: `first` judges it.
        seen: the risk, at least over the boxes of the steps and those between them.
        weights: cost per unit probability at the steps and halfway.
        limit: see `charge`; steep: (N,) see `charge`, of each step.
        share: part of the risk's cost that standing still is charged.
        low: (N + 1, 3) lowest cell that may be taken at each step, counted from the start; size: (N + 1, 3) cells.
    """
    parities = (1 + active[0]) * (1 + active[1]) * (1 + active[2])
    begin = np.zeros(horizon + 2, np.int64)  # where the costs of arriving at each step start
    most, most_halfway = 0, 0
    for k in range(horizon + 1):
        begin[k + 1] = begin[k] + (cells_of(grown(low[k - 1], size[k - 1], radius, radius, active)[1]) if k > 0 else 0)
        most = max(most, cells_of(size[k]))
        most_halfway = max(most_halfway, parities * cells_of(grown(low[k], size[k], 0, radius, active)[1]))
    arrive = np.empty(begin[horizon + 1] + WIDTH, np.float32)
    value, stay = np.empty(most + WIDTH, np.float32), np.empty(most + WIDTH, np.float32)
    halfway = np.empty(most_halfway + WIDTH, np.float32)
    at, corner, last = 0, low[horizon], size[horizon]
    for i in range(corner[0], corner[0] + last[0]):
        for j in range(corner[1], corner[1] + last[1]):
            for k in range(corner[2], corner[2] + last[2]):
                value[at] = terminal[i + terminal.shape[0] // 2, j + terminal.shape[1] // 2, k + terminal.shape[2] // 2]
                at += 1
    for k in range(horizon - 1, -1, -1):
        b = 2 * k + 2
        wide_low, wide = grown(low[k], size[k], radius, radius, active)
        middle_low, middle = grown(low[k], size[k], (radius + 1) // 2, radius // 2, active)
        end = seen.values[seen.starts[b] : seen.starts[b + 1]] if seen.some[b] else seen.values[:0]
        arrival_costs(
            low[k + 1], size[k + 1], value, stage, end, seen.low[b], seen.size[b], blocked[:0] if k == 0 else blocked,
            weights[0], limit, steep[k], share, wide_low, wide, arrive[begin[k + 1] : begin[k + 2]], stay,
        )  # fmt: skip
        if k == 0:
            break
        mid = seen.values[seen.starts[b - 1] : seen.starts[b]] if seen.some[b - 1] else seen.values[:0]
        use = mid.size > 0 or blocked_halfway.size > 0
        if use:
            halfway_costs(
                middle_low, middle, mid, seen.low[b - 1], seen.size[b - 1], blocked_halfway, active, weights[1],
                limit, steep[k], halfway,
            )  # fmt: skip
        price = (share * weights[1], limit, share * steep[k])
        _sweep(
            active, taps, effort, low[k], size[k], stay, low[k + 1], size[k + 1], mid, seen.low[b - 1],
            seen.size[b - 1], price, use, halfway, middle_low, middle, arrive[begin[k + 1] :], wide_low, wide,
            value,
        )  # fmt: skip
    return Known(
        radius,
        active,
        taps,
        effort,
        first,
        stage,
        blocked_halfway,
        weights,
        limit,
        steep,
        share,
        low,
        size,
        arrive,
        begin,
    )


@njit(**KERNEL)
def _follow(
    start: FloatArray, spacing: float, taps: IntArray, total: float, chosen: IntArray, path: FloatArray
) -> None:
    """Write the path (N + 1, d) m of the taps `chosen` from `start` (d,) m; standing where `total` is inf."""
    d = start.size
    for a in range(d):
        cells = 0
        path[0, a] = start[a]
        for k in range(chosen.size):
            cells += taps[chosen[k], 3 - d + a] if np.isfinite(total) else 0
            path[k + 1, a] = start[a] + spacing * cells


@njit(**KERNEL)
def cheapest_path(
    start: FloatArray,
    spacing: float,
    horizon: int,
    radius: int,
    active: IntArray,
    taps: IntArray,
    effort: Costs,
    first: Costs,
    stage: Costs,
    terminal: Costs,
    blocked: NDArray[np.bool_],
    blocked_halfway: NDArray[np.bool_],
    values: Costs,
    starts: IntArray,
    some: NDArray[np.bool_],
    seen_low: IntArray,
    seen_size: IntArray,
    weight: float,
    limit: float,
    steep: FloatArray,
    share: float,
    low: IntArray,
    size: IntArray,
    path: FloatArray,
) -> float:
    """Write the cheapest path (N + 1, d) m from `start` (d,) m; standing where nothing is admissible.

    Arguments as for `induce`, `values` … `seen_size` being those of `Seen`, and `weight` of both. Returns its cost, inf
    where nothing is admissible.
    """
    seen = Seen(values, starts, some, seen_low, seen_size)
    known = induce(
        horizon, radius, active, taps, effort, first, stage, terminal, blocked, blocked_halfway, seen,
        (weight, weight), limit, steep, share, low, size,
    )  # fmt: skip
    total, chosen = walk(known, seen)
    _follow(start, spacing, taps, total, chosen, path)
    return total


@njit(**KERNEL)
def gentle_path(
    start: FloatArray,
    spacing: float,
    horizon: int,
    radius: int,
    active: IntArray,
    taps: IntArray,
    effort: Costs,
    first: Costs,
    stage: Costs,
    terminal: Costs,
    blocked: NDArray[np.bool_],
    blocked_halfway: NDArray[np.bool_],
    values: Costs,
    starts: IntArray,
    some: NDArray[np.bool_],
    seen_low: IntArray,
    seen_size: IntArray,
    weight: float,
    limit: float,
    steep: FloatArray,
    share: float,
    low: IntArray,
    size: IntArray,
    change: float,
    path: FloatArray,
) -> float:
    """Write the path that `cheapest_path` writes, of taps that differ by at most `change` cells from the one before.

    It is admissible and its cost exact, but not always the least (see `walk_abreast`). The first tap may be any.
    """
    seen = Seen(values, starts, some, seen_low, seen_size)
    known = induce(
        horizon, radius, active, taps, effort, first, stage, terminal, blocked, blocked_halfway, seen,
        (weight, weight), limit, steep, share, low, size,
    )  # fmt: skip
    total, chosen = walk_abreast(known, seen, change)
    _follow(start, spacing, taps, total, chosen, path)
    return total
