"""Continuous refinement of a lattice path within what surrounds it: Eq. 9 as a few convex quadratic programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
import piqp

from sidestep._kernels.search_corridor import corridor
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import SearchResult
from sidestep.planning.search_maps import SearchMaps
from sidestep.types import FloatArray, Path

CHORDS = 4
"""Half-planes per step that stand for the speed disc, around the present direction."""
CHORD_ANGLE = 0.35
"""rad that each of them spans; the speed lost between two is 1.5 %."""
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
    steps, d = len(path) - 1, path.shape[1]
    curvature, slope = _goal_model(problem, path)
    effort = 2.0 / problem.time_step**2 * np.broadcast_to(np.asarray(problem.effort_weight, dtype=np.float64), d)
    hessian, pull = _motion_terms(steps, d)
    P = hessian * np.tile(effort, steps)
    P[np.diag_indices(steps * d)] += curvature.ravel() + 1e-9
    c = slope - curvature * path[1:]
    c[0] -= pull * effort * path[0]
    if problem.wish is not None:
        bend = 2.0 * problem.wish_weight / problem.time_step**2
        P[np.arange(d), np.arange(d)] += bend
        c[0] -= bend * (path[0] + problem.wish * problem.time_step)
    rows, bounds, gradient = _surroundings(problem, path, maps)
    c += gradient
    speed_rows, speed_bounds = _speed_rows(problem, path, maps.spacing)
    rows, bounds = np.concatenate([rows, speed_rows]), np.concatenate([bounds, speed_bounds])
    low, high = _box(problem, path, maps.spacing)
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-6
    solver.settings.max_iter = 40
    if len(rows):
        solver.setup(np.asfortranarray(P), c.ravel(), None, None, np.asfortranarray(rows), None, bounds, low, high)
    else:
        solver.setup(np.asfortranarray(P), c.ravel(), None, None, None, None, None, low, high)
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    now, moved = path[1:].ravel(), np.array(solver.result.x)
    gain = (now - moved) @ (0.5 * (P @ (now + moved)) + c.ravel())
    if not gain > least_gain:
        return None
    return np.concatenate([path[:1], moved.reshape(steps, d)])


def _goal_model(problem: PlanningProblem, path: Path) -> tuple[FloatArray, FloatArray]:
    """Diagonal curvature and slope (N, d) of the goal costs at the steps; for distances a quadratic from above."""
    x = path[1:]
    scale = np.ones((len(x), 1))
    scale[-1] += problem.terminal_weight
    weight = np.broadcast_to(np.asarray(problem.goal_weight, dtype=np.float64), x.shape[1])
    if problem.distance_to_goal is not None:
        h = 0.05
        shifts = h * np.eye(x.shape[1])
        ahead = np.stack([problem.goal_costs(x + s) for s in shifts], axis=1)
        behind = np.stack([problem.goal_costs(x - s) for s in shifts], axis=1)
        away = np.maximum(problem.distance_to_goal.at(x), 1e-2)[:, None]
        bend = 2.0 * weight[0] if problem.goal_cost == "squared" else weight[0] / away
        return np.broadcast_to(scale * bend, x.shape).copy(), scale * (ahead - behind) / (2 * h)
    apart = x - problem.goal
    curvature: FloatArray
    if problem.goal_cost == "squared":
        curvature = np.broadcast_to(2.0 * weight, x.shape) * scale
    else:
        length = np.sqrt(np.square(apart * weight).sum(axis=1, keepdims=True))
        curvature = weight * weight / np.maximum(length, 1e-3) * scale
    return curvature, curvature * apart


@lru_cache(maxsize=32)
def _motion_terms(steps: int, d: int) -> tuple[FloatArray, float]:
    """Hessian of ½Σ‖x_k − x_{k−1}‖² over x_1..x_N, and the weight of x_0 on x_1."""
    second = 2.0 * np.eye(steps) - np.eye(steps, k=1) - np.eye(steps, k=-1)
    second[-1, -1] = 1.0
    matrix = np.kron(second, np.eye(d)).astype(np.float64)
    matrix.setflags(write=False)
    return matrix, 1.0


@lru_cache(maxsize=3)
def _directions(d: int) -> FloatArray:
    """(m, d) unit vectors along axes and diagonals."""
    vectors = np.array([v for v in product((-1.0, 0.0, 1.0), repeat=d) if any(v)])
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    vectors.setflags(write=False)
    return vectors


def _surroundings(problem: PlanningProblem, path: Path, maps: SearchMaps) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Half-planes A·x ≤ b that keep off forbidden places, and the slope (N, d) of the soft risk."""
    steps, d = len(path) - 1, path.shape[1]
    doubled = np.empty((2 * steps, d))
    doubled[0::2] = 0.5 * (path[:-1] + path[1:])
    doubled[1::2] = path[1:]
    directions = _directions(d)
    room = np.full((2 * steps, len(directions)), np.inf)
    gradient = np.zeros((steps, d))
    if maps.rasters.some.any():
        room, gradient = _risk_surroundings(problem, doubled, maps, directions)
    if problem.obstacles is not None:
        room = np.minimum(room, _wall_room(problem, doubled, directions, maps.spacing))
    at, toward = np.nonzero(room < 1.5 * maps.spacing)
    normals = directions[toward]
    bounds = room[at, toward] + (normals * doubled[at]).sum(axis=1)
    rows = np.zeros((len(at), steps + 1, d))
    n = np.arange(len(at))
    midway = at % 2 == 0
    later = at // 2 + 1
    rows[n, later] = np.where(midway, 0.5, 1.0)[:, None] * normals
    rows[n[midway], later[midway] - 1] = 0.5 * normals[midway]
    bounds -= rows[:, 0] @ path[0]
    return rows[:, 1:].reshape(len(at), steps * d), bounds, gradient


