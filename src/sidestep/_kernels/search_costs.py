"""What a step of the robot costs: stage costs, risk and walls, at the cells and halfway between them.

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
def sizes(radius: int, active: IntArray) -> tuple[int, int, int]:
    return 2 * radius * active[0] + 1, 2 * radius * active[1] + 1, 2 * radius * active[2] + 1


@njit(cache=True)
def halfway_costs(
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

    Rows lie as far apart as those of the costs at step + 1 (see `search._sweep`). The risk of a point between raster
    cells is the mean over the cells around it.
    """
    r = (radius * (2 * step + 1) + 1) // 2
    w0, w1, w2 = sizes(r, active)
    stride = sizes(radius * (step + 1), active)[2]
    s = (blocked.shape[3] - 1) // 2 - r
    for p0 in range(1 + active[0]):
        for p1 in range(1 + active[1]):
            for p2 in range(1 + active[2]):
                p = (p0 * (1 + active[1]) + p1) * (1 + active[2]) + p2
                for i in range(w0):
                    i1 = min(i + p0, w0 - 1)
                    for j in range(w1):
                        j1 = min(j + p1, w1 - 1)
                        at = ((p * w0 + i) * w1 + j) * stride
                        row = out[at : at + w2]
                        for k in range(w2):
                            row[k] = 0.0
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
        row[k] = charge(float(row[k]), weight, limit, steep)


@njit(cache=True)
def halfway_risk(z0: int, z1: int, z2: int, half: IntArray, risk: Costs) -> float:
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
    return 0.125 * float(total)


@njit(cache=True)
def arrival_costs(
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
    w0, w1, w2 = sizes(radius * step, active)
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
                    row[k] += charge(float(seen[k]), weight, limit, steep)
            if blocked.size > 0:
                wall = blocked[i + s * active[0], j + s * active[1], s : s + w2]
                for k in range(w2):
                    if wall[k]:
                        row[k] = np.inf


@njit(cache=True)
def standing(
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
    w0, w1, w2 = sizes(radius * step, active)
    _, v1, v2 = sizes(radius * (step + 1), active)
    _, h1, h2 = sizes((radius * (2 * step + 1) + 1) // 2, active)
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
                    cost += share * charge(float(risk[end + k]), weights[0], limit, steep)
                if halfway_risk.size > 0:
                    cost += share * charge(float(halfway_risk[mid + k]), weights[1], limit, steep)
                value[at + k] = cost


@njit(cache=True)
def block_standing(step: int, radius: int, active: IntArray, blocked: NDArray[np.bool_], value: Costs) -> None:
    """Nobody stands in a wall (from the second step on)."""
    if blocked.size == 0:
        return
    w0, w1, w2 = sizes(radius * step, active)
    s = blocked.shape[2] // 2 - radius * step * active[2]
    for i in range(w0):
        for j in range(w1):
            for k in range(w2):
                if blocked[i + s * active[0], j + s * active[1], s + k]:
                    value[(i * w1 + j) * w2 + k] = np.inf
