"""What a sweep reads, laid out beforehand: the danger of every instant; and policies of costs that separate by axis."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import Values, axis_radius, row_count
from sidestep.types import BoolArray, FloatArray


@njit(**KERNEL, nogil=True)
def lay_out_danger(
    world: FloatArray,
    origin: FloatArray,
    rotation: FloatArray,
    spacing: float,
    weight: float,
    rate: float,
    squared: bool,
    centre: int,
    reach: int,
    steps: int,
    lead: int,
    path: FloatArray,
    bounds: FloatArray,
    axes: Values,
) -> None:
    """Where the robot is in the lattice's frame, the most that it costs anybody, and its danger where that separates.

    Args:
        world: (≥ T, d) m, positions of the robot.
        origin: (d,) m, the lattice's anchor.
        rotation: (d, d), its axes.
        spacing: m.
        weight: of the danger.
        rate: 1/m² or 1/m.
        squared: decay with the squared distance: weight · Π_a exp(−rate · (x_a − r_a)²).
        centre: index of the anchor in `axes`.
        reach: largest action in cells.
        steps: M.
        lead: 1 if the robot is anticipated, 0 if it is taken to stay where it is.
        path: (T, 3) m, written: 0 on the axes that only pad.
        bounds: (N,) written: most danger on any walk of policy k.
        axes: (3·T, C), written if `squared`.
    """
    d = origin.size
    for t in range(path.shape[0]):
        for axis in range(3):
            path[t, axis] = 0.0
            if axis >= 3 - d:
                for b in range(d):
                    path[t, axis] += (world[t, b] - origin[b]) * rotation[b, axis - 3 + d]
            if not squared:
                continue
            scale = weight if axis == 0 else 1.0
            for c in range(axes.shape[1] if axis >= 3 - d else 1):
                gap = spacing * (c - centre) - path[t, axis] if axis >= 3 - d else 0.0
                axes[3 * t + axis, c] = scale * np.exp(-rate * gap * gap)
    for k in range(bounds.size):
        bounds[k] = 0.0
        for t in range(k + lead, k + lead + steps):
            far = 0.0
            for axis in range(3):
                far += max(abs(path[t, axis]) - reach * (t + 1 - lead) * spacing, 0.0) ** 2
            bounds[k] += weight * np.exp(-rate * (far if squared else np.sqrt(far)))


@njit(**KERNEL, nogil=True)
def danger_tables(
    path: FloatArray,
    radius: int,
    reach: int,
    lead: int,
    spacing: float,
    weight: float,
    rate: float,
    centre: int,
    dimension: int,
    out: Values,
) -> None:
    """Decay with the distance itself: weight · exp(−rate · ‖x − r‖), on the box that is read at each instant."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    for t in range(path.shape[0]):
        box = min(radius + reach * (t + 1 - lead), centre)
        first = t * (2 * c0 + 1) * rows
        b0, b1 = axis_radius(box, dimension)
        for i0 in range(-b0, b0 + 1):
            for i1 in range(-b1, b1 + 1):
                g0, g1 = spacing * i0 - path[t, 0], spacing * i1 - path[t, 1]
                row = first + (c0 + i0) * rows + c1 + i1
                for i2 in range(-box, box + 1):
                    g2 = spacing * i2 - path[t, 2]
                    distance = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
                    out[row, centre + i2] = weight * np.exp(-rate * distance)


@njit(**KERNEL, nogil=True)
def lay_out_squares(goal: FloatArray, weight: FloatArray, spacing: float, centre: int, axes: FloatArray) -> None:
    """Weighted squared distance along each axis, θ1·(x_a − g_a)².

    Args:
        goal: (d,) m, in the lattice's frame.
        weight: (d,) θ1.
        spacing: m.
        centre: index of the anchor.
        axes: (3, C), written on the last d rows.
    """
    d = goal.size
    for a in range(d):
        for c in range(axes.shape[1]):
            gap = spacing * (c - centre) - goal[a]
            axes[3 - d + a, c] = weight[a] * gap * gap


