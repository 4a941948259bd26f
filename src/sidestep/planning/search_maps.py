"""What the search reads: the robot's own lattice with goal costs, walls and risk on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sidestep._kernels.search_maps import field_box, goal_box, wall_box
from sidestep.planning.problem import PlanningProblem
from sidestep.prediction.collision import RiskRasters
from sidestep.types import BoolArray, FloatArray, IntArray

BUDGET = {1: 2.5e7, 2: 2.5e7, 3: 5e6}
"""Additions and comparisons by dimension that a search may take where the resolution is not given; a few milliseconds.

In 3-D the risk map costs more than the search; one K less made polished plans 0.04 % dearer on average."""
FINEST = {1: 10, 2: 5, 3: 3}
"""Largest K by dimension. In 2-D single plans are hardly dearer with 4, but trips among five people take 16 % longer:
where risk stops the polish, a diagonal step of 4 cells keeps 79 % of the speed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchMaps:
    """What a search reads. Made once, searched often.

    Attributes:
        taps: (n, d) cells, the actions; the first is standing still; moves: (n, 3), the same among three axes.
        velocities: (n, d) m/s of them.
        spacing: m; radius: K, largest tap per axis; active: (3,) 1 where an axis exists, the last ones.
        stage, terminal: goal costs over the reachable box, among three axes, above their smallest value.
        blocked, blocked_halfway: walls, or empty.
        rasters: the risk.
    """

    taps: IntArray
    moves: IntArray
    velocities: FloatArray
    spacing: float
    radius: int
    active: IntArray
    stage: NDArray[np.float32]
    terminal: NDArray[np.float32]
    blocked: BoolArray
    blocked_halfway: BoolArray
    rasters: RiskRasters


def prepare(problem: PlanningProblem) -> SearchMaps:
    """Lay the lattice around the robot and put goal costs, walls and risk on it."""
    d = problem.dimension
    radius = problem.resolution or resolution(problem.horizon, d, problem.shape)
    spacing = problem.max_speed * problem.time_step / radius
    active = (np.arange(3) >= 3 - d).astype(np.int64)
    half = radius * problem.horizon * active
    stage = _goal_costs(problem, spacing, half)
    blocked = np.zeros((0, 1, 1), dtype=np.bool_)
    blocked_halfway = np.zeros((0, 1, 1, 1), dtype=np.bool_)
    if problem.obstacles is not None:
        blocked, blocked_halfway = _walls(problem, spacing, radius, active)
    taps = lattice_taps(radius, d, problem.shape)
    return SearchMaps(
        taps=taps,
        moves=_among_three_axes(radius, d, problem.shape),
        velocities=taps * np.float64(spacing / problem.time_step),
        spacing=spacing,
        radius=radius,
        active=active,
        stage=stage,
        terminal=np.float32(problem.terminal_weight) * stage,
        blocked=blocked,
        blocked_halfway=blocked_halfway,
        rasters=_rasters(problem, spacing, radius),
    )


def _goal_costs(problem: PlanningProblem, spacing: float, half: IntArray) -> NDArray[np.float32]:
    """Goal costs over the reachable box."""
    start = _embedded(problem.start)
    squared = problem.goal_cost == "squared"
    weight = problem.goal_weights
    field = problem.distance_to_goal
    if field is None:
        return goal_box(start, _embedded(problem.goal), _embedded(weight), squared, spacing, half)[0]
    return field_box(
        start, spacing, half, field.values, field.corner, field.spacing, field.goal, float(weight[0]), squared
    )[0]


def _rasters(problem: PlanningProblem, spacing: float, radius: int) -> RiskRasters:
    if problem.people is None or not problem.people.people:
        return RiskRasters.nobody(problem.horizon)
    limit = 0.5 if problem.rule == "cells" else problem.risk_limit
    return problem.people.rasters(problem.start, spacing, radius, limit)


def _walls(problem: PlanningProblem, spacing: float, radius: int, active: IntArray) -> tuple[BoolArray, BoolArray]:
    """Cells too near to a wall, and the same for the points halfway between them, split by parity.

    A corner may poke in between two samples half a step apart; the margin is widened by as much.
    """
    assert problem.obstacles is not None
    d = problem.dimension
    stride = 0.25 * problem.max_speed * problem.time_step * (math.sqrt(d) if problem.shape == "box" else 1.0)
    margin = math.hypot(problem.margin, stride)
    shapes = problem.obstacles.shapes
    start = _embedded(problem.start)
    half = (radius * (2 * problem.horizon - 1) + 1) // 2 * active
    boxes: list[BoolArray] = []
    for parity in range(2**d):
        shift = np.array([(parity >> (d - 1 - a)) & 1 for a in range(d)]) * (0.5 * spacing)
        boxes.append(wall_box(start + _embedded(shift), spacing, half, margin, *shapes))
    return wall_box(start, spacing, radius * problem.horizon * active, margin, *shapes), np.stack(boxes)


def _embedded(vector: FloatArray) -> FloatArray:
    """(d,) → (3,), the missing leading axes at 0."""
    out = np.zeros(3)
    out[3 - vector.size :] = vector
    return out


@lru_cache(maxsize=64)
def lattice_taps(radius: int, dimension: int, shape: str) -> IntArray:
    """Return the actions (n, d) in cells: all within the box or the disc of `radius`, short ones first."""
    axis = np.arange(-radius, radius + 1)
    taps = np.stack(np.meshgrid(*([axis] * dimension), indexing="ij"), axis=-1).reshape(-1, dimension)
    length = (taps * taps).sum(axis=1)
    if shape == "disc":
        taps, length = taps[length <= radius * radius], length[length <= radius * radius]
    taps = taps[np.argsort(length, kind="stable")]
    taps.setflags(write=False)
    return taps


@lru_cache(maxsize=64)
def _among_three_axes(radius: int, dimension: int, shape: str) -> IntArray:
    taps = lattice_taps(radius, dimension, shape)
    moves = np.zeros((len(taps), 3), dtype=np.int64)
    moves[:, 3 - dimension :] = taps
    moves.setflags(write=False)
    return moves


@lru_cache(maxsize=64)
def resolution(horizon: int, dimension: int, shape: str) -> int:
    """Return the largest K within `BUDGET` (at most `FINEST`, at least 2)."""
    for radius in range(FINEST[dimension], 2, -1):
        taps = len(lattice_taps(radius, dimension, shape))
        cells = sum((2 * radius * k + 1) ** dimension for k in range(horizon))
        if cells * taps <= BUDGET[dimension]:
            return radius
    return 2
