"""Global search: the exact minimum of Eq. 9 over the robot's own lattice, by backward induction."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sidestep._kernels.search import solve
from sidestep.planning.problem import PlanningProblem, respects
from sidestep.prediction.collision import RiskField, RiskRasters
from sidestep.types import FloatArray, IntArray, Path

BUDGET = 6e7
"""Additions and comparisons that a search may take where the resolution is not given; about 20 ms."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchMaps:
    """What a search reads: the robot's lattice and the costs on it. Made once, searched often.

    Attributes:
        taps: (n, d) cells, the actions; the first is standing still.
        spacing: m; radius: K, largest tap per axis.
        stage, terminal: goal costs over the reachable box, embedded among three axes.
        blocked, blocked_halfway: walls, or empty.
        rasters: the risk.
    """

    taps: IntArray
    spacing: float
    radius: int
    stage: NDArray[np.float32]
    terminal: NDArray[np.float32]
    offset: float
    blocked: NDArray[np.bool_]
    blocked_halfway: NDArray[np.bool_]
    rasters: RiskRasters


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchResult:
    """The best motion on the lattice.

    Attributes:
        path: (N+1, d) m; standing still where nothing is admissible.
        feasible: a motion that respects every limit on the lattice exists.
        cost: of the path, as `PlanningProblem.cost` counts it (inf when not feasible).
        risk: (2N,) along the path, exact, half instants 1..2N.
        maps: what was searched, for another search of the same problem (graded, other weights).
    """

    path: Path
    feasible: bool
    cost: float
    risk: FloatArray
    maps: SearchMaps


def search(problem: PlanningProblem, maps: SearchMaps | None = None) -> SearchResult:
    """Find the cheapest admissible sequence of lattice actions; never raises for want of one.

    The risk on the lattice is a raster; the path found is judged by the exact risk, and where the two differ by so much
    that the limit is passed, the search is repeated with a smaller limit.
    """
    if maps is None:
        maps = prepare(problem)
    if problem.rule == "trajectory" and not problem.graded:
        return _within_total(problem, maps)
    limit = 0.5 if problem.rule == "cells" else problem.risk_limit
    result = _solve(problem, maps, limit, problem.soft_risk_weight)
    for _ in range(2):
        worst = float(result.risk.max(initial=0.0))
        if problem.graded or not result.feasible or respects(result.risk, problem.rule, problem.risk_limit):
            return result
        limit *= min(0.8, limit / worst)
        result = _solve(problem, maps, limit, problem.soft_risk_weight)
    if not respects(result.risk, problem.rule, problem.risk_limit):
        return replace(result, feasible=False, cost=math.inf)
    return result


def _within_total(problem: PlanningProblem, maps: SearchMaps) -> SearchResult:
    """Rule `trajectory`: raise the price of risk until its sum fits, then lower it as far as that holds."""
    low, price = 0.0, problem.soft_risk_weight
    best = _solve(problem, maps, problem.risk_limit, price)
    if not best.feasible or respects(best.risk, "trajectory", problem.risk_limit):
        return best
    found: SearchResult | None = None
    high = math.inf
    step = max(float(maps.stage.max()), 1e-6)
    for _ in range(14):
        price = low + step if found is None else 0.5 * (low + high)
        trial = _solve(problem, maps, problem.risk_limit, price)
        if trial.feasible and respects(trial.risk, "trajectory", problem.risk_limit):
            if found is None or trial.cost <= found.cost:
                found = trial
            high = price
        else:
            low = price
            step *= 4.0
    return found if found is not None else replace(best, feasible=False, cost=math.inf)


def _solve(problem: PlanningProblem, maps: SearchMaps, limit: float, weight: float) -> SearchResult:
    """One backward induction and the exact evaluation of what it found."""
    halves = problem.people is not None and problem.people.has_midway
    steep = problem.steep_risk_weight if problem.graded else math.inf
    velocities = maps.taps * (maps.spacing / problem.time_step)
    taps = np.zeros((len(maps.taps), 3), dtype=np.int64)
    taps[:, 3 - problem.dimension :] = maps.taps
    share = 0.5 if halves else 1.0
    total, chosen = solve(
        problem.horizon,
        maps.radius,
        (np.arange(3) >= 3 - problem.dimension).astype(np.int64),
        taps,
        problem.effort_costs(velocities).astype(np.float32),
        _first_costs(problem, velocities),
        maps.stage,
        maps.terminal,
        maps.blocked,
        maps.blocked_halfway,
        maps.rasters.values,
        maps.rasters.starts,
        maps.rasters.some,
        (share * weight, share * weight),
        limit * (1 + 1e-6) + 1e-9,
        share * steep,
        problem.standing_share,
    )
    feasible = bool(np.isfinite(total))
    moves = maps.taps[chosen] if feasible else np.zeros((problem.horizon, problem.dimension), dtype=np.int64)
    places = np.concatenate([np.zeros((1, problem.dimension), dtype=np.int64), np.cumsum(moves, axis=0)])
    path = problem.start + maps.spacing * places
    risk = problem.risk_along(path)
    cost = problem.cost(path, risk) if feasible else math.inf
    return SearchResult(path=path, feasible=feasible, cost=cost, risk=risk, maps=maps)


