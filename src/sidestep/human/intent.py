"""What a person with one goal makes of the cells and the actions, the robot aside."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._kernels.frames import local
from sidestep._kernels.sweep import Values
from sidestep._kernels.sweep_tables import axis_policies, slowing_policies
from sidestep.human.cost import TIE, ActionTerms, CostGrid, action_terms, goal_terms
from sidestep.human.goals import DirectionGoal, Goal, SlowingGoal, StandGoal
from sidestep.human.model import HumanModel
from sidestep.types import BoolArray, FloatArray

EVERYWHERE = np.zeros((0, 0), np.bool_)  # no walls
_NOTHING_USED = np.zeros(0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Intent:
    """One goal, laid out; whatever the robot does, it stays as it is.

    Attributes:
        goal: what the person is heading for.
        grid: cells and stages.
        actions: costs of actions.
        axes, table: goal term, see `CostTables`.
        tables: (3·T, 2·radius + 1) P_d of the undisturbed person per axis where it is separable; size 0 where it is
            not.
        used: (3·T,) 0 where a row of `tables` is all zero.
        negligible: danger on a whole walk that breaks no tie.
        layers: how often masks must hold all actions: twice where mixtures may lead into walls.
        free: grid.shape, or size 0.
        rationality: of Eq. 5.
    """

    goal: Goal
    grid: CostGrid
    actions: ActionTerms
    axes: Values
    table: Values
    tables: FloatArray
    used: FloatArray
    negligible: float
    layers: int
    free: BoolArray
    rationality: float

    @property
    def heedless(self) -> bool:
        """Whether whoever has this goal does not mind the robot."""
        return isinstance(self.goal, StandGoal | SlowingGoal)


def intent_of(model: HumanModel, goal: Goal, grid: CostGrid, free: BoolArray | None, radius: int) -> Intent:
    """Lay out one goal.

    Args:
        model: how the person decides.
        goal: what they are heading for.
        grid: cells and stages.
        free: grid.shape, or None.
        radius: cells a person can be in when they choose.
    """
    swept = goal.held(grid.steps * grid.time_step) if isinstance(goal, SlowingGoal) else goal
    actions = action_terms(model, swept, grid, 2 * radius + 1)
    axes, table = goal_terms(model, swept, grid, free)
    tables = _undisturbed_tables(model, goal, grid, actions, axes, table, radius)
    plain = free is None or bool(np.all(np.diagonal(actions.mixture, axis1=1, axis2=2) == 1.0))
    return Intent(
        goal=goal,
        grid=grid,
        actions=actions,
        axes=axes,
        table=table,
        tables=tables,
        used=tables.max(axis=1) if tables.size > 0 else _NOTHING_USED,
        negligible=_negligible(grid, actions, axes, table),
        layers=1 if plain else 2,
        free=EVERYWHERE if free is None else free,
        rationality=float(model.rationality),
    )


def _negligible(grid: CostGrid, actions: ActionTerms, axes: Values, table: Values) -> float:
    """Danger on a whole walk that breaks no tie: a tenth of the width of one, of what a person at the anchor pays."""
    rows, columns = grid.shape
    here = float(axes[:, grid.centre].sum()) if table.size == 0 else float(table[rows // 2, columns // 2])
    paid = actions.cheapest + (0.5 * here * grid.steps if math.isfinite(here) else 0.0)
    return max(0.1 * grid.tolerance * paid, 1e-12)


def _undisturbed_tables(
    model: HumanModel, goal: Goal, grid: CostGrid, actions: ActionTerms, axes: Values, table: Values, radius: int
) -> FloatArray:
    if isinstance(goal, StandGoal):
        tables = np.zeros_like(actions.tables)
        tables[grid.reach :: 2 * grid.reach + 1] = 1.0
        return tables
    if table.size > 0:
        return actions.tables[:0]
    if isinstance(goal, DirectionGoal):
        return actions.tables
    if isinstance(goal, SlowingGoal):
        tables = np.empty_like(actions.tables)
        pace = local(goal.velocity, np.zeros(grid.dimension), grid.lattice.rotation) / grid.speed
        slowing_policies(pace, goal.time / grid.time_step, radius, grid.reach, tables)
        return tables
    tables = np.zeros_like(actions.tables)
    axes, taps = axes.astype(np.float64, copy=False), actions.taps.astype(np.float64, copy=False)
    axis_policies(axes, taps, radius, grid.centre, grid.dimension, TIE, float(model.rationality), tables)
    return tables
