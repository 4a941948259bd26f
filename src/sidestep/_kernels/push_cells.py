"""One step of probability mass cell by cell: what `push` cannot do by rows, walls and finite rationality (Eqs. 4, 5)."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.sweep import Values, axis_radius, row_count
from sidestep.types import BoolArray, FloatArray


@njit(cache=True, nogil=True)
def deliberate(
    cost: Values,
    cost_centre: int,
    i0: int,
    i1: int,
    i2: int,
    taps: Values,
    mixture: FloatArray,
    tolerance: float,
    rationality: float,
    free: BoolArray,
    dimension: int,
    choice: FloatArray,
) -> bool:
    """P_d over the actions at one cell (Eq. 5, or its Boltzmann form); False if no action is admissible.

    Args:
        cost: C of `sweep`; +inf where a person cannot be.
        cost_centre: index of the anchor in it.
        i0: cell from the anchor, axis 0.
        i1: axis 1.
        i2: axis 2.
        taps: (M, 3, T); [0] is the cost of the components of the first action.
        mixture: (3, T, T) what a chosen component stands for: the identity, or for an undisturbed component a mixture that
            preserves the intended velocity. Where it would lead into a wall, the chosen action itself is taken.
        tolerance: relative; costs this close are tied.
        rationality: 1/cost, or inf.
        free: laid out as `cost`, or size 0.
        dimension: d.
        choice: (T, T, T) result; axes that only pad have their one entry at `reach`.
    """
    reach = taps.shape[2] // 2
    rows = row_count(cost_centre, dimension)
    c0, c1 = axis_radius(cost_centre, dimension)
    r0, r1 = axis_radius(reach, dimension)
    row, column = (c0 + i0) * rows + c1 + i1, cost_centre + i2
    best = np.inf
    for u0 in range(-r0, r0 + 1):
        for u1 in range(-r1, r1 + 1):
            for u2 in range(-reach, reach + 1):
                tap = taps[0, 0, u0 + reach] + taps[0, 1, u1 + reach] + taps[0, 2, u2 + reach]
                value = tap + cost[row + u0 * rows + u1, column + u2]
                choice[u0 + reach, u1 + reach, u2 + reach] = value
                best = min(best, value)
    if not np.isfinite(best):
        return False
    limit, total = best + tolerance * abs(best) + 1e-12, 0.0
    for u0 in range(reach - r0, reach + r0 + 1):
        for u1 in range(reach - r1, reach + r1 + 1):
            for u2 in range(2 * reach + 1):
                value = choice[u0, u1, u2]
                weight = 1.0 if value <= limit else 0.0
                if np.isfinite(rationality):
                    weight = np.exp(-rationality * (value - best))
                choice[u0, u1, u2] = weight
                total += weight
    for u0 in range(reach - r0, reach + r0 + 1):
        for u1 in range(reach - r1, reach + r1 + 1):
            for u2 in range(2 * reach + 1):
                choice[u0, u1, u2] /= total
    if not np.isfinite(rationality):
        _substitute(choice, mixture, free, row, rows, column, reach, r0, r1)
    return True


@njit(cache=True, nogil=True)
def _substitute(
    choice: FloatArray,
    mixture: FloatArray,
    free: BoolArray,
    row: int,
    rows: int,
    column: int,
    reach: int,
    r0: int,
    r1: int,
) -> None:
    """Replace chosen components by what they stand for, unless that leads into a wall."""
    plain = choice.copy()
    for u0 in range(reach - r0, reach + r0 + 1):
        for u1 in range(reach - r1, reach + r1 + 1):
            for u2 in range(2 * reach + 1):
                weight = plain[u0, u1, u2]
                if weight == 0.0 or mixture[0, u0, u0] * mixture[1, u1, u1] * mixture[2, u2, u2] == 1.0:
                    continue
                blocked = False
                for phase in range(2):
                    if phase == 1 and blocked:
                        continue
                    if phase == 1:
                        choice[u0, u1, u2] -= weight
                    for v0 in range(reach - r0, reach + r0 + 1):
                        for v1 in range(reach - r1, reach + r1 + 1):
                            for v2 in range(2 * reach + 1):
                                part = mixture[0, u0, v0] * mixture[1, u1, v1] * mixture[2, u2, v2]
                                if part == 0.0:
                                    continue
                                if phase == 1:
                                    choice[v0, v1, v2] += weight * part
                                elif free.size > 0:
                                    to = row + (v0 - reach) * rows + v1 - reach
                                    blocked = blocked or not free[to, column + v2 - reach]


@njit(cache=True, nogil=True)
def spread_randomly(
    free: BoolArray,
    free_centre: int,
    i0: int,
    i1: int,
    i2: int,
    reach: int,
    share: float,
    dimension: int,
    choice: FloatArray,
) -> None:
    """choice = share spread evenly over the admissible actions at a cell, those into free cells; none: the person stays."""
    rows = row_count(free_centre, dimension)
    c0, c1 = axis_radius(free_centre, dimension)
    r0, r1 = axis_radius(reach, dimension)
    row, column = (c0 + i0) * rows + c1 + i1, free_centre + i2
    admissible = 0
    choice[:] = 0.0
    for phase in range(2):
        for u0 in range(-r0, r0 + 1):
            for u1 in range(-r1, r1 + 1):
                for u2 in range(-reach, reach + 1):
                    if free.size == 0 or free[row + u0 * rows + u1, column + u2]:
                        if phase == 0:
                            admissible += 1
                        else:
                            choice[u0 + reach, u1 + reach, u2 + reach] = share / admissible
    if admissible == 0:
        choice[reach, reach, reach] = share


@njit(cache=True, nogil=True)
def push_cells(
    mass: FloatArray,
    alive: FloatArray,
    both: bool,
    radius: int,
    centre: int,
    cost: Values,
    cost_centre: int,
    taps: Values,
    mixture: FloatArray,
    tolerance: float,
    rationality: float,
    free: BoolArray,
    share: float,
    dimension: int,
    out: FloatArray,
    out_alive: FloatArray,
    half: FloatArray,
    half_centre: int,
    choice: FloatArray,
) -> None:
    """Move `share` of the mass along P_d of `cost`, or at random among walls if `cost` is empty; arguments as for `push`.

    `free` is laid out as `cost`, around `cost_centre`.
    """
    reach = taps.shape[2] // 2
    rows, half_rows = row_count(centre, dimension), row_count(half_centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    h0, h1 = axis_radius(half_centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    r0, r1 = axis_radius(reach, dimension)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            for i2 in range(-radius, radius + 1):
                row, column = (c0 + i0) * rows + c1 + i1, centre + i2
                here = share * mass[row, column]
                if here == 0.0:
                    continue
                living = share * alive[row, column] if both else 0.0
                if cost.size == 0:
                    spread_randomly(free, cost_centre, i0, i1, i2, reach, 1.0, dimension, choice)
                elif not deliberate(
                    cost, cost_centre, i0, i1, i2, taps, mixture, tolerance, rationality, free, dimension, choice
                ):
                    choice[:] = 0.0
                    choice[reach, reach, reach] = 1.0
                for u0 in range(-r0, r0 + 1):
                    for u1 in range(-r1, r1 + 1):
                        for u2 in range(-reach, reach + 1):
                            part = choice[u0 + reach, u1 + reach, u2 + reach]
                            if part == 0.0:
                                continue
                            out[row + u0 * rows + u1, column + u2] += part * here
                            if both:
                                out_alive[row + u0 * rows + u1, column + u2] += part * living
                            if half.size > 0:
                                line = (h0 + 2 * i0 + u0) * half_rows + h1 + 2 * i1 + u1
                                at = half_centre + 2 * i2 + u2
                                half[2 * line + at % 2, at // 2] += part * here
