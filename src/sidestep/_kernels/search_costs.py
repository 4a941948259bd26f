"""What a step of the robot costs: stage costs, risk and walls, at the cells and halfway between them.

Three axes throughout; missing ones hold a single cell. Costs are float32: inf is forbidden. Every array covers a box of
the robot's lattice, given by its lowest cell (3,) counted from the robot and its number of cells (3,); its rows run
along the last axis. Stage costs and walls are centred on the robot.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep.types import IntArray

Costs = NDArray[np.float32]


@njit(**KERNEL)
def charge(risk: float, weight: float, limit: float, steep: float) -> float:
    """Cost of a probability: linear up to the limit, `steep` above it (inf forbids)."""
    return weight * risk + (steep * (risk - limit) if risk > limit else 0.0)


@njit(**KERNEL)
def row_at(i: int, j: int, k: int, low: IntArray, size: IntArray) -> int:
    """Place of a cell in the array over a box."""
    return ((i - low[0]) * size[1] + j - low[1]) * size[2] + k - low[2]


@njit(**KERNEL)
def grown(low: IntArray, size: IntArray, before: int, after: int, active: IntArray) -> tuple[IntArray, IntArray]:
    """A box with more cells at its low and high ends (written out: array expressions take seconds to compile)."""
    first, count = np.empty(3, np.int64), np.empty(3, np.int64)
    grow_into(low, size, before, after, active, first, count)
    return first, count


@njit(**KERNEL)
def grow_into(
    low: IntArray, size: IntArray, before: int, after: int, active: IntArray, first: IntArray, count: IntArray
) -> None:
    """Write the box that `grown` returns."""
    for a in range(3):
        first[a] = low[a] - before * active[a]
        count[a] = size[a] + (before + after) * active[a]


@njit(**KERNEL)
def cells_of(size: IntArray) -> int:
    """How many cells a box has."""
    return size[0] * size[1] * size[2]


@njit(**KERNEL)
def halfway_costs(
    low: IntArray,
    size: IntArray,
    risk: Costs,
    risk_low: IntArray,
    risk_size: IntArray,
    blocked: NDArray[np.bool_],
    active: IntArray,
    weight: float,
    limit: float,
    steep: float,
    out: Costs,
) -> None:
    """Costs at the points halfway between two steps, one box per parity; `risk` and `blocked` may be empty.

    The risk of a point between raster cells is the mean over the cells around it. What is off the raster costs nothing.
    """
    h0, h1, h2 = (blocked.shape[1] - 1) // 2, (blocked.shape[2] - 1) // 2, (blocked.shape[3] - 1) // 2
    box = cells_of(size)
    for p in range((1 + active[0]) * (1 + active[1]) * (1 + active[2])):
        p2 = p % (1 + active[2])
        p1 = p // (1 + active[2]) % (1 + active[1])
        p0 = p // (1 + active[2]) // (1 + active[1])
        first = max(low[2], risk_low[2])
        last = min(low[2] + size[2], risk_low[2] + risk_size[2] - p2)
        for i in range(low[0], low[0] + size[0]):
            for j in range(low[1], low[1] + size[1]):
                at = p * box + row_at(i, j, low[2], low, size)
                row = out[at : at + size[2]]
                for k in range(np.uintp(size[2])):
                    row[k] = 0.0
                inside = risk_low[0] <= i < risk_low[0] + risk_size[0] - p0
                inside = inside and risk_low[1] <= j < risk_low[1] + risk_size[1] - p1
                if risk.size > 0 and inside and first < last:
                    start = row_at(i, j, first, risk_low, risk_size)
                    part = row[first - low[2] : last - low[2]]
                    layer = p0 * risk_size[1] * risk_size[2]
                    _charge_means(risk, start, p1 * risk_size[2], layer, p2, weight, limit, steep, part)
                if blocked.size > 0:
                    wall = blocked[p, i + h0, j + h1, low[2] + h2 : low[2] + h2 + size[2]]
                    for k in range(np.uintp(size[2])):
                        row[k] = np.inf if wall[k] else row[k]


@njit(**KERNEL)
def _charge_means(
    risk: Costs,
    start: int,
    next_row: int,
    next_layer: int,
    odd: int,
    weight: float,
    limit: float,
    steep: float,
    out: Costs,
) -> None:
    """Charge the mean of the cells from `start` on with those a row and a layer further, and the next ones if `odd`."""
    a, b = np.uintp(start), np.uintp(start + next_row)
    c, d = np.uintp(start + next_layer), np.uintp(start + next_layer + next_row)
    one, quarter, half = np.uintp(odd), np.float32(0.25), np.float32(0.5)
    for k in range(np.uintp(out.size)):
        here = quarter * (risk[a + k] + risk[b + k] + risk[c + k] + risk[d + k])
        n = k + one
        there = quarter * (risk[a + n] + risk[b + n] + risk[c + n] + risk[d + n])
        out[k] = charge(float(half * (here + there)), weight, limit, steep)


@njit(**KERNEL)
def halfway_risk(z0: int, z1: int, z2: int, risk: Costs, low: IntArray, size: IntArray) -> float:
    """Mean risk of the raster cells around a point given in half cells."""
    total = np.float32(0.0)
    for i in range(2):
        for j in range(2):
            for k in range(2):
                total += risk[row_at((z0 + i) >> 1, (z1 + j) >> 1, (z2 + k) >> 1, low, size)]
    return 0.125 * float(total)


@njit(**KERNEL)
def arrival_costs(
    low: IntArray,
    size: IntArray,
    following: Costs,
    stage: Costs,
    risk: Costs,
    risk_low: IntArray,
    risk_size: IntArray,
    blocked: NDArray[np.bool_],
    weight: float,
    limit: float,
    steep: float,
    share: float,
    out_low: IntArray,
    out_size: IntArray,
    out: Costs,
    stay: Costs,
) -> None:
    """Cost of arriving at a step and of all that follows: `following` (over `low`, `size`), stage cost, risk and walls.

    `out` covers a larger box; what is off the smaller one is forbidden. `stay` covers the smaller one: the same for who
    was there before and is charged `share` of the risk.
    """
    h0, h1, h2 = stage.shape[0] // 2, stage.shape[1] // 2, stage.shape[2] // 2
    for n in range(np.uintp(out.size)):
        out[n] = np.inf
    for i in range(low[0], low[0] + size[0]):
        for j in range(low[1], low[1] + size[1]):
            at = row_at(i, j, low[2], out_low, out_size)
            row = out[at : at + size[2]]
            at = row_at(i, j, low[2], low, size)
            known, still = following[at : at + size[2]], stay[at : at + size[2]]
            goal = stage[i + h0, j + h1, low[2] + h2 : low[2] + h2 + size[2]]
            for k in range(np.uintp(size[2])):
                still[k] = row[k] = known[k] + goal[k]
            if risk.size > 0:
                at = row_at(i, j, low[2], risk_low, risk_size)
                seen = risk[at : at + size[2]]
                for k in range(np.uintp(size[2])):
                    price = charge(float(seen[k]), weight, limit, steep)
                    row[k] += price
                    still[k] += share * price
            if blocked.size > 0:
                wall = blocked[i + h0, j + h1, low[2] + h2 : low[2] + h2 + size[2]]
                for k in range(np.uintp(size[2])):
                    row[k] = np.inf if wall[k] else row[k]
                    still[k] = np.inf if wall[k] else still[k]


@njit(**KERNEL)
def stand(
    i: int,
    j: int,
    low: int,
    out: Costs,
    stay: Costs,
    stay_low: IntArray,
    stay_size: IntArray,
    risk: Costs,
    risk_low: IntArray,
    risk_size: IntArray,
    weight: float,
    limit: float,
    steep: float,
) -> None:
    """What standing still costs along a row (i, j) from `low` on: `stay` and the risk of the half instant."""
    for k in range(np.uintp(out.size)):
        out[k] = np.inf
    if not (0 <= i - stay_low[0] < stay_size[0] and 0 <= j - stay_low[1] < stay_size[1]):
        return
    first = max(low, stay_low[2])
    count = min(low + out.size, stay_low[2] + stay_size[2]) - first
    if count <= 0:
        return
    at = row_at(i, j, first, stay_low, stay_size)
    source, row = stay[at : at + count], out[first - low : first - low + count]
    for k in range(np.uintp(count)):
        row[k] = source[k]
    if risk.size > 0:
        at = row_at(i, j, first, risk_low, risk_size)
        seen = risk[at : at + count]
        for k in range(np.uintp(count)):
            row[k] += charge(float(seen[k]), weight, limit, steep)
