"""What the search reads: the robot's own lattice with goal costs, walls and risk on it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sidestep._kernels.risk_sweep import forbid_changes
from sidestep._kernels.search_maps import field_box, goal_box, range_around, wall_box
from sidestep._kernels.search_tube import costs_to_go, tube
from sidestep.planning.problem import PlanningProblem
from sidestep.prediction.collision import Boxes, RiskRasters
from sidestep.prediction.person_mass import active_axes, embedded_point
from sidestep.types import BoolArray, FloatArray, IntArray

BUDGET = {1: 2.5e7, 2: 2.5e7, 3: 5e6}
"""Additions and comparisons by dimension that a search may take where the resolution is not given; a few milliseconds.

In 3-D the risk map costs more than the search; one K less made polished plans 0.04 % dearer on average."""
FINEST = {1: 10, 2: 5, 3: 3}
"""Largest K by dimension. In 2-D single plans are hardly dearer with 4, but trips among five people take 16 % longer:
where risk stops the polish, a diagonal step of 4 cells keeps 79 % of the speed."""
_NO_WALLS = np.zeros((0, 1, 1), dtype=np.bool_), np.zeros((0, 1, 1, 1), dtype=np.bool_)
AROUND = 3
"""Cells around what is searched that the risk is drawn for too: as far as the polish looks around its path."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotLattice:
    """The robot's own lattice: cells around where it is, and the actions that lead from one to another.

    Attributes:
        spacing: m; radius: K, largest tap per axis; active: (3,) 1 where an axis exists, the last ones.
        taps: (n, d) cells, the actions; the first is standing still; moves: (n, 3), the same among three axes.
        pace: m/s of one cell per step; velocities: (n, d) m/s of the taps; effort: (n,) their cost ‖u‖²_θ6.
    """

    spacing: float
    radius: int
    active: IntArray
    taps: IntArray
    moves: IntArray
    pace: float
    velocities: FloatArray
    effort: NDArray[np.float32]


