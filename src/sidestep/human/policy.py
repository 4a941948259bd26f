"""Best actions everywhere, by backward induction (Eqs. 2 and 5).

Policy k says what a person does at instant k. It charges the M = max(N_H, 1) predicted states after it; with N_H = 0 the
robot is taken to stay where it is at k, otherwise it is anticipated. One sweep gives the optimal first action from every cell.

A `DirectionGoal` whose velocity lies between actions is kept on average: its deliberate action is the mixture of the two
neighbouring actions per axis that has exactly that mean. A person who minds the robot deviates per axis: along an axis where
the best component is the undisturbed one there is no reason to deviate, and the mixture stays; elsewhere the best component
itself is taken. So β = 0 and β = 1 agree exactly where the robot does not matter.
"""

from __future__ import annotations

import math

import numpy as np

from sidestep._kernels.push_horizon import Policy
from sidestep._kernels.sweep import CostTables, Values, sweep
from sidestep._kernels.sweep_tables import axis_policies
from sidestep.errors import InvalidInput
from sidestep.human.cost import CostGrid, action_costs, danger_terms, embedded_path, intended_multiples, stage_costs
from sidestep.human.goals import DirectionGoal, Goal, StandGoal
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice
from sidestep.types import BoolArray, FloatArray

TIE = 1e-6
"""Relative; costs this close are tied (float64 values)."""
TIE_SINGLE = 2e-6
"""The same for float32 values, whose rounding over 50 stages reaches this size."""


def look_ahead(model: HumanModel, horizon: int) -> tuple[int, int]:
    """(M, lead): actions that a person looks ahead, and 1 if they anticipate the robot's motion (N_H ≥ 1), else 0."""
    prediction = horizon if model.horizon is None else model.horizon
    return max(prediction, 1), min(prediction, 1)


def tolerance(grid: CostGrid) -> float:
    """Relative width of a tie for the grid's dtype."""
    return TIE if grid.dtype == np.float64 else TIE_SINGLE


def mixtures(model: HumanModel, goal: Goal, grid: CostGrid, taps: Values) -> tuple[FloatArray, float]:
    """What a chosen component stands for, (3, T, T), and the undisturbed choice's margin over the next (0: not unique).

    Identity, except for the undisturbed component of a `DirectionGoal`: the two neighbours of its intended velocity, weighted
    so that their mean is exactly that. A finite rationality spreads the choice by itself: Eq. 5's Boltzmann form is kept.
    """
    count = 2 * grid.reach + 1
    mixture = np.zeros((3, count, count))
    mixture[:, np.arange(count), np.arange(count)] = 1.0
    if not isinstance(goal, DirectionGoal) or math.isfinite(model.rationality):
        return mixture, 0.0
    margin = math.inf
    for axis, w in enumerate(intended_multiples(goal, grid), start=3 - grid.dimension):
        cost = [float(c) for c in taps[0, axis]]
        best = min(cost)
        limit = best * (1 + tolerance(grid)) + 1e-12
        margin = min(margin, min((c for c in cost if c > limit), default=math.inf) - best)
        tied = [m for m, c in enumerate(cost) if c <= limit]
        if len(tied) > 1:
            margin = 0.0
        low = min(math.floor(w), grid.reach - 1)
        for m in tied:
            mixture[axis, m, m] = 0.0
            mixture[axis, m, low + grid.reach] = low + 1 - w
            mixture[axis, m, low + 1 + grid.reach] = w - low
    return mixture, margin


def undisturbed_tables(
    model: HumanModel, goal: Goal, grid: CostGrid, taps: Values, costs: CostTables, mixture: FloatArray, radius: int
) -> FloatArray:
    """P_d of the undisturbed person per axis, (3·T, 2·radius + 1), where it is separable; size 0 where it is not."""
    d, reach = grid.dimension, grid.reach
    count, width = 2 * reach + 1, 2 * radius + 1
    if isinstance(goal, StandGoal):
        return constant_tables(np.eye(count)[[reach] * 3], width)
    if costs.goal_table.size > 0:
        return np.zeros((0, 0))
    if isinstance(goal, DirectionGoal):
        chosen = mixture[[0, 1, 2], np.argmin(taps[0], axis=1)]
        if math.isfinite(model.rationality):
            first = taps[0].astype(np.float64)
            chosen = np.exp(-model.rationality * (first - first.min(axis=1, keepdims=True)))
            chosen /= chosen.sum(axis=1, keepdims=True)
        return constant_tables(chosen, width)
    tables = np.zeros((3 * count, width))
    axes, first = costs.goal_axes.astype(np.float64, copy=False), taps.astype(np.float64, copy=False)
    axis_policies(axes, first, radius, grid.centre, d, TIE, float(model.rationality), tables)
    return tables


def constant_tables(rows: FloatArray, width: int) -> FloatArray:
    """Probabilities (3, T) that hold in every cell → (3·T, width)."""
    return np.repeat(rows.reshape(-1, 1), width, axis=1)


