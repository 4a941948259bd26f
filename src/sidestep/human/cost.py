"""Eq. 2a, term by term, in the lattice's own frame: goal, effort, danger."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._kernels.sweep import CostTables, Values
from sidestep._kernels.sweep_tables import danger_factors, danger_tables
from sidestep.errors import InvalidInput
from sidestep.human.goals import DirectionGoal, Goal, PointGoal
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice
from sidestep.types import BoolArray, FloatArray, IntArray


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
    dtype: np.dtype[np.float64] | np.dtype[np.float32] = np.dtype(np.float64)

    @property
    def dimension(self) -> int:
        """Number of real axes d."""
        return self.lattice.dimension

    @property
    def speed(self) -> float:
        """m/s, v: one cell per step."""
        return self.lattice.spacing / self.time_step

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns) of value arrays."""
        return row_shape(2 * self.centre + 1, self.dimension)


def row_shape(width: int, dimension: int) -> tuple[int, int]:
    """(rows, columns) of an array over a box of `width` cells per axis."""
    return width ** (dimension - 1), width


def per_axis(name: str, weight: float | tuple[float, ...], dimension: int) -> FloatArray:
    """One number or one per lattice axis → (d,)."""
    values = np.atleast_1d(np.asarray(weight, dtype=np.float64))
    if values.size not in (1, dimension):
        raise InvalidInput(f"human.{name}", weight, f"one number or {dimension}, one per axis")
    return np.broadcast_to(values, (dimension,)).astype(np.float64)


def danger_law(model: HumanModel) -> tuple[float, float]:
    """(weight, rate) of the expected danger under perception noise ε ~ N(0, σ²) on the distance; both decays stay of their form."""
    weight, rate, variance = model.danger_weight, model.danger_rate, model.perception_noise**2
    if model.danger_decay == "distance":
        return weight * math.exp(rate**2 * variance / 2), rate  # E exp(−θ4 (d+ε))
    widened = 1 + 2 * rate * variance
    return weight / math.sqrt(widened), rate / widened  # E exp(−θ4 (d+ε)²)


def action_costs(model: HumanModel, goal: Goal, grid: CostGrid) -> Values:
    """Cost of each component m·v of action j: (M, 3, T), T = 2·reach + 1.

    Effort θ2·(m·v)². A `DirectionGoal` adds its pull here. The stage cost −θ1·d̂·x (d̂ the unit direction), summed over the
    M − j instants that action j still acts on, is θ1·(M − j)·ΔT·d̂_a·(w_a − m·v) per axis up to a constant, w the intended
    velocity; we charge its magnitude. For a person at the fastest action straight along an axis that is the linear cost itself;
    for any other velocity it keeps the pull from ending in a corner of the box of actions: nobody gains by hurrying.
    """
    d, reach, steps = grid.dimension, grid.reach, grid.steps
    taps = np.zeros((steps, 3, 2 * reach + 1))
    multiples = np.arange(-reach, reach + 1)
    taps[:, 3 - d :] = per_axis("effort_weight", model.effort_weight, d)[:, None] * (multiples * grid.speed) ** 2
    if isinstance(goal, DirectionGoal):
        intended = intended_multiples(goal, grid)
        norm = float(np.linalg.norm(intended))
        if norm > 0:
            pull = per_axis("goal_weight", model.goal_weight, d) * np.abs(intended) / norm * grid.lattice.spacing
            remaining = np.arange(steps, 0, -1)[:, None, None]
            taps[:, 3 - d :] += remaining * pull[:, None] * np.abs(intended[:, None] - multiples)
    return taps.astype(grid.dtype)


def intended_multiples(goal: DirectionGoal, grid: CostGrid) -> FloatArray:
    """(d,) the goal's velocity in the lattice's frame, in units of v, within the actions."""
    local = goal.velocity @ grid.lattice.rotation
    return np.clip(local / grid.speed, -grid.reach, grid.reach)