@njit(**KERNEL, nogil=True)
def lay_out_distances(
    goal: FloatArray, weight: FloatArray, spacing: float, centre: int, dimension: int, table: Values
) -> None:
    """Distance to the goal from every cell, ‖θ1·(x − g)‖; arguments as above, `table` (rows, C)."""
    rows = row_count(centre, dimension)
    axes = np.zeros((3, table.shape[1]))
    lay_out_squares(goal, weight * weight, spacing, centre, axes)
    for row in range(table.shape[0]):
        aside = axes[1, row % rows] if dimension > 1 else 0.0
        aside += axes[0, row // rows] if dimension > 2 else 0.0
        for c in range(table.shape[1]):
            table[row, c] = np.sqrt(aside + axes[2, c])


@njit(**KERNEL, nogil=True)
def wall_off(free: BoolArray, axes: FloatArray, summed: bool, layer: int, table: FloatArray) -> None:
    """Forbid cells that are not free.

    Args:
        free: (rows, C), or size 0: no walls, nothing is done.
        axes: (3, C) cost per axis.
        summed: what the free cells cost is the sum of `axes`; else it stands in `table` already.
        layer: rows that make up one cell of the first axis.
        table: (rows, C), written: +inf where a cell is not free.
    """
    for row in range(free.shape[0]):
        aside = axes[0, row // layer] + axes[1, row % layer]
        for c in range(free.shape[1]):
            here = aside + axes[2, c] if summed else table[row, c]
            table[row, c] = here if free[row, c] else np.inf


@njit(**KERNEL, nogil=True)
def lay_out_actions(
    effort: FloatArray,
    pull: FloatArray,
    intended: FloatArray,
    speed: float,
    mixing: bool,
    rationality: float,
    tolerance: float,
    taps: FloatArray,
    mixture: FloatArray,
    tables: FloatArray,
) -> tuple[float, float]:
    """Cost of the components of all actions, and what is chosen where the goal is a direction and the way is clear.

    Args:
        effort: (d,) weight θ2 per axis.
        pull: (d,) cost per cell that an action falls short of the intended one, and per instant that this lasts.
        intended: (d,) intended velocity in units of v.
        speed: m/s, v.
        mixing: the best component stands for the mixture of the two around the intended one that has it as its mean.
        rationality: of Eq. 5, or inf.
        tolerance: relative; costs this close are tied.
        taps: (M, 3, T), written; 0 on the axes that only pad.
        mixture: (3, T, T), written: what a chosen component stands for.
        tables: (3·T, C), written: probability of each component where nothing is in the way, the same in every cell.

    Returns:
        by how much the best components are better than any other; 0 if they are not unique, or if not `mixing`; and
        the cost of the cheapest component of every axis and action together.
    """
    steps, _, count = taps.shape
    reach, d = count // 2, effort.size
    margin, cheapest = np.inf if mixing else 0.0, 0.0
    for axis in range(3):
        a, best = axis - 3 + d, np.inf
        for u in range(count):
            for v in range(count):
                mixture[axis, u, v] = 1.0 if u == v else 0.0
            for j in range(steps):
                taps[j, axis, u] = 0.0
                if a >= 0:
                    short = abs(intended[a] - (u - reach))
                    taps[j, axis, u] = effort[a] * ((u - reach) * speed) ** 2 + (steps - j) * pull[a] * short
            best = min(best, taps[0, axis, u])
        for j in range(steps):
            cheapest += taps[j, axis].min()
        limit, low, tied, total = best + tolerance * best + 1e-12, reach, 0, 0.0
        if a >= 0:
            low = min(int(np.floor(intended[a])) + reach, 2 * reach - 1)
        for u in range(count):
            chosen = 1.0 if taps[0, axis, u] <= limit else 0.0
            if a < 0:
                chosen = 1.0 if u == reach else 0.0
            elif mixing:
                tied += int(chosen)
                margin = margin if chosen == 1.0 else min(margin, taps[0, axis, u] - best)
                above = intended[a] - (low - reach)
                for v in range(count if chosen == 1.0 else 0):
                    mixture[axis, u, v] = 1.0 - above if v == low else above if v == low + 1 else 0.0
                chosen = 1.0 - above if u == low else above if u == low + 1 else 0.0
            elif np.isfinite(rationality):
                chosen = np.exp(-rationality * (taps[0, axis, u] - best))
            tables[axis * count + u, 0] = chosen
            total += chosen
        margin = margin if tied <= 1 else 0.0
        for u in range(count):
            row = axis * count + u
            chosen = tables[row, 0] / total
            for c in range(tables.shape[1]):
                tables[row, c] = chosen
    return margin, cheapest


@njit(**KERNEL, nogil=True)
def slowing_policies(pace: FloatArray, time: float, radius: int, reach: int, tables: FloatArray) -> None:
    """P_d per axis of a person who slows down: `tables` (3·T, 2·radius + 1), all written.

    In the cell c the mean action is what is left to the end of the walk, pace·time − c, times 1 − e^{−1/time}: from the
    anchor on, e^{−k/time} of the pace after k steps exactly. It is the mixture of its two neighbours.

    Args:
        pace: (d,) cells per step at the anchor.
        time: steps in which the pace falls to 1/e.
        radius: cells a person can be in; reach: largest action.
        tables: see above.
    """
    count, share = 2 * reach + 1, -np.expm1(-1.0 / time)
    tables[:] = 0.0
    for axis in range(3):
        a = axis - 3 + pace.size
        for c in range(2 * radius + 1):
            mean = share * (pace[a] * time - (c - radius)) if a >= 0 else 0.0
            mean = min(max(mean, -reach), reach)
            low = min(int(np.floor(mean)), reach - 1)
            tables[axis * count + low + reach, c] = low + 1.0 - mean
            tables[axis * count + low + 1 + reach, c] = mean - low


@njit(**KERNEL, nogil=True)
def axis_policies(
    goal_axes: FloatArray,
    taps: FloatArray,
    radius: int,
    centre: int,
    dimension: int,
    tolerance: float,
    rationality: float,
    tables: FloatArray,
) -> None:
    """P_d per axis for separable costs and β = 0: `tables` (3·T, C), the first action's components on ±radius cells.

    Arguments as for `sweep`; `centre` is the anchor's index in `goal_axes` (3, C), the middle of `tables` its own.
    """
    steps, _, count = taps.shape
    reach = count // 2
    middle = (tables.shape[1] - 1) // 2
    values = np.empty(goal_axes.shape[1])
    lower = np.empty(goal_axes.shape[1])
    for axis in range(3):
        if axis < 3 - dimension:
            continue
        for i in range(values.size):
            values[i] = goal_axes[axis, i]
        for j in range(steps - 1, 0, -1):
            box = radius + reach * j
            for i in range(centre - box, centre + box + 1):
                best = np.inf
                for u in range(count):
                    best = min(best, taps[j, axis, u] + values[i + u - reach])
                lower[i] = best + goal_axes[axis, i]
            for i in range(centre - box, centre + box + 1):
                values[i] = lower[i]
        for i in range(-radius, radius + 1):
            _spread_over_minimisers(
                values, centre + i, taps[0, axis], tolerance, rationality, tables, axis * count, middle + i
            )


@njit(**KERNEL, nogil=True)
def _spread_over_minimisers(
    values: FloatArray,
    at: int,
    taps: FloatArray,
    tolerance: float,
    rationality: float,
    tables: FloatArray,
    first: int,
    column: int,
) -> None:
    reach = taps.size // 2
    best = np.inf
    for u in range(taps.size):
        best = min(best, taps[u] + values[at + u - reach])
    total = 0.0
    for u in range(taps.size):
        gap = taps[u] + values[at + u - reach] - best
        weight = 1.0 if gap <= tolerance * abs(best) + 1e-12 else 0.0
        if np.isfinite(rationality):
            weight = np.exp(-rationality * gap)
        tables[first + u, column] = weight
        total += weight
    for u in range(taps.size):
        tables[first + u, column] /= total
