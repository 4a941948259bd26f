"""Best actions everywhere, by backward induction (Eq. 2, 5).

Policy k says what a person does at instant k. It charges the M = max(N_H, 1) predicted states after it; with N_H = 0 the robot
is taken to stay where it is at k, otherwise it is anticipated. One sweep gives the optimal first action from every cell.

A `DirectionGoal` whose velocity lies between actions is kept on average: its deliberate action is the mixture of the two
neighbouring actions per axis that has exactly that mean. The person who minds the robot deviates per axis: along an axis where
the best component is the undisturbed one there is no reason to deviate, and the mixture stays; elsewhere the best component
itself is taken. So β = 0 and β = 1 agree exactly where the robot does not matter.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sidestep._kernels.push_horizon import Policy
from sidestep._kernels.sweep import CostTables, axis_policies, sweep
from sidestep.errors import InvalidInput
from sidestep.human.cost import (
    CostGrid,
    Values,
    action_costs,
    danger_law,
    danger_terms,
    intended_multiples,
    stage_costs,
)
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
    so that their mean is exactly that. A finite rationality spreads the choice by itself and keeps Eq. 5's Boltzmann form.
    """
    count = 2 * grid.reach + 1
    mixture = np.repeat(np.eye(count)[None], 3, axis=0)
    if not isinstance(goal, DirectionGoal) or math.isfinite(model.rationality):
        return mixture, 0.0
    margin = math.inf
    for a, w in enumerate(intended_multiples(goal, grid)):
        axis = 3 - grid.dimension + a
        cost = taps[0, axis].astype(np.float64)
        tied = cost <= cost.min() * (1 + tolerance(grid)) + 1e-12
        margin = min(margin, float(np.min(cost[~tied], initial=math.inf) - cost.min())) if tied.sum() == 1 else 0.0
        mixture[axis, tied] = 0.0
        low = min(math.floor(w), grid.reach - 1)
        mixture[axis, tied, low + grid.reach] = low + 1 - w
        mixture[axis, tied, low + 1 + grid.reach] = w - low
    return mixture, margin


def undisturbed_tables(
    model: HumanModel, goal: Goal, grid: CostGrid, taps: Values, costs: CostTables, mixture: FloatArray, radius: int
) -> FloatArray:
    """P_d of the undisturbed person per axis, (3, T, 2·radius + 1), where it is separable; size 0 where it is not."""
    d, reach = grid.dimension, grid.reach
    count, width = 2 * reach + 1, 2 * radius + 1
    if isinstance(goal, StandGoal):
        return constant_tables(np.eye(count)[np.full(3, reach)], width)
    if costs.goal_table.size > 0:
        return np.zeros((0, 0, 0))
    if isinstance(goal, DirectionGoal):
        if math.isfinite(model.rationality):
            weights = np.exp(-model.rationality * (taps[0].astype(np.float64) - taps[0].min(axis=1, keepdims=True)))
            weights[: 3 - d] = np.eye(count)[reach]
            return constant_tables(weights / weights.sum(axis=1, keepdims=True), width)
        chosen = mixture[np.arange(3), np.argmin(taps[0], axis=1)]
        chosen[: 3 - d] = np.eye(count)[reach]
        return constant_tables(chosen, width)
    tables = np.zeros((3, count, width))
    axis_policies(
        costs.goal_axes.astype(np.float64),
        taps.astype(np.float64),
        radius,
        grid.centre,
        d,
        TIE,
        model.rationality,
        tables,
    )
    return tables


def constant_tables(rows: FloatArray, width: int) -> FloatArray:
    """(3, T) probabilities that hold in every cell → (3, T, width)."""
    return np.array(np.broadcast_to(rows[:, :, None], (*rows.shape, width)), order="C")


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
        differs = np.zeros_like(differs)
    elif margin > 0 and free is None:
        # Danger ≥ 0: the undisturbed choice costs at most `bounds` more, every other at least `margin` more than it did.
        best = float(taps.min(axis=2).sum())
        differs = bounds >= margin - 10 * tolerance(grid) * (best + margin)
    return Policy(costs, taps, mixture, tables, np.zeros((0, 0, 0), grid.dtype), differs, lead)