def policy_of(
    model: HumanModel,
    goal: Goal,
    grid: CostGrid,
    danger: tuple[Values, Values],
    bounds: FloatArray,
    free: BoolArray | None,
    radius: int,
    lead: int,
) -> Policy:
    """Everything that the kernels need to follow one goal (`static` is left empty where it is to be swept).

    Args:
        model: how the person decides.
        goal: what they are heading for.
        grid: cells and stages.
        danger: from `danger_terms`.
        bounds: (N,) most that the danger can add to any cost of policy k.
        free: grid.shape, or None.
        radius: cells a person can be in when they choose.
        lead: from `look_ahead`.
    """
    taps = action_costs(model, goal, grid)
    costs = stage_costs(model, goal, grid, danger, free)
    mixture, margin = mixtures(model, goal, grid, taps)
    tables = undisturbed_tables(model, goal, grid, taps, costs, mixture, radius)
    differs = bounds > 0
    if isinstance(goal, StandGoal):
        differs = np.zeros(len(bounds), np.bool_)
    elif margin > 0 and free is None:
        # Danger ≥ 0: the undisturbed choice costs at most `bounds` more, every other at least `margin` more than it did.
        best = float(taps.min(axis=2).sum())
        differs = bounds >= margin - 10 * tolerance(grid) * (best + margin)
    used = tables.any(axis=1).astype(np.float64)
    return Policy(costs, taps, mixture, tables, used, np.zeros((0, 0), grid.dtype), differs, lead)


def action_values(
    model: HumanModel,
    lattice: Lattice,
    goal: Goal,
    robot_path: FloatArray,
    awareness: int,
    time_step: float,
    free: BoolArray | None = None,
) -> FloatArray:
    """Least cost of every first action from every cell (Eq. 2): Q (cells…, n).

    The cost sums the goal and danger terms of the M = max(N_H, 1) predicted states and the effort of the M actions; the state
    now, which no action changes, is not charged. `StandGoal`: zero for action 0, +inf otherwise.

    Args:
        model: `horizon` None takes the length of `robot_path` less one.
        lattice: cells wanted; spacing = v·ΔT.
        goal: what the person is heading for.
        robot_path: (≥ N_H + 1, d) m, world frame, instant 0 first.
        awareness: β, 0 or 1.
        time_step: s.
        free: (cells…) of a lattice of any radius with the same anchor: cells a person may occupy; beyond it all are.

    Raises:
        InvalidInput: the path is too short, or shapes do not fit.
    """
    robot_path = np.atleast_2d(np.asarray(robot_path, dtype=np.float64))
    steps, lead = look_ahead(model, len(robot_path) - 1)
    if len(robot_path) < steps * lead + 1:
        raise InvalidInput("robot_path", robot_path.shape, f"at least {steps * lead + 1} positions")
    reach, d = model.reach, lattice.dimension
    count = 2 * reach + 1
    if isinstance(goal, StandGoal):
        values = np.full((*lattice.shape, count**d), np.inf)
        values[..., (count**d - 1) // 2] = 0.0
        return values
    grid = CostGrid(
        lattice=lattice, time_step=time_step, reach=reach, steps=steps, centre=lattice.radius + reach * steps
    )
    path = embedded_path(lattice, robot_path)
    danger = danger_terms(model, path, np.full(len(path), grid.centre), grid)
    taps = action_costs(model, goal, grid)
    costs = stage_costs(model, goal, grid, danger, embedded_free(free, grid))
    scratch = [np.zeros(grid.shape) for _ in range(3)]
    lines = np.zeros((3, grid.shape[1]))
    arrive = sweep(costs, lead, bool(awareness), taps, lattice.radius, grid.centre, d, *scratch, lines)
    return _first_actions(arrive, taps[0], lattice, reach, grid.centre)


def _first_actions(arrive: Values, taps: Values, lattice: Lattice, reach: int, centre: int) -> FloatArray:
    d, width = lattice.dimension, lattice.width
    cells = arrive.reshape((2 * centre + 1,) * d)
    count = 2 * reach + 1
    values = np.empty((*lattice.shape, count**d))
    for index, action in enumerate(np.ndindex(*([count] * d))):
        start = [centre - lattice.radius + m - reach for m in action]
        box = cells[tuple(slice(s, s + width) for s in start)]
        values[..., index] = box + sum(taps[3 - d + a, m] for a, m in enumerate(action))
    return values


def embedded_free(free: BoolArray | None, grid: CostGrid) -> BoolArray | None:
    """`free` of any odd width → grid.shape; cells beyond it are free."""
    if free is None:
        return None
    given = np.asarray(free, dtype=np.bool_)
    d, centre = grid.dimension, grid.centre
    if given.ndim != d or len(set(given.shape)) != 1 or given.shape[0] % 2 == 0:
        raise InvalidInput("free", given.shape, f"{d} equal odd sizes (the cells of a lattice)")
    radius = given.shape[0] // 2
    whole = np.ones((2 * centre + 1,) * d, dtype=np.bool_)
    kept = min(radius, centre)
    whole[(slice(centre - kept, centre + kept + 1),) * d] = given[(slice(radius - kept, radius + kept + 1),) * d]
    return whole.reshape(grid.shape)


def best_actions(
    model: HumanModel,
    lattice: Lattice,
    goal: Goal,
    robot_path: FloatArray,
    awareness: int,
    time_step: float,
    free: BoolArray | None = None,
) -> BoolArray:
    """Support of P_d (Eq. 5): bool (cells…, n), the minimisers of `action_values`; costs within 1e-6 relative are tied."""
    values = action_values(model, lattice, goal, robot_path, awareness, time_step, free)
    best = values.min(axis=-1, keepdims=True)
    limit = np.where(np.isfinite(best), best + TIE * np.abs(best) + 1e-12, -np.inf)
    return values <= limit
