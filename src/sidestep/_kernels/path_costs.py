"""What a motion costs, and where it is between its steps."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray


@njit(**KERNEL)
def half_instants(path: FloatArray) -> FloatArray:
    """(2N, 3) m, where a robot on `path` (N+1, d) m is at half instants 1..2N; missing leading axes are 0."""
    steps, d = path.shape[0] - 1, path.shape[1]
    out = np.zeros((2 * steps, 3))
    for k in range(steps):
        for a in range(d):
            out[2 * k, 3 - d + a] = 0.5 * (path[k, a] + path[k + 1, a])
            out[2 * k + 1, 3 - d + a] = path[k + 1, a]
    return out


@njit(**KERNEL)
def goal_costs(points: FloatArray, goal: FloatArray, weight: FloatArray, squared: bool) -> FloatArray:
    """Straight-line goal cost (M,) at `points` (M, d) m: ‖x−g‖²_θ5 if `squared`, else ‖θ5·(x−g)‖; θ5 is (d,)."""
    out = np.empty(points.shape[0])
    for n in range(points.shape[0]):
        total = 0.0
        for a in range(points.shape[1]):
            gap = points[n, a] - goal[a]
            total += gap * gap * (weight[a] if squared else weight[a] * weight[a])
        out[n] = total if squared else math.sqrt(total)
    return out


@njit(**KERNEL)
def stands_during(path: FloatArray, k: int) -> bool:
    """Whether step k of `path` (N+1, d) m leads nowhere."""
    moved = 0.0
    for a in range(path.shape[1]):
        moved += abs(path[k + 1, a] - path[k, a])
    return moved == 0.0


@njit(**KERNEL)
def motion_cost(
    path: FloatArray,
    at_goal: FloatArray,
    terminal: float,
    effort: FloatArray,
    time_step: float,
    risk: FloatArray,
    share: float,
    soft: float,
    steep: FloatArray,
    limit: float,
    standing_share: float,
) -> float:
    """Objective (Eq. 9a) of `path` with its soft risk.

    Args:
        path: (N+1, d) m.
        at_goal: (N,) goal cost at steps 1..N.
        terminal: further multiple of the last of them.
        effort: (d,) θ6.
        time_step: s.
        risk: (2N,) at half instants 1..2N.
        share: part of a step's price of risk that a half instant is charged.
        soft: cost per unit probability and step.
        steep: (N,) further cost per unit above `limit`.
        limit: risk limit.
        standing_share: part of the risk's cost that standing still is charged.
    """
    steps = path.shape[0] - 1
    total = terminal * float(at_goal[steps - 1])
    for k in range(steps):
        moved = 0.0
        for a in range(path.shape[1]):
            speed = (path[k + 1, a] - path[k, a]) / time_step
            moved += effort[a] * speed * speed
        charged = soft * (risk[2 * k] + risk[2 * k + 1])
        for n in range(2 * k, 2 * k + 2):
            if risk[n] > limit:
                charged += steep[k] * (risk[n] - limit)
        total += at_goal[k] + moved + (standing_share if stands_during(path, k) else 1.0) * share * charged
    return total


@njit(**KERNEL)
def top_speed(path: FloatArray, time_step: float, box: bool) -> float:
    """m/s, highest speed along `path` (N+1, d) m: of an axis if `box`, else the norm; nan if a position is."""
    highest = 0.0
    for k in range(path.shape[0] - 1):
        total = 0.0
        for a in range(path.shape[1]):
            speed = abs(path[k + 1, a] - path[k, a]) / time_step
            if math.isnan(speed):
                return math.nan
            total = max(total, speed) if box else total + speed * speed
        highest = max(highest, total if box else math.sqrt(total))
    return highest


@njit(**KERNEL)
def straight_motion_cost(
    path: FloatArray,
    goal: FloatArray,
    goal_weight: FloatArray,
    squared: bool,
    terminal: float,
    effort: FloatArray,
    time_step: float,
    risk: FloatArray,
    share: float,
    soft: float,
    steep: FloatArray,
    limit: float,
    standing_share: float,
) -> float:
    """`motion_cost` where the goal cost is `goal_costs`."""
    at_goal = goal_costs(path[1:], goal, goal_weight, squared)
    return motion_cost(path, at_goal, terminal, effort, time_step, risk, share, soft, steep, limit, standing_share)
