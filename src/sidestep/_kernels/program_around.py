"""The whole convex program around a path in one call, and what becomes of its solution."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep._kernels.path_costs import half_instants, stands_during
from sidestep._kernels.program import goal_model, half_planes, objective
from sidestep._kernels.search_corridor import corridor, soft_slope
from sidestep.types import FloatArray, IntArray

REACH = 1.5
"""Cells of the lattice that are looked around a path."""


@njit(**KERNEL)
def program_around(
    path: FloatArray,
    spacing: float,
    directions: FloatArray,
    goal: FloatArray,
    goal_weight: FloatArray,
    squared: bool,
    terminal: float,
    given: FloatArray,
    effort: FloatArray,
    time_step: float,
    preferred: FloatArray,
    preference_weight: float,
    values: NDArray[np.float32],
    starts: IntArray,
    some: NDArray[np.bool_],
    low: IntArray,
    size: IntArray,
    limit: float,
    share: float,
    soft: float,
    steep: FloatArray,
    standing_share: float,
    walls: FloatArray,
    max_speed: float,
    box: bool,
    velocity: FloatArray,
    largest_change: float,
) -> tuple[FloatArray, FloatArray]:
    """Eq. 9 to second order around `path`.

    Args:
        path: (N+1, d) m.
        spacing: m between the cells of the lattice, and how far every position may move.
        directions: (m, d) unit vectors to look along.
        goal, goal_weight, squared, terminal: as for `goal_model`.
        given: (2, N, d) curvature and slope of the goal cost, where it is not the straight-line one; or size 0.
        effort: (d,) θ6.
        time_step: s.
        preferred: (d,) m/s, preferred first velocity, with
        preference_weight: cost per m²/s² off it; 0 where none is preferred.
        values, starts, some, low, size: rasters of the risk, as in `_kernels.risk_raster.rasterise_all`.
        limit: risk above which a place is forbidden.
        share: part of a step's price of risk that a half instant is charged.
        soft: cost per unit risk and step.
        steep: (N,) further cost per unit above the limit.
        standing_share: part of both that standing still is charged.
        walls: (2N, m) m of room until walls are met at half instants 1..2N; or size 0.
        max_speed: m/s.
        box: it limits every axis, not the norm.
        velocity: (d,) m/s now.
        largest_change: m/s by which the first velocity may differ from it, or inf.

    Returns:
        (N·d + 3, N·d) the Hessian, and below it linear term, lower and upper bounds (m) of the positions;
        (N·d + 1, ·) of `half_planes`.
    """
    steps, d = path.shape[0] - 1, path.shape[1]
    if given.size:
        curvature, slope = given[0], given[1].copy()
    else:
        curvature, slope = goal_model(path, goal, goal_weight, squared, terminal)
    room = walls
    if some.any():
        price = share / spacing
        room, rise = _among_risk(
            path, spacing, directions, values, starts, some, low, size, limit, price * soft, price * steep,
            standing_share,
        )  # fmt: skip
        slope += rise
        for n in range(walls.shape[0]):
            for m in range(walls.shape[1]):
                room[n, m] = min(room[n, m], walls[n, m])
    rows = np.empty((steps * d + 3, steps * d))
    per_move = 2.0 / time_step**2
    first = path[0] + time_step * preferred
    objective(path, curvature, slope, per_move * effort, first, per_move * preference_weight, rows[:-2])
    _trust_region(path, spacing, velocity * time_step, largest_change * time_step / math.sqrt(d), rows[-2:])
    slack = 2.0 * spacing * math.sqrt(d)
    return rows, half_planes(path, room, directions, REACH * spacing, max_speed * time_step, box, slack)


@njit(**KERNEL)
def _among_risk(
    path: FloatArray,
    spacing: float,
    directions: FloatArray,
    values: NDArray[np.float32],
    starts: IntArray,
    some: NDArray[np.bool_],
    low: IntArray,
    size: IntArray,
    limit: float,
    soft: float,
    steep: FloatArray,
    standing_share: float,
) -> tuple[FloatArray, FloatArray]:
    """Room (2N, m) m until the risk passes the limit, and the slope (N, d) of the soft risk; see `corridor`."""
    d = path.shape[1]
    cells = half_instants(path)
    rays, active = np.zeros((directions.shape[0], 3)), np.zeros(3, np.int64)
    for a in range(d):
        active[3 - d + a] = 1
        for half in range(cells.shape[0]):
            cells[half, 3 - d + a] = (cells[half, 3 - d + a] - path[0, a]) / spacing
        for ray in range(rays.shape[0]):
            rays[ray, 3 - d + a] = directions[ray, a]
    room, slope, level = corridor(cells, rays, REACH, active, values, starts, some, low, size, limit)
    paid = np.ones(steep.size)
    for k in range(steep.size):
        if stands_during(path, k):
            paid[k] = standing_share
    return room * spacing, soft_slope(slope, level, soft, steep, limit, paid, d)


@njit(**KERNEL)
def _trust_region(path: FloatArray, spacing: float, stride: FloatArray, change: float, out: FloatArray) -> None:
    """Write the bounds (2, N·d) m of the positions; those of x_1 also keep it near where the `stride` (d,) m leads.

    That is: within `change` m per axis; where `path` itself is farther off, no farther.
    """
    d = path.shape[1]
    for n in range(out.shape[1]):
        k, a = n // d, n % d
        here = path[k + 1, a]
        out[0, n], out[1, n] = here - spacing, here + spacing
        if k == 0 and change < math.inf:
            middle = path[0, a] + stride[a]
            out[0, n] = min(max(out[0, n], middle - change), here)
            out[1, n] = max(min(out[1, n], middle + change), here)


@njit(**KERNEL)
def promised_gain(path: FloatArray, moved: FloatArray, rows: FloatArray) -> float:
    """By how much the objective in `rows` of `program_around` falls from `path` (N+1, d) m to `moved` (N·d,) m."""
    gain, d = 0.0, path.shape[1]
    for n in range(moved.size):
        bend = 0.0
        for m in range(moved.size):
            bend += rows[n, m] * (path[1 + m // d, m % d] + moved[m])
        gain += (path[1 + n // d, n % d] - moved[n]) * (0.5 * bend + rows[moved.size, n])
    return gain


@njit(**KERNEL)
def part_way(path: FloatArray, moved: FloatArray, part: float) -> FloatArray:
    """(N+1, d) m, `part` of the way from `path` (N+1, d) m to the positions `moved` (N·d,) m; x_0 stays.

    Who stands during a step goes on standing, wherever that is: standing is charged less, and the least motion is none.
    """
    out, d = path.copy(), path.shape[1]
    for k in range(path.shape[0] - 1):
        stands = stands_during(path, k)
        for a in range(d):
            out[k + 1, a] = out[k, a] if stands else path[k + 1, a] + part * (moved[k * d + a] - path[k + 1, a])
    return out
