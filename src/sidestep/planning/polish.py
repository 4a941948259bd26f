"""Continuous refinement of a lattice path within what surrounds it: Eq. 9 as a few convex quadratic programs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
import piqp

from sidestep._kernels.path_costs import half_instants
from sidestep._kernels.program_around import part_way, program_around, promised_gain
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import SearchResult
from sidestep.planning.search_maps import SearchMaps
from sidestep.types import FloatArray, Path, sealed

_FAR = 1e3  # m; walls farther away than this are as good as none
_NO_ROOM, _NO_MODEL = np.zeros((0, 0)), np.zeros((0, 0, 0))


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


def polish(
    problem: PlanningProblem, found: SearchResult, *, rounds: int = 2, late: Callable[[], bool] | None = None
) -> PolishedPath:
    """Refine what the search found; where nothing better is admissible, that is what comes back.

    Args:
        problem: as given to the search.
        found: its result; what is not feasible is returned as it is.
        rounds: quadratic programs at most.
        late: says whether there is no time for another one; None: there always is.
    """
    best = PolishedPath(path=found.path, cost=found.cost, risk=found.risk, rounds=0)
    if not found.feasible:
        return best
    solver = piqp.DenseSolver()
    settings = solver.settings
    settings.eps_abs = settings.eps_rel = 1e-6
    settings.max_iter = 40
    for _ in range(rounds):
        if late is not None and late():
            return best
        moved = _solution(solver, problem, best.path, found.maps, least_gain=1e-4 * abs(best.cost))
        better = None if moved is None else _accepted(problem, best, moved)
        if better is None:
            return best
        gain = best.cost - better.cost
        best = better
        if gain < 1e-3 * abs(best.cost):
            break
    return best


def _accepted(problem: PlanningProblem, best: PolishedPath, moved: FloatArray) -> PolishedPath | None:
    """The farthest of a few points on the way to the positions `moved` (N·d,) m that is cheaper and admissible."""
    for part in (1.0, 0.5, 0.2):
        path = part_way(best.path, moved, part)
        risk = problem.risk_along(path)
        cost = problem.cost(path, risk)
        if cost < best.cost and problem.allows(path, risk):
            return PolishedPath(path=path, cost=cost, risk=risk, rounds=best.rounds + 1)
    return None


def _solution(
    solver: piqp.DenseSolver, problem: PlanningProblem, path: Path, maps: SearchMaps, least_gain: float
) -> FloatArray | None:
    """Positions (N·d,) m that solve one convex program; None if the solver fails or the program promises too little.

    They are the solver's own, and hold until it is asked again.
    """
    rows, planes = _program(problem, path, maps)
    n = rows.shape[1]
    limits = (planes[:n].T, None, planes[n]) if planes.size else (None, None, None)
    solver.setup(rows[:n].T, rows[n], None, None, *limits, rows[n + 1], rows[n + 2])  # it wants columns first
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    moved: FloatArray = solver.result.x
    return moved if promised_gain(path, moved, rows) > least_gain else None


def _program(problem: PlanningProblem, path: Path, maps: SearchMaps) -> tuple[FloatArray, FloatArray]:
    """The convex program around `path`, as `program_around` returns it."""
    d, rasters = path.shape[1], maps.rasters
    directions = _directions(d)
    walls = _NO_ROOM if problem.obstacles is None else _wall_room(problem, path, directions, maps.spacing)
    model = _NO_MODEL if problem.distance_to_goal is None else _goal_model(problem, path)
    preferred = problem.start if problem.preferred is None else problem.preferred
    velocity = problem.start if problem.inertia is None else problem.inertia.velocity
    rows, planes = program_around(
        path, maps.spacing, directions,
        problem.goal, problem.goal_weights, problem.goal_cost == "squared", problem.terminal_weight, model,
        problem.effort_weights, problem.time_step, preferred, problem.preference_weight,
        rasters.values, rasters.starts, rasters.some, *rasters.boxes, problem.instant_limit,
        problem.half_share, problem.soft_risk_weight, problem.excess_weights, problem.standing_share,
        walls, problem.max_speed, problem.shape == "box", velocity, problem.largest_change,
    )  # fmt: skip
    if problem.inertia is None or len(path) < 3:
        return rows, planes
    gentle = _gentle(path, problem.inertia.apart)
    return rows, np.hstack([planes, gentle]) if planes.size else gentle


def _gentle(path: Path, change: float) -> FloatArray:
    """Half-planes (N·d + 1, 2·d·(N−1)) that keep steps in a row within `change` m of each other, or as far as they are.

    Each column holds what the positions are multiplied by, and below it the limit.
    """
    steps, d = path.shape[0] - 1, path.shape[1]
    bends = _bends(steps, d)
    now = np.diff(path, n=2, axis=0).ravel()
    most = np.maximum(change / math.sqrt(d), np.abs(now))
    fixed = np.zeros_like(now)
    fixed[:d] = path[0]  # the first bend counts from where the robot is
    return np.vstack([np.hstack([bends.T, -bends.T]), np.concatenate([most - fixed, most + fixed])])


@lru_cache(maxsize=32)
def _bends(steps: int, d: int) -> FloatArray:
    """((N−1)·d, N·d) the second differences of the positions x_1..x_N; x_0, which is given, is left out."""
    rows = np.diff(np.eye(steps + 1), n=2, axis=0)[:, 1:]
    return sealed(np.kron(rows, np.eye(d)).astype(np.float64))


def _goal_model(problem: PlanningProblem, path: Path) -> FloatArray:
    """(2, N, d) diagonal curvature and slope of the cost of the walking distance; a quadratic from above."""
    assert problem.distance_to_goal is not None
    x, h = path[1:], 0.05
    scale = np.ones((len(x), 1))
    scale[-1] += problem.terminal_weight
    shifts = h * np.eye(x.shape[1])
    ahead = np.stack([problem.goal_costs(x + s) for s in shifts], axis=1)
    behind = np.stack([problem.goal_costs(x - s) for s in shifts], axis=1)
    away = np.maximum(problem.distance_to_goal.at(x), 1e-2)[:, None]
    weight = problem.goal_weights[0]
    bend = 2.0 * weight if problem.goal_cost == "squared" else weight / away
    return np.stack([np.broadcast_to(scale * bend, x.shape), scale * (ahead - behind) / (2 * h)])


@lru_cache(maxsize=3)
def _directions(d: int) -> FloatArray:
    """(m, d) unit vectors along axes and diagonals."""
    vectors = np.array([v for v in product((-1.0, 0.0, 1.0), repeat=d) if any(v)])
    return sealed(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _wall_room(problem: PlanningProblem, path: Path, directions: FloatArray, spacing: float) -> FloatArray:
    """Room (2N, m) m until walls come too near at half instants 1..2N, from the slope of the distance to them."""
    d, h = path.shape[1], 0.25 * spacing
    doubled = half_instants(path)[:, 3 - d :]

    def away(points: FloatArray) -> FloatArray:
        assert problem.obstacles is not None
        return np.minimum(problem.obstacles.distance(points), _FAR)  # a map may hold no wall at all

    gap = away(doubled) - problem.margin
    slope = np.stack([(away(doubled + h * e) - away(doubled - h * e)) / (2 * h) for e in np.eye(d)], axis=1)
    closing = -(slope @ directions.T)
    room = np.where(closing > 0.5, np.maximum(gap, 0.0)[:, None] / np.maximum(closing, 0.5), np.inf)
    room[:2] = np.inf  # the first step is judged by itself
    return room
