"""Backward induction over the robot's lattice (Eq. 9) and the walk along the minimisers.

Three axes throughout; missing ones hold a single cell. Costs are float32: inf is forbidden.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep.types import IntArray

Costs = NDArray[np.float32]


@njit(cache=True)
def charge(risk: float, weight: float, limit: float, steep: float) -> float:
    """Cost of a probability: linear up to the limit, `steep` above it (inf forbids)."""
    if risk > limit:
        return np.inf if steep == np.inf else weight * risk + steep * (risk - limit)
    return weight * risk


@njit(cache=True)
def _sizes(radius: int, active: IntArray) -> tuple[int, int, int]:
    return 2 * radius * active[0] + 1, 2 * radius * active[1] + 1, 2 * radius * active[2] + 1


@njit(cache=True)
def _halfway_costs(
    step: int,
    radius: int,
    active: IntArray,
    risk: Costs,
    blocked: NDArray[np.bool_],
    weight: float,
    limit: float,
    steep: float,
    out: Costs,
) -> None:
    """Costs at the points halfway between step and step + 1, one box per parity; `risk` may be empty.

    The risk of a point between raster cells is the mean over the cells around it.
    """
    r = (radius * (2 * step + 1) + 1) // 2
    w0, w1, w2 = _sizes(r, active)
    s = (blocked.shape[3] - 1) // 2 - r
    for p0 in range(1 + active[0]):
        for p1 in range(1 + active[1]):
            for p2 in range(1 + active[2]):
                p = (p0 * (1 + active[1]) + p1) * (1 + active[2]) + p2
                for i in range(w0):
                    i1 = min(i + p0, w0 - 1)
                    for j in range(w1):
                        j1 = min(j + p1, w1 - 1)
                        at = ((p * w0 + i) * w1 + j) * w2
                        row = out[at : at + w2]
                        row[:] = 0.0
                        if risk.size > 0:
                            a = risk[(i * w1 + j) * w2 : (i * w1 + j + 1) * w2]
                            b = risk[(i * w1 + j1) * w2 : (i * w1 + j1 + 1) * w2]
                            c = risk[(i1 * w1 + j) * w2 : (i1 * w1 + j + 1) * w2]
                            d = risk[(i1 * w1 + j1) * w2 : (i1 * w1 + j1 + 1) * w2]
                            _charge_means(a, b, c, d, p2, weight, limit, steep, row)
                        if blocked.size > 0:
                            wall = blocked[p, i + s * active[0], j + s * active[1], s * active[2] : s * active[2] + w2]
                            for k in range(w2):
                                if wall[k]:
                                    row[k] = np.inf


@njit(cache=True)
def _charge_means(
    a: Costs, b: Costs, c: Costs, d: Costs, odd: int, weight: float, limit: float, steep: float, row: Costs
) -> None:
    """Charge the mean of four rows, and with `odd` that of neighbours in them."""
    quarter = np.float32(0.25)
    for k in range(row.size):
        row[k] = quarter * (a[k] + b[k] + c[k] + d[k])
    if odd:
        for k in range(row.size - 1):
            row[k] = np.float32(0.5) * (row[k] + row[k + 1])
    for k in range(row.size):
        row[k] = charge(row[k], weight, limit, steep)


@njit(cache=True)
def _halfway_risk(z0: int, z1: int, z2: int, half: IntArray, risk: Costs) -> float:
    """Mean risk of the raster cells around a point given in half cells."""
    w1, w2 = 2 * half[1] + 1, 2 * half[2] + 1
    total = np.float32(0.0)
    for i in range(2):
        for j in range(2):
            for k in range(2):
                q0 = ((z0 + i) >> 1) + half[0]
                q1 = ((z1 + j) >> 1) + half[1]
                q2 = ((z2 + k) >> 1) + half[2]
                total += risk[(q0 * w1 + q1) * w2 + q2]
    return np.float32(0.125) * total


@njit(cache=True)
def _arrival_costs(
    step: int,
    radius: int,
    active: IntArray,
    stage: Costs,
    risk: Costs,
    blocked: NDArray[np.bool_],
    weight: float,
    limit: float,
    steep: float,
    value: Costs,
) -> None:
    """Turn the cost-to-go after `step` into the cost of arriving there: stage cost, risk and walls added."""
    w0, w1, w2 = _sizes(radius * step, active)
    full = stage.shape[2] // 2
    s = full - radius * step * active[2]
    for i in range(w0):
        for j in range(w1):
            at = (i * w1 + j) * w2
            row = value[at : at + w2]
            goal = stage[i + s * active[0], j + s * active[1], s : s + w2]
            for k in range(w2):
                row[k] += goal[k]
            if risk.size > 0:
                seen = risk[at : at + w2]
                for k in range(w2):
                    row[k] += charge(seen[k], weight, limit, steep)
            if blocked.size > 0:
                wall = blocked[i + s * active[0], j + s * active[1], s : s + w2]
                for k in range(w2):
                    if wall[k]:
                        row[k] = np.inf


@njit(cache=True)
def _standing(
    step: int,
    radius: int,
    active: IntArray,
    stage: Costs,
    risk: Costs,
    halfway_risk: Costs,
    weights: tuple[float, float],
    limit: float,
    steep: float,
    share: float,
    following: Costs,
    value: Costs,
) -> None:
    """Start `value` (cost-to-go at `step`) with what standing still costs; `following` is the cost-to-go after it."""
    w0, w1, w2 = _sizes(radius * step, active)
    v0, v1, v2 = _sizes(radius * (step + 1), active)
    h0, h1, h2 = _sizes((radius * (2 * step + 1) + 1) // 2, active)
    full = stage.shape[2] // 2
    s = full - radius * step * active[2]
    o = radius
    q = (radius * (2 * step + 1) + 1) // 2 - radius * step
    for i in range(w0):
        for j in range(w1):
            at = (i * w1 + j) * w2
            end = ((i + o * active[0]) * v1 + j + o * active[1]) * v2 + o * active[2]
            mid = ((i + q * active[0]) * h1 + j + q * active[1]) * h2 + q * active[2]
            for k in range(w2):
                cost = following[end + k] + stage[i + s * active[0], j + s * active[1], s + k]
                if risk.size > 0:
                    cost += share * charge(risk[end + k], weights[0], limit, steep)
                if halfway_risk.size > 0:
                    cost += share * charge(halfway_risk[mid + k], weights[1], limit, steep)
                value[at + k] = cost


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
    """Take the minimum over all moving taps: value(y) = min_u e(u) + halfway(2y + u) + arrive(y + u)."""
    w0, w1, w2 = _sizes(radius * step, active)
    v0, v1, v2 = _sizes(radius * (step + 1), active)
    r = (radius * (2 * step + 1) + 1) // 2
    h0, h1, h2 = _sizes(r, active)
    q = r - radius * step
    for i in range(w0):
        for j in range(w1):
            at = (i * w1 + j) * w2
            row = value[at : at + w2]
            for t in range(1, taps.shape[0]):
                a, b, c = taps[t, 0], taps[t, 1], taps[t, 2]
                e = effort[t]
                end = ((i + a + radius * active[0]) * v1 + j + b + radius * active[1]) * v2 + c + radius * active[2]
                goal = arrive[end : end + w2]
                if has_halfway:
                    parity = (((a & 1) * (1 + active[1]) + (b & 1)) * (1 + active[2])) + (c & 1)
                    mid = (parity * h0 + i + (a >> 1) + q * active[0]) * h1 + j + (b >> 1) + q * active[1]
                    mid = mid * h2 + (c >> 1) + q * active[2]
                    middle = halfway[mid : mid + w2]
                    for k in range(w2):
                        cost = e + middle[k] + goal[k]
                        row[k] = cost if cost < row[k] else row[k]
                else:
                    for k in range(w2):
                        cost = e + goal[k]
                        row[k] = cost if cost < row[k] else row[k]


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
    steep: float,
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
        limit, steep: see `charge`; share: part of the risk's cost that standing still is charged.

    Returns:
        total cost (inf: no admissible sequence) and the (N,) indices of the taps.
    """
    parities = (1 + active[0]) * (1 + active[1]) * (1 + active[2])
    begin = np.zeros(horizon + 2, np.int64)
    for k in range(horizon + 1):
        w0, w1, w2 = _sizes(radius * k, active)
        begin[k + 1] = begin[k] + w0 * w1 * w2
    arrive = np.empty(begin[horizon + 1], np.float32)
    h0, h1, h2 = _sizes((radius * (2 * horizon - 1) + 1) // 2, active)
    halfway = np.empty(parities * h0 * h1 * h2, np.float32)
    arrive[begin[horizon] :] = terminal.ravel()
    for k in range(horizon - 1, -1, -1):
        end = risk[starts[2 * k + 2] : starts[2 * k + 3]] if some[2 * k + 2] else risk[:0]
        mid = risk[starts[2 * k + 1] : starts[2 * k + 2]] if some[2 * k + 1] else risk[:0]
        free = blocked_halfway[:0] if k == 0 else blocked_halfway
        following = arrive[begin[k + 1] : begin[k + 2]]
        value = arrive[begin[k] : begin[k + 1]]
        _standing(k, radius, active, stage, end, mid, weights, limit, steep, share, following, value)
        walls = blocked[:0] if k == 0 else blocked
        _arrival_costs(k + 1, radius, active, stage, end, walls, weights[0], limit, steep, following)
        use = mid.size > 0 or free.size > 0
        if use:
            _halfway_costs(k, radius, active, mid, free, weights[1], limit, steep, halfway)
        if k > 0:
            _block_standing(k, radius, active, walls, value)
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
def _block_standing(step: int, radius: int, active: IntArray, blocked: NDArray[np.bool_], value: Costs) -> None:
    """Nobody stands in a wall (from the second step on)."""
    if blocked.size == 0:
        return
    w0, w1, w2 = _sizes(radius * step, active)
    s = blocked.shape[2] // 2 - radius * step * active[2]
    for i in range(w0):
        for j in range(w1):
            for k in range(w2):
                if blocked[i + s * active[0], j + s * active[1], s + k]:
                    value[(i * w1 + j) * w2 + k] = np.inf


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
    steep: float,
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
        v0, v1, v2 = _sizes(r, active)
        m = (radius * (2 * k + 1) + 1) // 2
        for t in range(taps.shape[0]):
            a, b, c = taps[t, 0], taps[t, 1], taps[t, 2]
            n0, n1, n2 = y0 + a, y1 + b, y2 + c
            end = ((n0 + r * active[0]) * v1 + n1 + r * active[1]) * v2 + n2 + r * active[2]
            cost = float(effort[t]) + float(arrive[begin[k + 1] + end])
            part = share if t == 0 else 1.0
            if t == 0 and some[2 * k + 2]:
                excess = charge(risk[starts[2 * k + 2] + end], weights[0], limit, steep)
                if excess < np.inf:
                    cost -= (1.0 - share) * excess
            parity = (((a & 1) * (1 + active[1]) + (b & 1)) * (1 + active[2])) + (c & 1)
            q0 = y0 + (a >> 1) + m * active[0]
            q1 = y1 + (b >> 1) + m * active[1]
            q2 = y2 + (c >> 1) + m * active[2]
            if some[2 * k + 1]:
                seen = _halfway_risk(2 * y0 + a, 2 * y1 + b, 2 * y2 + c, m * active, risk[starts[2 * k + 1] :])
                cost += part * charge(seen, weights[1], limit, steep)
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
