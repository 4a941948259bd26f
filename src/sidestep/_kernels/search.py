"""Backward induction over the robot's lattice (Eq. 9) and the walk along the minimisers."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.search_costs import (
    Costs,
    arrival_costs,
    block_standing,
    charge,
    halfway_costs,
    halfway_risk,
    sizes,
    standing,
)
from sidestep.types import FloatArray, IntArray

TILE = 4096
"""Costs that are lowered together; they stay in the nearest cache while tap after tap passes."""


@njit(cache=True)
def _sweep(
    step: int,
    radius: int,
    active: IntArray,
    taps: IntArray,
    effort: Costs,
    arrive: Costs,
    halfway: Costs,
    has_halfway: bool,
    value: Costs,
) -> None:
    """Take the minimum over all moving taps: value(y) = min_u e(u) + halfway(2y + u) + arrive(y + u).

    Rows are short and taps are many. So several rows are taken at once, laid out with the row length of `arrive`, which
    `halfway` has too: for each tap they are then one long row. What is computed between the rows is not read.
    """
    w0, w1, w2 = sizes(radius * step, active)
    _, v1, v2 = sizes(radius * (step + 1), active)
    r = (radius * (2 * step + 1) + 1) // 2
    h0, h1, _ = sizes(r, active)
    q = r - radius * step
    rows = min(max(TILE // v2, 1), w1)
    tile = np.empty(rows * v2, np.float32)
    for i in range(w0):
        for j in range(0, w1, rows):
            some = min(rows, w1 - j)
            tile[:] = np.inf
            for n in range(some):
                at = (i * w1 + j + n) * w2
                tile[n * v2 : n * v2 + w2] = value[at : at + w2]
            length = np.uintp((some - 1) * v2 + w2)
            for t in range(1, taps.shape[0]):
                a, b, c = taps[t, 0], taps[t, 1], taps[t, 2]
                e = effort[t]
                end = ((i + a + radius * active[0]) * v1 + j + b + radius * active[1]) * v2 + c + radius * active[2]
                goal = np.uintp(end)
                if has_halfway:
                    parity = (((a & 1) * (1 + active[1]) + (b & 1)) * (1 + active[2])) + (c & 1)
                    mid = (parity * h0 + i + (a >> 1) + q * active[0]) * h1 + j + (b >> 1) + q * active[1]
                    middle = np.uintp(mid * v2 + (c >> 1) + q * active[2])
                    for k in range(length):
                        cost = e + halfway[middle + k] + arrive[goal + k]
                        tile[k] = cost if cost < tile[k] else tile[k]
                else:
                    for k in range(length):
                        cost = e + arrive[goal + k]
                        tile[k] = cost if cost < tile[k] else tile[k]
            for n in range(some):
                at = (i * w1 + j + n) * w2
                value[at : at + w2] = tile[n * v2 : n * v2 + w2]


@njit(cache=True)
def solve(
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
    risk: Costs,
    starts: IntArray,
    some: NDArray[np.bool_],
    weights: tuple[float, float],
    limit: float,
    steep: FloatArray,
    share: float,
) -> tuple[float, IntArray]:
    """Find the cheapest sequence of taps from the centre of the lattice.

    Args:
        horizon: N ≥ 1; radius: K, largest tap per axis; active: (3,) 1 where an axis exists.
        taps: (n, 3) integer displacements, the first is standing still; effort: (n,) their costs, 0 first.
        first: (n,) further cost of each tap at the first step (inf forbids it).
        stage: (2KN+1 per active axis) cost of being in a cell at any step; terminal: the same shape, added at step N.
        blocked: the same shape, or empty; blocked_halfway: (parities, boxes of radius (K(2N−1)+1)//2), or empty.
            Walls do not count for the first step: `first` judges it.
        risk, starts, some: as `rasterise_all` returns them.
        weights: cost per unit probability at the steps and halfway.
        limit: see `charge`; steep: (N,) see `charge`, of each step.
        share: part of the risk's cost that standing still is charged.

    Returns:
        total cost (inf: no admissible sequence) and the (N,) indices of the taps.
    """
    parities = (1 + active[0]) * (1 + active[1]) * (1 + active[2])
    begin = np.zeros(horizon + 2, np.int64)
    for k in range(horizon + 1):
        w0, w1, w2 = sizes(radius * k, active)
        begin[k + 1] = begin[k] + w0 * w1 * w2
    arrive = np.empty(begin[horizon + 1], np.float32)
    h0, h1, _ = sizes((radius * (2 * horizon - 1) + 1) // 2, active)
    halfway = np.full(parities * h0 * h1 * sizes(radius * horizon, active)[2], np.float32(0.0))
    at = begin[horizon]
    for i in range(terminal.shape[0]):
        for j in range(terminal.shape[1]):
            for t in range(terminal.shape[2]):
                arrive[at] = terminal[i, j, t]
                at += 1
    for k in range(horizon - 1, -1, -1):
        end = risk[starts[2 * k + 2] : starts[2 * k + 3]] if some[2 * k + 2] else risk[:0]
        mid = risk[starts[2 * k + 1] : starts[2 * k + 2]] if some[2 * k + 1] else risk[:0]
        free = blocked_halfway[:0] if k == 0 else blocked_halfway
        following = arrive[begin[k + 1] : begin[k + 2]]
        value = arrive[begin[k] : begin[k + 1]]
        standing(k, radius, active, stage, end, mid, weights, limit, steep[k], share, following, value)
        walls = blocked[:0] if k == 0 else blocked
        arrival_costs(k + 1, radius, active, stage, end, walls, weights[0], limit, steep[k], following)
        use = mid.size > 0 or free.size > 0
        if use:
            halfway_costs(k, radius, active, mid, free, weights[1], limit, steep[k], halfway)
        if k > 0:
            block_standing(k, radius, active, walls, value)
            _sweep(k, radius, active, taps, effort, following, halfway, use, value)
    return _walk(
        horizon,
        radius,
        active,
        taps,
        effort,
        first,
        stage,
        terminal,
        blocked,
        blocked_halfway,
        risk,
        starts,
        some,
        weights,
        limit,
        steep,
        share,
        arrive,
        begin,
    )


@njit(cache=True)
def _walk(
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
    risk: Costs,
    starts: IntArray,
    some: NDArray[np.bool_],
    weights: tuple[float, float],
    limit: float,
    steep: FloatArray,
    share: float,
    arrive: Costs,
    begin: IntArray,
) -> tuple[float, IntArray]:
    """Follow the minimisers from the centre; ties go to the earlier tap."""
    chosen = np.zeros(horizon, np.int64)
    y0, y1, y2 = 0, 0, 0
    total = np.inf
    for k in range(horizon):
        best = np.inf
        pick = 0
        r = radius * (k + 1)
        _, v1, v2 = sizes(r, active)
        m = (radius * (2 * k + 1) + 1) // 2
        for t in range(taps.shape[0]):
            a, b, c = taps[t, 0], taps[t, 1], taps[t, 2]
            n0, n1, n2 = y0 + a, y1 + b, y2 + c
            end = ((n0 + r * active[0]) * v1 + n1 + r * active[1]) * v2 + n2 + r * active[2]
            cost = float(effort[t]) + float(arrive[begin[k + 1] + end])
            part = share if t == 0 else 1.0
            if t == 0 and some[2 * k + 2]:
                excess = charge(float(risk[starts[2 * k + 2] + end]), weights[0], limit, steep[k])
                if excess < np.inf:
                    cost -= (1.0 - share) * excess
            parity = (((a & 1) * (1 + active[1]) + (b & 1)) * (1 + active[2])) + (c & 1)
            q0 = y0 + (a >> 1) + m * active[0]
            q1 = y1 + (b >> 1) + m * active[1]
            q2 = y2 + (c >> 1) + m * active[2]
            if some[2 * k + 1]:
                seen = halfway_risk(2 * y0 + a, 2 * y1 + b, 2 * y2 + c, m * active, risk[starts[2 * k + 1] :])
                cost += part * charge(seen, weights[1], limit, steep[k])
            if k == 0:
                cost += first[t]
            elif blocked_halfway.size > 0:
                f = (blocked_halfway.shape[3] - 1) // 2 if active[2] else 0
                if blocked_halfway[
                    parity, q0 + (f - m) * active[0], q1 + (f - m) * active[1], q2 + (f - m) * active[2]
                ]:
                    cost = np.inf
            if cost < best:
                best = cost
                pick = t
        if k == 0:
            total = best
        chosen[k] = pick
        y0, y1, y2 = y0 + taps[pick, 0], y1 + taps[pick, 1], y2 + taps[pick, 2]
        if best == np.inf:
            break
    return total, chosen
