"""One person's decision: what every first action costs from the cell they stand in (Eq. 2), and which one is taken."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep._kernels.frames import local
from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import CostTables, Values, axis_radius, row_count, sweep
from sidestep._kernels.sweep_tables import (
    danger_tables,
    lay_out_actions,
    lay_out_danger,
    lay_out_distances,
    lay_out_squares,
    wall_off,
)
from sidestep.types import BoolArray, FloatArray


@njit(**KERNEL, nogil=True)
def first_action_costs(
    world: FloatArray,
    origin: FloatArray,
    rotation: FloatArray,
    spacing: float,
    speed: float,
    reach: int,
    steps: int,
    lead: int,
    goal: FloatArray,
    goal_weight: FloatArray,
    effort_weight: FloatArray,
    squared_goal: bool,
    danger: bool,
    danger_weight: float,
    danger_rate: float,
    squared_decay: bool,
    free: BoolArray,
) -> FloatArray:
    """Least cost (n,) of every first action of somebody at the anchor who is heading for a place.

    Args:
        world: (≥ lead·M + 1, d) m, positions of the robot, instant 0 first.
        origin: (d,) m, the anchor; rotation: (d, d), the lattice's axes; spacing: m.
        speed: m/s, one cell per step.
        reach: largest action in cells.
        steps: M; lead: 1 if the robot is anticipated, 0 if it is taken to stay where it is.
        goal: (d,) m; goal_weight: (d,) θ1; effort_weight: (d,) θ2.
        squared_goal: the squared distance to the goal, or the distance.
        danger: β.
        danger_weight: θ3; danger_rate: θ4; squared_decay: with the squared distance.
        free: (rows, C) cells a person may occupy, laid out as values, or size 0.
    """
    d, count, centre = origin.size, 2 * reach + 1, reach * steps
    here, mixing = 0 * reach, bool(0)  # as literals they would have the functions they go to compiled once more
    columns = 2 * centre + 1
    rows = columns ** (d - 1)
    taps = np.empty((steps, 3, count))
    lay_out_actions(
        effort_weight, np.zeros(d), np.zeros(d), speed, mixing, np.inf, 0.0, taps, np.empty((3, count, count)),
        np.empty((3 * count, 1)),
    )  # fmt: skip
    axes, table = _goal_terms(origin, rotation, spacing, goal, goal_weight, squared_goal, centre, rows, free)
    instants = lead * steps + 1 if danger else 0
    path = np.empty((instants, 3))
    by_axis = np.empty((3 * instants if squared_decay else 0, columns))
    by_cell = np.empty((0 if squared_decay else instants * rows, columns))
    if danger:
        lay_out_danger(
            world, origin, rotation, spacing, danger_weight, danger_rate, squared_decay, centre, reach, steps, lead,
            path, np.empty(0), by_axis,
        )  # fmt: skip
        if not squared_decay:
            danger_tables(path, here, reach, lead, spacing, danger_weight, danger_rate, centre, d, by_cell)
    plane, lines = np.empty((columns if d == 3 else 0, columns)), np.empty((3, columns))
    even, odd = np.empty((rows, columns)), np.empty((rows, columns))
    costs = CostTables(axes, table, by_axis, by_cell)
    arrive = sweep(costs, lead, danger, taps, here, centre, d, even, odd, plane, lines)
    return _with_effort(arrive, taps, centre, d)


@njit(**KERNEL, nogil=True)
def _goal_terms(
    origin: FloatArray, rotation: FloatArray, spacing: float, goal: FloatArray, weight: FloatArray, squared: bool,
    centre: int, rows: int, free: BoolArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Goal terms of `CostTables`: per axis, or as a table where there are walls or the distance is not squared."""
    d, columns = origin.size, 2 * centre + 1
    to_goal = local(goal, origin, rotation)
    axes, table = np.zeros((3, columns)), np.empty((rows if free.size > 0 or not squared else 0, columns))
    if squared:
        lay_out_squares(to_goal, weight, spacing, centre, axes)
    else:
        lay_out_distances(to_goal, weight, spacing, centre, d, table)
    wall_off(free, axes, squared, row_count(centre, d), table)
    return axes, table


@njit(**KERNEL, nogil=True)
def _with_effort(arrive: Values, taps: FloatArray, centre: int, dimension: int) -> FloatArray:
    """(n,) what arriving with each action costs from the middle cell, and the action itself; last axis fastest."""
    count = taps.shape[2]
    r0, r1 = axis_radius(count // 2, dimension)
    c0, c1 = axis_radius(centre, dimension)
    pad0, pad1 = count // 2 - r0, count // 2 - r1  # the middle component on axes that only pad
    out = np.empty((2 * r0 + 1) * (2 * r1 + 1) * count)
    a = 0
    for u0 in range(2 * r0 + 1):
        for u1 in range(2 * r1 + 1):
            row = (c0 - r0 + u0) * row_count(centre, dimension) + c1 - r1 + u1
            for u2 in range(count):
                effort = taps[0, 0, pad0 + u0] + taps[0, 1, pad1 + u1] + taps[0, 2, u2]
                out[a] = arrive[row, centre - count // 2 + u2] + effort
                a += 1
    return out


@njit(**KERNEL, nogil=True)
def seen_off(path: FloatArray, place: FloatArray, error: float) -> FloatArray:
    """(K, d) m: `path` as it is seen from `place` (d,) m, every position farther off by `error` m."""
    out = np.empty_like(path)
    for k in range(path.shape[0]):
        square = 0.0
        for a in range(place.size):
            square += (path[k, a] - place[a]) ** 2
        distance = max(math.sqrt(square), 1e-9)
        for a in range(place.size):
            out[k, a] = path[k, a] + error * (path[k, a] - place[a]) / distance
    return out


@njit(**KERNEL, nogil=True)
def odds_of(costs: FloatArray, rationality: float, tolerance: float) -> FloatArray:
    """(n,) weights of the actions in P_d (Eq. 5): 1 for the cheapest and its ties; 0 for all if none is possible.

    Args:
        costs: (n,).
        rationality: 1/cost; finite: exp(−rationality · what an action costs beyond the cheapest).
        tolerance: relative; costs this close are tied.
    """
    best = costs.min()
    out = np.zeros(costs.size)
    for a in range(costs.size if best < np.inf else 0):
        if math.isfinite(rationality):
            out[a] = math.exp(-rationality * (costs[a] - best))
        elif costs[a] <= best + tolerance * abs(best) + 1e-12:
            out[a] = 1.0
    return out


@njit(**KERNEL, nogil=True)
def drawn(odds: FloatArray, luck: float) -> int:
    """Index of the action that `luck`, uniform in [0, 1), falls on; −1 if none has any weight."""
    total = odds.sum()
    if total <= 0.0:
        return -1
    below = 0.0
    for a in range(odds.size):
        below += odds[a] / total
        if luck < below:
            return a
    return odds.size - 1
