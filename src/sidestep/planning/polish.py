"""Continuous refinement of a lattice path within what surrounds it: Eq. 9 as a few convex quadratic programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
import piqp

from sidestep._kernels.path_costs import half_instants
from sidestep._kernels.program import goal_model, half_planes, objective
from sidestep._kernels.search_corridor import corridor, soft_slope
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import SearchResult
from sidestep.planning.search_maps import SearchMaps
from sidestep.prediction.person_mass import embedded, embedded_point
from sidestep.types import FloatArray, Path

_FAR = 1e3  # m; walls farther away than this are as good as none


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PolishedPath:
    """A motion that costs no more than the one it was made from and respects the same limits.

    Attributes:
        path: (N+1, d) m; cost: the objective; risk: (2N,) at half instants 1..2N.
        rounds: programs whose result was kept.
    """

    path: Path
    cost: float
    risk: FloatArray
    rounds: int


def polish(problem: PlanningProblem, found: SearchResult, *, rounds: int = 2) -> PolishedPath:
    """Refine what the search found; where nothing better is admissible, that is what comes back.

    Args:
        problem: as given to the search.
        found: its result; what is not feasible is returned as it is.
        rounds: quadratic programs at most.
    """
    best = PolishedPath(path=found.path, cost=found.cost, risk=found.risk, rounds=0)
    if not found.feasible:
        return best
    for _ in range(rounds):
        target = _program(problem, best.path, found.maps, least_gain=1e-4 * abs(best.cost))
        better = None if target is None else _accepted(problem, best, target)
        if better is None:
            return best
        gain = best.cost - better.cost
        best = better
        if gain < 1e-3 * abs(best.cost):
            break
    return best


def _accepted(problem: PlanningProblem, best: PolishedPath, target: Path) -> PolishedPath | None:
    """The farthest of a few points on the way to `target` that is cheaper and admissible."""
    for part in (1.0, 0.5, 0.2):
        path = best.path + part * (target - best.path)
        risk = problem.risk_along(path)
        cost = problem.cost(path, risk)
        if cost < best.cost and problem.allows(path, risk):
            return PolishedPath(path=path, cost=cost, risk=risk, rounds=best.rounds + 1)
    return None


def _program(problem: PlanningProblem, path: Path, maps: SearchMaps, least_gain: float) -> Path | None:
    """Solve one convex program around `path`; None if the solver fails or the program itself promises too little."""
    d, spacing = path.shape[1], maps.spacing
    curvature, slope = _goal_model(problem, path)
    room, gradient = _surroundings(problem, path, maps)
    if gradient.size:
        slope = slope + gradient
    wished = path[0] if problem.wish is None else path[0] + problem.wish * problem.time_step
    per_move = 2.0 / problem.time_step**2
    hessian, linear = objective(
        path, curvature, slope, per_move * problem.effort_weights, wished, per_move * problem.wish_weight
    )
    length = problem.max_speed * problem.time_step
    slack = 2.0 * spacing * math.sqrt(d)
    columns, bounds = half_planes(path, room, _directions(d), 1.5 * spacing, length, problem.shape == "box", slack)
    low, high = _box(problem, path, spacing)
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-6
    solver.settings.max_iter = 40
    limits = (columns.T, None, bounds) if bounds.size else (None, None, None)
    solver.setup(hessian.T, linear, None, None, *limits, low, high)  # transposed: the solver wants columns first
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    now, moved = path[1:].ravel(), np.array(solver.result.x)
    gain = (now - moved) @ (0.5 * (hessian @ (now + moved)) + linear)
    if not gain > least_gain:
        return None
    return np.concatenate([path[:1], moved.reshape(-1, d)])


def _goal_model(problem: PlanningProblem, path: Path) -> tuple[FloatArray, FloatArray]:
    """Diagonal curvature and slope (N, d) of the goal costs at the steps; for distances a quadratic from above."""
    squared = problem.goal_cost == "squared"
    if problem.distance_to_goal is None:
        return goal_model(path, problem.goal, problem.goal_weights, squared, problem.terminal_weight)
    x, h = path[1:], 0.05
    scale = np.ones((len(x), 1))
    scale[-1] += problem.terminal_weight
    shifts = h * np.eye(x.shape[1])
    ahead = np.stack([problem.goal_costs(x + s) for s in shifts], axis=1)
    behind = np.stack([problem.goal_costs(x - s) for s in shifts], axis=1)
    away = np.maximum(problem.distance_to_goal.at(x), 1e-2)[:, None]
    weight = problem.goal_weights[0]
    bend = 2.0 * weight if squared else weight / away
    return np.broadcast_to(scale * bend, x.shape).copy(), scale * (ahead - behind) / (2 * h)


@lru_cache(maxsize=3)
def _directions(d: int) -> FloatArray:
    """(m, d) unit vectors along axes and diagonals."""
    vectors = np.array([v for v in product((-1.0, 0.0, 1.0), repeat=d) if any(v)])
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    vectors.setflags(write=False)
    return vectors


@lru_cache(maxsize=3)
def _rays(d: int) -> FloatArray:
    """(m, 3), the same among three axes."""
    rays = embedded(_directions(d))
    rays.setflags(write=False)
    return rays


def _surroundings(problem: PlanningProblem, path: Path, maps: SearchMaps) -> tuple[FloatArray, FloatArray]:
    """Room (2N, m) m until something forbidden is met, and the slope (N, d) of the soft risk; size 0: not any."""
    d = path.shape[1]
    places = half_instants(path)
    directions = _directions(d)
    room, gradient = np.zeros((0, len(directions))), np.zeros((0, d))
    if maps.rasters.some.any():
        room, gradient = _risk_surroundings(problem, places, maps)
    if problem.obstacles is not None:
        walls = _wall_room(problem, places[:, 3 - d :], directions, maps.spacing)
        room = np.minimum(room, walls) if len(room) else walls
    return room, gradient


def _risk_surroundings(problem: PlanningProblem, places: FloatArray, maps: SearchMaps) -> tuple[FloatArray, FloatArray]:
    """Room (2N, m) m until the risk passes the limit, and the slope (N, d) of the soft risk, from the rasters."""
    d = problem.dimension
    limit = 0.5 if problem.rule == "cells" else problem.risk_limit
    rasters = maps.rasters
    cells = (places - embedded_point(problem.start)) / maps.spacing
    room, slope, level = corridor(
        cells, _rays(d), 1.5, maps.active, rasters.values, rasters.starts, rasters.some, *rasters.boxes, float(limit)
    )
    share = problem.half_share / maps.spacing
    steep = share * problem.excess_weights
    gradient = soft_slope(slope, level, share * problem.soft_risk_weight, steep, float(limit), d)
    return room * maps.spacing, gradient


def _wall_room(problem: PlanningProblem, doubled: FloatArray, directions: FloatArray, spacing: float) -> FloatArray:
    """Room (2N, m) m until walls come too near, from the slope of the distance to them."""
    assert problem.obstacles is not None
    d = doubled.shape[1]
    h = 0.25 * spacing

    def away(points: FloatArray) -> FloatArray:
        assert problem.obstacles is not None
        return np.minimum(problem.obstacles.distance(points), _FAR)  # a map may hold no wall at all

    gap = away(doubled) - problem.margin
    slope = np.stack([(away(doubled + h * e) - away(doubled - h * e)) / (2 * h) for e in np.eye(d)], axis=1)
    closing = -(slope @ directions.T)
    room = np.where(closing > 0.5, np.maximum(gap, 0.0)[:, None] / np.maximum(closing, 0.5), np.inf)
    room[:2] = np.inf  # the first step is judged by itself
    return room


def _box(problem: PlanningProblem, path: Path, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Bounds of the trust region, with the first action's acceleration."""
    low, high = path[1:] - spacing, path[1:] + spacing
    if problem.velocity is not None and problem.largest_change < math.inf:
        change = problem.largest_change * problem.time_step / math.sqrt(path.shape[1])
        middle = path[0] + problem.velocity * problem.time_step
        low[0] = np.minimum(np.maximum(low[0], middle - change), path[1])
        high[0] = np.maximum(np.minimum(high[0], middle + change), path[1])
    return low.ravel(), high.ravel()