def stage_costs(
    model: HumanModel,
    goal: Goal,
    grid: CostGrid,
    danger: tuple[Values, Values],
    free: BoolArray | None = None,
) -> CostTables:
    """Goal term of `goal` beside the `danger` of `danger_terms`; +inf where `free` (grid.shape) is False."""
    d, spacing, centre = grid.dimension, grid.lattice.spacing, grid.centre
    axes = np.zeros((3, 2 * centre + 1))
    table = np.zeros((0, 0))
    if isinstance(goal, PointGoal):
        weight = per_axis("goal_weight", model.goal_weight, d)
        to_goal = spacing * np.arange(-centre, centre + 1) - grid.lattice.to_local(goal.position)[:, None]
        if model.goal_cost == "squared":
            axes[3 - d :] = weight[:, None] * to_goal**2  # ‖x − g‖²_θ1
        else:
            table = np.sqrt(_outer_sum((weight[:, None] * to_goal) ** 2, grid))  # θ1 ‖x − g‖
    if free is not None:
        if table.size == 0:
            table = _outer_sum(axes[3 - d :], grid)
        table = np.where(free, table, np.inf)
    return CostTables(axes.astype(grid.dtype), table.astype(grid.dtype), danger[0], danger[1])


def _outer_sum(axes: FloatArray, grid: CostGrid) -> FloatArray:
    d = grid.dimension
    total = np.zeros((2 * grid.centre + 1,) * d)
    for a in range(d):
        shape = [1] * d
        shape[a] = -1
        total += axes[a].reshape(shape)
    return total.reshape(grid.shape)


def danger_terms(model: HumanModel, path: FloatArray, radii: IntArray, grid: CostGrid) -> tuple[Values, Values]:
    """Danger at every instant: (axes (3·T, C), table (T·rows, C)); the one that the decay does not need is minimal.

    Args:
        path: (T, 3) m, see `embedded_path`.
        radii: (T,) cells, the box that is ever read at each instant.
    """
    weight, rate = danger_law(model)
    width = 2 * grid.centre + 1
    if model.danger_decay == "squared_distance":
        axes = np.empty((3 * len(path), width), grid.dtype)
        danger_factors(path, grid.lattice.spacing, weight, rate, grid.centre, grid.dimension, axes)
        return axes, np.zeros((0, 0), grid.dtype)
    table = np.empty((len(path) * grid.shape[0], grid.shape[1]), grid.dtype)
    danger_tables(path, radii, grid.lattice.spacing, weight, rate, grid.centre, grid.dimension, table)
    return np.ones((3, 1), grid.dtype), table


def embedded_path(lattice: Lattice, robot_path: FloatArray) -> FloatArray:
    """World positions (T, d) m → (T, 3) m in the lattice's frame, 0 on the axes that only pad."""
    path = np.zeros((len(robot_path), 3))
    path[:, 3 - lattice.dimension :] = lattice.to_local(robot_path)
    return path


def danger_bounds(
    model: HumanModel, path: FloatArray, grid: CostGrid, horizon: int, lead: int
) -> tuple[IntArray, FloatArray]:
    """(radii (T,), bounds (horizon,)): cells that are read at each instant, and the most danger on any walk of policy k.

    Args:
        model: how the person decides.
        path: (T, 3) m, see `embedded_path`.
        grid: cells and stages.
        horizon: policies wanted.
        lead: 1 if the robot is anticipated, 0 if it is taken to stay where it is.
    """
    radii = np.minimum(grid.reach * (np.arange(len(path)) + 1 - lead), grid.centre)
    weight, rate = danger_law(model)
    gap = np.maximum(np.abs(path) - radii[:, None] * grid.lattice.spacing, 0.0)
    squared = np.einsum("ta,ta->t", gap, gap)
    most = weight * np.exp(-rate * (squared if model.danger_decay == "squared_distance" else np.sqrt(squared)))
    total = np.concatenate([[0.0], np.cumsum(most)])
    first = np.arange(horizon) + lead
    return radii, total[first + grid.steps] - total[first]
