"""Eq. 2a, term by term, in the lattice's own frame: goal, effort, danger; and beyond the paper, other people."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sidestep._kernels.danger_sum import add_products
from sidestep._kernels.frames import local
from sidestep._kernels.sweep import Values, row_count
from sidestep._kernels.sweep_tables import (
    danger_tables,
    lay_out_actions,
    lay_out_danger,
    lay_out_distances,
    lay_out_squares,
    wall_off,
)
from sidestep.errors import InvalidInput
from sidestep.human.goals import DirectionGoal, Goal, PointGoal
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice
from sidestep.types import BoolArray, FloatArray, frozen_array

TIE = 1e-6
"""Relative; costs this close are tied (float64 values)."""
TIE_SINGLE = 2e-6
"""The same for float32 values, whose rounding over 50 stages reaches this size."""
_UNFELT = 1e-12
"""A whole walk past somebody that costs less than the absolute width of a tie changes nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CostGrid:
    """The cells and stages on which costs are laid out for the kernels (see `_kernels.sweep`).

    Attributes:
        lattice: anchor, spacing (m), rotation; its radius is not used.
        time_step: s, ΔT.
        reach: largest action in cells.
        steps: M ≥ 1, actions that a person looks ahead.
        centre: cells from the anchor to the edge of the value arrays.
        dtype: of values; masses are float64 always.
    """

    lattice: Lattice
    time_step: float
    reach: int
    steps: int
    centre: int
    dtype: type[np.float64] | type[np.float32] = np.float64

    @property
    def dimension(self) -> int:
        """Number of real axes d."""
        return self.lattice.dimension

    @property
    def speed(self) -> float:
        """m/s, v: one cell per step."""
        return self.lattice.spacing / self.time_step

    @property
    def tolerance(self) -> float:
        """Relative width of a tie."""
        return TIE if self.dtype == np.float64 else TIE_SINGLE

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns) of value arrays."""
        return row_shape(2 * self.centre + 1, self.dimension)


def row_shape(width: int, dimension: int) -> tuple[int, int]:
    """(rows, columns) of an array over a box of `width` cells per axis."""
    return width ** (dimension - 1), width


@lru_cache(maxsize=256)
def per_axis(name: str, weight: float | tuple[float, ...], dimension: int) -> FloatArray:
    """One number or one per axis → (d,), read-only; `name` is that of the field, for the message."""
    given = weight if isinstance(weight, tuple) else (weight,)
    if len(given) not in (1, dimension):
        raise InvalidInput(name, weight, f"one number or {dimension}, one per axis")
    return frozen_array(given * (dimension // len(given)))


def danger_law(model: HumanModel) -> tuple[float, float]:
    """(weight, rate) of the expected danger under perception noise ε ~ N(0, σ²) on the distance; its form stays."""
    weight, rate, variance = model.danger_weight, model.danger_rate, model.perception_noise**2
    if model.danger_decay == "distance":
        return weight * math.exp(rate**2 * variance / 2), rate  # E exp(−θ4 (d+ε))
    widened = 1 + 2 * rate * variance
    return weight / math.sqrt(widened), rate / widened  # E exp(−θ4 (d+ε)²)


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionTerms:
    """Cost of actions, and what follows from it alone.

    Attributes:
        taps: (M, 3, T) cost of each component m·v of action j, T = 2·reach + 1; grid's dtype.
        mixture: (3, T, T) what a chosen component stands for (identity but for a `DirectionGoal`, see `human.policy`).
        tables: (3·T, C) for a `DirectionGoal`, P_d per axis where nothing is in the way; else meaningless.
        margin: how much the best components of a `DirectionGoal` are better than any other; 0 if they are not unique.
        cheapest: cost of the M cheapest actions.
    """

    taps: Values
    mixture: FloatArray
    tables: FloatArray
    margin: float
    cheapest: float


def action_terms(model: HumanModel, goal: Goal, grid: CostGrid, width: int) -> ActionTerms:
    """Lay out the costs of actions: effort θ2·(m·v)² per component; `tables` get `width` columns.

    A `DirectionGoal` adds its pull here. The stage cost −θ1·d̂·x (d̂ the unit direction), summed over the M − j
    instants that action j still acts on, is θ1·(M − j)·ΔT·d̂_a·(w_a − m·v) per axis up to a constant, w the intended
    velocity; we charge its magnitude. For a person at the fastest action straight along an axis that is the linear
    cost itself; for any other velocity it keeps the pull from ending in a corner of the box of actions: nobody gains by
    hurrying.
    """
    d, reach = grid.dimension, grid.reach
    count = 2 * reach + 1
    direction = isinstance(goal, DirectionGoal)
    intended, pull = np.zeros(d), np.zeros(d)
    if direction:
        along = local(goal.velocity, np.zeros(d), grid.lattice.rotation)
        intended = np.minimum(np.maximum(along / grid.speed, -reach), reach)
        norm = math.sqrt(sum(x * x for x in intended.tolist()))
        if norm > 0:
            weight = per_axis("human.goal_weight", model.goal_weight, d)
            pull = np.abs(intended) * weight * (grid.lattice.spacing / norm)
    taps = np.empty((grid.steps, 3, count))
    mixture, tables = np.empty((3, count, count)), np.empty((3 * count, width))
    margin, cheapest = lay_out_actions(
        per_axis("human.effort_weight", model.effort_weight, d), pull, intended, grid.speed,
        direction and math.isinf(model.rationality), float(model.rationality), grid.tolerance, taps, mixture, tables,
    )  # fmt: skip
    return ActionTerms(
        taps=taps.astype(grid.dtype, copy=False), mixture=mixture, tables=tables, margin=margin, cheapest=cheapest
    )


def goal_terms(model: HumanModel, goal: Goal, grid: CostGrid, free: BoolArray | None = None) -> tuple[Values, Values]:
    """Goal term (axes (3, C), table (rows, C) or of size 0) of Eq. 2a; +inf where `free` (grid.shape) is False."""
    d, spacing, centre = grid.dimension, grid.lattice.spacing, grid.centre
    axes = np.zeros((3, 2 * centre + 1))
    table = np.zeros((0, 0))
    if isinstance(goal, PointGoal):
        weight = per_axis("human.goal_weight", model.goal_weight, d)
        to_goal = local(goal.position, grid.lattice.origin, grid.lattice.rotation)
        if model.goal_cost == "squared":
            lay_out_squares(to_goal, weight, spacing, centre, axes)  # ‖x − g‖²_θ1
        else:
            table = np.empty(grid.shape)
            lay_out_distances(to_goal, weight, spacing, centre, d, table)  # θ1 ‖x − g‖
    if free is not None:
        summed = table.size == 0
        table = np.empty(grid.shape) if summed else table
        wall_off(free, axes, summed, row_count(centre, d), table)
    return axes.astype(grid.dtype, copy=False), table.astype(grid.dtype, copy=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class DangerTerms:
    """Danger at every instant of the robot's path; the form that the decay does not need is minimal.

    Attributes:
        path: (T, 3) m, the robot in the lattice's frame, 0 on the axes that only pad.
        bounds: (N,) most danger on any walk of policy k.
        axes: (3·T, C), see `CostTables`.
        table: (T·rows, C).
    """

    path: FloatArray
    bounds: FloatArray
    axes: Values
    table: Values


def danger_terms(
    model: HumanModel,
    world: FloatArray,
    grid: CostGrid,
    horizon: int,
    lead: int,
    radius: int = 0,
    others: FloatArray | None = None,
) -> DangerTerms:
    """Lay out the danger term of Eq. 2a, and where the model says so the same for other people (β = 1 minds both).

    Args:
        model: how the person decides.
        world: (T, d) m, the robot, instant 0 first; no more positions than policies read.
        grid: cells and stages.
        horizon: N, policies.
        lead: 1 if the robot is anticipated, 0 if it is taken to stay where it is.
        radius: cells a person can be in at instant 0.
        others: (P, T, d) m, the other people at the same instants, or None.
    """
    squared = model.danger_decay == "squared_distance"
    robot = _decaying(danger_law(model), squared, world, grid, horizon, lead, radius)
    if others is None or model.repulsion_weight == 0:
        return robot
    law = model.repulsion_weight, model.repulsion_rate
    crowd = [_decaying(law, squared, np.ascontiguousarray(p), grid, horizon, lead, radius) for p in others]
    crowd = [terms for terms in crowd if terms.bounds.max() > _UNFELT]
    if not crowd:
        return robot
    table = np.zeros((len(world) * grid.shape[0], grid.shape[1]), grid.dtype)
    for terms in (robot, *crowd):
        if terms.table.size > 0:
            table += terms.table
        else:
            add_products(terms.axes, grid.dimension, table)
    return DangerTerms(
        path=robot.path,
        bounds=robot.bounds + np.sum([terms.bounds for terms in crowd], axis=0),
        axes=np.ones((3, 1), grid.dtype),
        table=table,
    )


def _decaying(
    law: tuple[float, float], squared: bool, world: FloatArray, grid: CostGrid, horizon: int, lead: int, radius: int
) -> DangerTerms:
    """Danger of one body that moves along `world` (T, d) m, by its (weight, rate)."""
    weight, rate = law
    lattice = grid.lattice
    path, bounds = np.empty((len(world), 3)), np.empty(horizon)
    axes = np.empty((3 * len(world), 2 * grid.centre + 1), grid.dtype) if squared else np.ones((3, 1), grid.dtype)
    lay_out_danger(
        world, lattice.origin, lattice.rotation, lattice.spacing, weight, rate, squared, grid.centre, grid.reach,
        grid.steps, lead, path, bounds, axes,
    )  # fmt: skip
    table = np.zeros((0 if squared else len(world) * grid.shape[0], grid.shape[1]), grid.dtype)
    if not squared:
        danger_tables(path, radius, grid.reach, lead, lattice.spacing, weight, rate, grid.centre, grid.dimension, table)
    return DangerTerms(path=path, bounds=bounds, axes=axes, table=table)