def danger_bounds(
    model: HumanModel, path: FloatArray, grid: CostGrid, horizon: int, lead: int
) -> tuple[NDArray[np.int64], FloatArray]:
    """(radii (T,), bounds (horizon,)): box read at each instant of `path`, and the most danger along any walk of policy k."""
    steps = grid.steps
    instants = np.arange(len(path))
    radii = np.minimum(grid.reach * (instants + 1 - lead), grid.centre)
    weight, rate = danger_law(model)
    gap = np.maximum(np.abs(path) - radii[:, None] * grid.lattice.spacing, 0.0)
    squared = np.sum(gap**2, axis=1)
    most = weight * np.exp(-rate * (squared if model.danger_decay == "squared_distance" else np.sqrt(squared)))
    total = np.concatenate([[0.0], np.cumsum(most)])
    first = np.arange(horizon) + lead
    return radii, total[first + steps] - total[first]


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
        model: `horizon` must be a number here, or None for the length of `robot_path` less one.
        lattice: cells wanted; spacing = v·ΔT.
        goal: what the person is heading for.
        robot_path: (≥ N_H + 1, d) m, world frame, instant 0 first.
        awareness: β, 0 or 1.
        time_step: s.
        free: (cells…) of a lattice of any radius with the same anchor: cells a person may occupy; beyond it all are.
    """
    robot_path = np.atleast_2d(np.asarray(robot_path, dtype=np.float64))
    steps, lead = look_ahead(model, len(robot_path) - 1)
    if len(robot_path) < steps * lead + 1:
        raise InvalidInput("robot_path", robot_path.shape, f"at least {steps * lead + 1} positions")
    reach, d = model.reach, lattice.dimension
    count = 2 * reach + 1
    grid = CostGrid(
        lattice=lattice, time_step=time_step, reach=reach, steps=steps, centre=lattice.radius + reach * steps
    )
    if isinstance(goal, StandGoal):
        values = np.full((*lattice.shape, count**d), np.inf)
        values[..., (count**d - 1) // 2] = 0.0
        return values
    path = lattice.to_local(robot_path)
    danger = danger_terms(model, path, np.full(len(path), grid.centre), grid)
    taps = action_costs(model, goal, grid)
    costs = stage_costs(model, goal, grid, danger, embedded_free(free, grid))
    even, odd = np.zeros(grid.shape), np.zeros(grid.shape)
    arrive = sweep(
        costs, lead, bool(awareness), taps, lattice.radius, grid.centre, d, even, odd, np.zeros(grid.shape[1:]),
        np.zeros(grid.shape[2]),
    )  # fmt: skip
    return _first_actions(arrive, taps[0], lattice, reach, grid.centre)


def _first_actions(arrive: Values, taps: Values, lattice: Lattice, reach: int, centre: int) -> FloatArray:
    d, width = lattice.dimension, lattice.width
    real = arrive.reshape(arrive.shape[3 - d :])
    count = 2 * reach + 1
    values = np.empty((*lattice.shape, count**d))
    for index, action in enumerate(np.ndindex(*([count] * d))):
        start = [centre - lattice.radius + m - reach for m in action]
        box = real[tuple(slice(s, s + width) for s in start)]
        values[..., index] = box + sum(taps[3 - d + a, m] for a, m in enumerate(action))
    return values


def embedded_free(free: BoolArray | None, grid: CostGrid) -> BoolArray | None:
    """`free` of any odd width → grid.shape; cells beyond it are free."""
    if free is None:
        return None
    given = np.asarray(free, dtype=np.bool_)
    widths = set(given.shape)
    if given.ndim != grid.dimension or len(widths) != 1 or given.shape[0] % 2 == 0:
        raise InvalidInput("free", given.shape, f"{grid.dimension} equal odd sizes (the cells of a lattice)")
    radius = given.shape[0] // 2
    whole = np.ones((2 * grid.centre + 1,) * grid.dimension, dtype=np.bool_)
    kept = min(radius, grid.centre)
    inner = (slice(radius - kept, radius + kept + 1),) * grid.dimension
    outer = (slice(grid.centre - kept, grid.centre + kept + 1),) * grid.dimension
    whole[outer] = given[inner]
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
    """Support of P_d (Eq. 5): bool (cells…, n), the minimisers of `action_values`, costs within 1e-6 relative being tied."""
    values = action_values(replace(model), lattice, goal, robot_path, awareness, time_step, free)
    best = values.min(axis=-1, keepdims=True)
    finite = np.isfinite(best)
    return np.where(finite, values <= np.where(finite, best + TIE * np.abs(best) + 1e-12, 0.0), False)