def _risk_surroundings(
    problem: PlanningProblem, doubled: FloatArray, maps: SearchMaps, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Room (2N, m) m until the risk passes the limit, and the slope (N, d) of the soft risk, from the rasters."""
    d = doubled.shape[1]
    cells = np.zeros((len(doubled), 3))
    cells[:, 3 - d :] = (doubled - problem.start) / maps.spacing
    rays = np.zeros((len(directions), 3))
    rays[:, 3 - d :] = directions
    limit = 0.5 if problem.rule == "cells" else problem.risk_limit
    rasters = maps.rasters
    room, slope, level = corridor(
        cells, rays, 1.5, maps.radius, maps.active, rasters.values, rasters.starts, rasters.some, float(limit)
    )
    halves = problem.people is not None and problem.people.has_midway
    price = np.full(len(level), problem.soft_risk_weight)
    if problem.graded:
        price[level > limit] += problem.steep_risk_weight
    price *= (0.5 if halves else 1.0) / maps.spacing
    rise = slope[:, 3 - d :] * price[:, None]
    gradient = rise[1::2] + 0.5 * rise[0::2]
    gradient[:-1] += 0.5 * rise[2::2]
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


def _speed_rows(problem: PlanningProblem, path: Path, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Half-planes A·x ≤ b that keep every step within the speed limit."""
    steps, d = len(path) - 1, path.shape[1]
    length = problem.max_speed * problem.time_step
    moves = np.diff(path, axis=0)
    if problem.shape == "box" or d == 1:
        normals = np.broadcast_to(np.concatenate([np.eye(d), -np.eye(d)]), (steps, 2 * d, d))
        limits = np.full((steps, 2 * d), length)
    else:
        normals, limits = _chords(moves, length)
    reachable = (normals * moves[:, None]).sum(axis=2) + 2.0 * spacing * np.sqrt(d) >= limits
    k, r = np.nonzero(reachable)
    rows = np.zeros((len(k), steps + 1, d))
    n = np.arange(len(k))
    rows[n, k + 1] = normals[k, r]
    rows[n, k] -= normals[k, r]
    bounds = limits[k, r] + rows[:, 0] @ -path[0]
    return rows[:, 1:].reshape(len(k), steps * d), bounds


def _chords(moves: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """Inner half-planes (N, m, d) and their limits (N, m) to the ball of `length` around the directions of `moves`."""
    steps, d = moves.shape
    size = np.linalg.norm(moves, axis=1, keepdims=True)
    forward = np.where(size > 1e-9, moves / np.maximum(size, 1e-9), np.eye(d)[0])
    if d == 2:
        angles = CHORD_ANGLE * (np.arange(CHORDS) - 0.5 * (CHORDS - 1))
        side = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
        turned = np.cos(angles)[None, :, None] * forward[:, None] + np.sin(angles)[None, :, None] * side[:, None]
        return turned, np.full((steps, CHORDS), length * np.cos(0.5 * CHORD_ANGLE))
    other = np.where(np.abs(forward[:, 2:3]) < 0.9, np.eye(3)[2], np.eye(3)[0])
    side = np.cross(forward, other)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(forward, side)
    tilts = [(np.cos(a) * side + np.sin(a) * up) for a in np.pi / 2 * np.arange(4) + np.pi / 4]
    lean = np.sin(0.5 * CHORD_ANGLE)
    turned = np.stack([np.cos(0.5 * CHORD_ANGLE) * forward + lean * t for t in tilts], axis=1)
    return turned, np.full((steps, 4), length * np.cos(0.5 * CHORD_ANGLE))


def _box(problem: PlanningProblem, path: Path, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Bounds of the trust region, with the first action's acceleration."""
    low, high = path[1:] - spacing, path[1:] + spacing
    if problem.velocity is not None and problem.largest_change < math.inf:
        change = problem.largest_change * problem.time_step / math.sqrt(path.shape[1])
        middle = path[0] + problem.velocity * problem.time_step
        low[0] = np.minimum(np.maximum(low[0], middle - change), path[1])
        high[0] = np.maximum(np.minimum(high[0], middle + change), path[1])
    return low.ravel(), high.ravel()