@lru_cache(maxsize=64)
def robot_lattice(
    radius: int,
    dimension: int,
    shape: str,
    max_speed: float,
    time_step: float,
    effort_weight: float | tuple[float, ...],
) -> RobotLattice:
    """Return the lattice on which `max_speed` (m/s) along an axis is `radius` cells per step of `time_step` s."""
    taps, spacing = lattice_taps(radius, dimension, shape), max_speed * time_step / radius
    moves = np.zeros((len(taps), 3), dtype=np.int64)
    moves[:, 3 - dimension :] = taps
    moves.setflags(write=False)
    pace = spacing / time_step
    velocities = taps * np.float64(pace)
    return RobotLattice(
        spacing=spacing,
        radius=radius,
        active=active_axes(dimension),
        taps=taps,
        moves=moves,
        pace=pace,
        velocities=velocities,
        effort=(velocities * velocities * effort_weight).sum(axis=-1).astype(np.float32),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchMaps:
    """What a search reads. Made once, searched often.

    Attributes:
        lattice: cells and actions.
        stage, terminal: goal costs over the reachable box, among three axes, above their smallest value.
        blocked, blocked_halfway: walls, or empty.
        first: (n,) further cost of each tap at the first step.
        to_go: what is paid at least from each step on, without risk, as `costs_to_go` returns it.
        slack: by how much a motion that is looked at may cost more than the cheapest without risk.
        least: cost of that one.
        boxes: cells that are looked at, at steps 0..N: (N+1, 3) lowest ones and (N+1, 3) how many.
        rasters: the risk over them, between them and close around.
    """

    lattice: RobotLattice
    stage: NDArray[np.float32]
    terminal: NDArray[np.float32]
    blocked: BoolArray
    blocked_halfway: BoolArray
    first: NDArray[np.float32]
    to_go: tuple[NDArray[np.float32], IntArray]
    slack: float
    least: float
    boxes: Boxes
    rasters: RiskRasters

    @property
    def spacing(self) -> float:
        """Metres between cells."""
        return self.lattice.spacing


def prepare(problem: PlanningProblem, slack: float = 0.0) -> SearchMaps:
    """Lay the lattice around the robot and put goal costs, walls and risk on it; look at least as far as `slack`."""
    d, horizon = problem.dimension, problem.horizon
    radius = resolution(horizon, d, problem.shape, problem.resolution)
    lattice = robot_lattice(radius, d, problem.shape, problem.max_speed, problem.time_step, problem.effort_weight)
    stage = _goal_costs(problem, lattice.spacing, _reach(radius, horizon, d))
    blocked, blocked_halfway = _NO_WALLS if problem.obstacles is None else _walls(problem, lattice)
    terminal = np.float32(problem.terminal_weight) * stage
    first = _first_costs(problem, lattice)
    to_go = costs_to_go(horizon, radius, lattice.active, lattice.moves, lattice.effort, stage, terminal, blocked)
    slack = max(first_slack(problem, stage, radius), slack)
    least, boxes, rasters = _look(problem, lattice, first, stage, blocked, to_go, slack)
    return SearchMaps(
        lattice=lattice,
        stage=stage,
        terminal=terminal,
        blocked=blocked,
        blocked_halfway=blocked_halfway,
        first=first,
        to_go=to_go,
        slack=slack,
        least=least,
        boxes=boxes,
        rasters=rasters,
    )


def again(problem: PlanningProblem, maps: SearchMaps) -> SearchMaps:
    """The maps of another problem for one that differs in nothing but what risk costs, or the first step."""
    first = _first_costs(problem, maps.lattice)
    if np.array_equal(first, maps.first):
        return maps
    return within(problem, replace(maps, first=first), maps.slack)


def first_slack(problem: PlanningProblem, stage: NDArray[np.float32], radius: int) -> float:
    """By how much the first look goes beyond the cheapest motion: what it costs to lose a fifth of all steps.

    Where somebody is in the way, that is about what getting past costs; where it is too little, more is looked at. Each
    look draws everybody; among many people it is better to look farther at once.
    """
    people = 1 if problem.people is None else max(len(problem.people.people), 1)
    return 0.05 * (1 + people) * problem.horizon * range_around(stage, radius)


def within(problem: PlanningProblem, maps: SearchMaps, slack: float) -> SearchMaps:
    """The same, looking at motions that cost up to `slack` more than the cheapest without risk."""
    least, boxes, rasters = _look(problem, maps.lattice, maps.first, maps.stage, maps.blocked, maps.to_go, slack)
    return replace(maps, slack=slack, least=least, boxes=boxes, rasters=rasters)


def _look(
    problem: PlanningProblem,
    lattice: RobotLattice,
    first: NDArray[np.float32],
    stage: NDArray[np.float32],
    blocked: BoolArray,
    to_go: tuple[NDArray[np.float32], IntArray],
    slack: float,
) -> tuple[float, Boxes, RiskRasters]:
    """The cost of the cheapest motion without risk, the cells within `slack` of it, and the risk there."""
    least, low, size, *risky = tube(
        problem.horizon, lattice.radius, lattice.active, lattice.moves, lattice.effort, first, stage, blocked, *to_go,
        slack, AROUND,
    )  # fmt: skip
    around = risky[0], risky[1]
    if problem.people is None or not problem.people.people:
        return least, (low, size), RiskRasters.nobody(around)
    return least, (low, size), problem.people.rasters(problem.start, lattice.spacing, around, problem.instant_limit)


def _first_costs(problem: PlanningProblem, lattice: RobotLattice) -> NDArray[np.float32]:
    """What each tap costs at the first step.

    Where cells are coarse, acceleration may leave no tap but the present one, if any. Neighbours of what the base does
    now may be begun all the same, as far as it can (see `PlanningProblem.begun`); that part is what is judged.
    """
    begun = problem.begun(lattice.velocities)
    costs = problem.first_step_costs(begun)
    if problem.preferred is not None:
        costs += problem.preference_costs(begun)
    if problem.may_overshoot:
        costs += problem.overshoot_costs(begun)
    if problem.inertia is not None:
        most = max(problem.largest_change, lattice.pace * math.sqrt(problem.dimension))
        forbid_changes(lattice.velocities, problem.inertia.velocity, most, costs)
    return costs.astype(np.float32)


def _goal_costs(problem: PlanningProblem, spacing: float, half: IntArray) -> NDArray[np.float32]:
    """Goal costs over the reachable box."""
    squared = problem.goal_cost == "squared"
    weight = problem.goal_weights
    field = problem.distance_to_goal
    if field is None:
        return goal_box(problem.start, problem.goal, weight, squared, spacing, half)[0]
    origin = embedded_point(problem.start)
    raster = field.values, field.corner, field.spacing, field.goal[:2]
    if problem.dimension == 2:
        return field_box(origin, spacing, half, *raster, float(weight[0]), squared)[0]
    plane, least = field_box(origin, spacing, half * np.array([1, 1, 0]), *raster, 1.0, False)
    climb = origin[2] + spacing * np.arange(-half[2], half[2] + 1) - field.goal[2]
    square = (plane.astype(np.float64) + least) ** 2 + climb**2
    costs = weight[0] * (square if squared else np.sqrt(square))
    return (costs - costs.min()).astype(np.float32)


def _walls(problem: PlanningProblem, lattice: RobotLattice) -> tuple[BoolArray, BoolArray]:
    """Cells too near to a wall, and the same for the points halfway between them, split by parity."""
    d, spacing, radius, active = problem.dimension, lattice.spacing, lattice.radius, lattice.active
    slow = problem.inertia is not None or problem.room + spacing * radius < problem.lattice_margin
    start = embedded_point(problem.start)
    half = (radius * (2 * problem.horizon - 1) + 1) // 2 * active
    boxes: list[BoolArray] = []
    for parity in range(2**d):
        shift = np.array([(parity >> (d - 1 - a)) & 1 for a in range(d)]) * (0.5 * spacing)
        boxes.append(_walled(problem, start + embedded_point(shift), spacing, half, slow))
    return _walled(problem, start, spacing, radius * problem.horizon * active, slow), np.stack(boxes)


def _walled(problem: PlanningProblem, middle: FloatArray, spacing: float, half: IntArray, slow: bool) -> BoolArray:
    """Cells of a box that are too near to a wall.

    Who is slow, as a base of limited acceleration, or one with two wheels that faces a wall, does not get out of what
    is too near in one step: it may go on to be as near as it is. Who is inside a wall may go on to be so on the way out
    of it only: other walls are there all the same.
    """
    assert problem.obstacles is not None
    margin, room, shapes = problem.lattice_margin, problem.room, problem.obstacles.shapes
    if slow and room >= 0.0:
        margin = min(margin, room)
    out = wall_box(middle, spacing, half, margin, *shapes)
    if slow and room < 0.0:
        inner = np.minimum(half, math.ceil((margin - room) / spacing))
        part = tuple(slice(h - n, h + n + 1) for h, n in zip(half.tolist(), inner.tolist(), strict=True))
        out[part] = wall_box(middle, spacing, inner, room, *shapes)
    return out


@lru_cache(maxsize=64)
def _reach(radius: int, horizon: int, dimension: int) -> IntArray:
    """(3,) cells from the robot to the faces of the box that it can reach."""
    half = radius * horizon * active_axes(dimension)
    half.setflags(write=False)
    return half


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
def resolution(horizon: int, dimension: int, shape: str, asked: int | None = None) -> int:
    """Return K as `asked`, or the largest one within `BUDGET` (at most `FINEST`, at least 2)."""
    if asked is not None:
        return asked
    for radius in range(FINEST[dimension], 2, -1):
        taps = len(lattice_taps(radius, dimension, shape))
        cells = sum((2 * radius * k + 1) ** dimension for k in range(horizon))
        if cells * taps <= BUDGET[dimension]:
            return radius
    return 2