def _first_costs(problem: PlanningProblem, velocities: FloatArray) -> NDArray[np.float32]:
    """What each tap costs at the first step; where acceleration leaves no tap, the one nearest to what it leaves."""
    costs = problem.first_step_costs(velocities) + problem.wish_costs(velocities)
    if problem.velocity is not None and problem.largest_change < math.inf and not np.isfinite(costs).any():
        free = replace(problem, max_acceleration=None).first_step_costs(velocities) + problem.wish_costs(velocities)
        change = np.where(np.isfinite(free), np.square(velocities - problem.velocity).sum(axis=1), np.inf)
        nearest = int(change.argmin())
        costs[nearest] = free[nearest]
    return costs.astype(np.float32)


def prepare(problem: PlanningProblem) -> SearchMaps:
    """Lay the lattice around the robot and put goal costs, walls and risk on it."""
    radius = problem.resolution or resolution(problem.horizon, problem.dimension, problem.shape)
    spacing = problem.max_speed * problem.time_step / radius
    taps = lattice_taps(radius, problem.dimension, problem.shape)
    reach = radius * problem.horizon
    places = _box(problem.start, spacing, reach)
    stage = problem.goal_costs(places)
    offset = float(stage.min())
    blocked = np.zeros((0, 1, 1), dtype=np.bool_)
    blocked_halfway = np.zeros((0, 1, 1, 1), dtype=np.bool_)
    shape = (1,) * (3 - problem.dimension) + (2 * reach + 1,) * problem.dimension
    if problem.obstacles is not None:
        blocked, blocked_halfway = _walls(problem, places, spacing, radius, shape)
    costs = (stage - offset).astype(np.float32).reshape(shape)
    return SearchMaps(
        taps=taps,
        spacing=spacing,
        radius=radius,
        stage=costs,
        terminal=np.float32(problem.terminal_weight) * costs,
        offset=offset,
        blocked=blocked,
        blocked_halfway=blocked_halfway,
        rasters=_rasters(problem.people, problem, spacing, radius),
    )


def _rasters(people: RiskField | None, problem: PlanningProblem, spacing: float, radius: int) -> RiskRasters:
    if people is None or not people.people:
        return RiskRasters.nobody(problem.horizon)
    return people.rasters(problem.start, spacing, radius, 0.5 if problem.rule == "cells" else problem.risk_limit)


def _walls(
    problem: PlanningProblem, places: FloatArray, spacing: float, radius: int, shape: tuple[int, ...]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Cells too near to a wall, and the same for the points halfway between them, split by parity.

    A corner may poke in between two samples half a step apart; the margin is widened by as much.
    """
    assert problem.obstacles is not None
    d = problem.dimension
    stride = 0.25 * problem.max_speed * problem.time_step * (math.sqrt(d) if problem.shape == "box" else 1.0)
    margin = math.hypot(problem.margin, stride)
    blocked = ~problem.obstacles.free(places, margin)
    half = (radius * (2 * problem.horizon - 1) + 1) // 2
    boxes: list[NDArray[np.bool_]] = []
    for parity in range(2**d):
        shift = np.array([(parity >> (d - 1 - a)) & 1 for a in range(d)]) * (0.5 * spacing)
        boxes.append(~problem.obstacles.free(_box(problem.start + shift, spacing, half), margin))
    inner = (1,) * (3 - d) + (2 * half + 1,) * d
    return blocked.reshape(shape), np.stack(boxes).reshape(2**d, *inner)


def _box(origin: FloatArray, spacing: float, radius: int) -> FloatArray:
    """All places of a box of the robot's lattice, (cells, d) m, last axis fastest."""
    axis = spacing * np.arange(-radius, radius + 1)
    return np.stack(np.meshgrid(*([axis] * origin.size), indexing="ij"), axis=-1).reshape(-1, origin.size) + origin


def lattice_taps(radius: int, dimension: int, shape: str) -> IntArray:
    """Return the actions (n, d) in cells: all within the box or the disc of `radius`, short ones first."""
    axis = np.arange(-radius, radius + 1)
    taps = np.stack(np.meshgrid(*([axis] * dimension), indexing="ij"), axis=-1).reshape(-1, dimension)
    length = (taps * taps).sum(axis=1)
    if shape == "disc":
        taps, length = taps[length <= radius * radius], length[length <= radius * radius]
    return taps[np.argsort(length, kind="stable")]


def resolution(horizon: int, dimension: int, shape: str) -> int:
    """Return the largest K within `BUDGET` (at most 5 in the plane, 3 in space, 10 on a line; at least 2)."""
    top = {1: 10, 2: 5, 3: 3}[dimension]
    for radius in range(top, 2, -1):
        taps = len(lattice_taps(radius, dimension, shape))
        cells = sum((2 * radius * k + 1) ** dimension for k in range(horizon))
        if cells * taps <= BUDGET:
            return radius
    return 2
