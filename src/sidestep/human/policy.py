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
from dataclasses import dataclass

import numpy as np

from sidestep._kernels.sweep import CostTables, Values, sweep
from sidestep._kernels.sweep_choices import WORD, Choices, ValueScratch, choose, mark_admissible
from sidestep._kernels.sweep_tables import axis_policies
from sidestep.errors import InvalidInput
from sidestep.human.cost import CostGrid, action_costs, danger_terms, embedded_path, intended_multiples, stage_costs
from sidestep.human.goals import DirectionGoal, Goal, StandGoal
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice
from sidestep.types import BoolArray, FloatArray, IntArray

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


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalPolicy:
    """What a person with one goal would do, ready to be swept.

    Attributes:
        grid: cells and stages.
        costs: stage costs on it.
        taps: (M, 3, T) cost of the components of the M actions ahead.
        mixture: (3, T, T) what a chosen component stands for.
        tables: (3·T, 2·radius + 1) undisturbed P_d per axis where it is separable; size 0 where it is not.
        differs: (N,) False where the danger provably changes no action of policy k.
        free: grid.shape, or size 0.
        rationality: of Eq. 5.
    """

    grid: CostGrid
    costs: CostTables
    taps: Values
    mixture: FloatArray
    tables: FloatArray
    differs: BoolArray
    free: BoolArray
    rationality: float

    def concerned(self, first: int, last: int, lead: int, scratch: ValueScratch) -> Choices:
        """Sweep the policies first ≤ k < last of the person who minds the robot, each for the cells that can be reached by then."""
        radii = self.grid.reach * np.arange(len(self.differs))
        sizes = np.where(self.differs, (2 * radii + 1) ** self.grid.dimension, 0)
        sizes[:first] = 0
        sizes[last:] = 0
        ends = np.cumsum(sizes)
        choices = self._no_choices(radii, ends - sizes, int(ends[-1]))
        self._choose(True, lead, first, last, self.differs, scratch, choices)
        return choices

    def undisturbed(self, radius: int, scratch: ValueScratch) -> Choices:
        """Sweep the one policy of the person who does not mind the robot, where it is not separable."""
        horizon = len(self.differs)
        offsets = np.zeros(horizon, np.int64)
        if self.tables.size > 0:
            return self._no_choices(offsets, offsets, 0)
        radii = np.full(horizon, radius)
        choices = self._no_choices(radii, offsets, (2 * radius + 1) ** self.grid.dimension)
        self._choose(False, 0, 0, 1, np.ones(1, np.bool_), scratch, choices)
        return choices

    def _no_choices(self, radii: IntArray, offsets: IntArray, cells: int) -> Choices:
        actions = (2 * self.grid.reach + 1) ** self.grid.dimension
        words = -(-actions // WORD)
        if math.isfinite(self.rationality):
            return Choices(radii, offsets, words, np.zeros((words, 0), np.int64), np.zeros((actions, cells)))
        layers = 1 if self.free.size == 0 or _is_identity(self.mixture) else 2
        return Choices(radii, offsets, words, np.zeros((layers * words, cells), np.int64), np.zeros((0, 0)))

    def _choose(
        self, danger: bool, lead: int, first: int, last: int, wanted: BoolArray, scratch: ValueScratch, choices: Choices
    ) -> None:
        grid = self.grid
        choose(
            self.costs, self.taps, danger, lead, first, last, wanted, grid.centre, grid.dimension, tolerance(grid),
            self.rationality, self.free, self.mixture, scratch, choices,
        )  # fmt: skip


def _is_identity(mixture: FloatArray) -> bool:
    return bool(np.all(np.diagonal(mixture, axis1=1, axis2=2) == 1.0))


def policy_of(
    model: HumanModel,
    goal: Goal,
    grid: CostGrid,
    danger: tuple[Values, Values],
    bounds: FloatArray,
    free: BoolArray | None,
    radius: int,
) -> GoalPolicy:
    """Lay out everything that a sweep for one goal needs.

    Args:
        model: how the person decides.
        goal: what they are heading for.
        grid: cells and stages.
        danger: from `danger_terms`.
        bounds: (N,) most that the danger can add to any cost of policy k.
        free: grid.shape, or None.
        radius: cells a person can be in when they choose.
    """
    taps = action_costs(model, goal, grid)
    costs = stage_costs(model, goal, grid, danger, free)
    mixture, margin = mixtures(model, goal, grid, taps)
    differs = bounds > 0
    if isinstance(goal, StandGoal):
        differs = np.zeros(len(bounds), np.bool_)
    elif margin > 0 and free is None:
        # Danger ≥ 0: the undisturbed choice costs at most `bounds` more, every other at least `margin` more than it did.
        best = float(taps.min(axis=2).sum())
        differs = bounds >= margin - 10 * tolerance(grid) * (best + margin)
    return GoalPolicy(
        grid=grid,
        costs=costs,
        taps=taps,
        mixture=mixture,
        tables=undisturbed_tables(model, goal, grid, taps, costs, mixture, radius),
        differs=differs,
        free=np.zeros((0, 0), np.bool_) if free is None else free,
        rationality=float(model.rationality),
    )


def admissible_actions(grid: CostGrid, free: BoolArray | None, horizon: int) -> Choices:
    """Return the choices of a person among walls who acts at random; empty if there are none."""
    radius = grid.reach * (horizon - 1)
    actions = (2 * grid.reach + 1) ** grid.dimension
    words = -(-actions // WORD)
    cells = 0 if free is None else (2 * radius + 1) ** grid.dimension
    masks = np.zeros((words, cells), np.int64)
    if free is not None:
        mark_admissible(free, grid.centre, grid.dimension, grid.reach, radius, masks)
    return Choices(np.full(horizon, radius), np.zeros(horizon, np.int64), words, masks, np.zeros((0, 0)))


def value_scratch(grid: CostGrid) -> ValueScratch:
    """Return arrays for sweeps on `grid`."""
    rows, columns = grid.shape
    plane = np.zeros((columns if grid.dimension == 3 else 0, columns), grid.dtype)
    even, odd = np.zeros((rows, columns), grid.dtype), np.zeros((rows, columns), grid.dtype)
    return ValueScratch(even, odd, plane, np.zeros((3, columns), grid.dtype))


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
    arrive = sweep(costs, lead, bool(awareness), taps, lattice.radius, grid.centre, d, *value_scratch(grid))
    return _first_actions(arrive, taps[0], lattice, reach, grid.centre)


def _first_actions(arrive: Values, taps: Values, lattice: Lattice, reach: int, centre: int) -> FloatArray:
    d = lattice.dimension
    cells = arrive.reshape((2 * centre + 1,) * d)
    first, last = centre - lattice.radius - reach, centre + lattice.radius + reach
    windows = sliding_window_view(
        cells[(slice(first, last + 1),) * d], (2 * reach + 1,) * d
    )  # what each action leads to
    effort = reduce(np.add.outer, taps[3 - d :])
    return (windows + effort).reshape(*lattice.shape, -1)


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
