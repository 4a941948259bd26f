"""Global search: the exact minimum of Eq. 9 over the robot's own lattice, by backward induction."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sidestep._kernels.search import cheapest_path, gentle_path
from sidestep.planning.problem import PlanningProblem, respects
from sidestep.planning.search_maps import SearchMaps, again, prepare, within
from sidestep.types import FloatArray, Path, frozen_array, sealed

ENOUGH = 16.0
"""How many times wider a second look may be to be the last one."""
WIDER = 8.0
"""How many times wider it is otherwise."""
AHEAD = 1.6
"""How many times farther than was needed the next search looks at first."""


class Outlook:
    """How far searches had to look of late, so that the next ones look as far at once.

    A motion past somebody costs about as much more than the cheapest without risk as it did a moment ago. How fast a
    search is depends on this, what it finds does not.
    """

    def __init__(self) -> None:
        self._needed = {False: 0.0, True: 0.0}  # by whether the limits are graded

    def slack(self, graded: bool) -> float:
        """Return by how much the motions to look at first may cost more than the cheapest without risk."""
        return AHEAD * self._needed[graded]

    def saw(self, graded: bool, needed: float) -> None:
        """Remember by how much what was found costs more than the cheapest without risk; inf: there was nothing."""
        self._needed = self._needed | {graded: needed}


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


def search(problem: PlanningProblem, maps: SearchMaps | None = None, outlook: Outlook | None = None) -> SearchResult:
    """Find the cheapest admissible sequence of lattice actions; never raises for want of one.

    The risk on the lattice is a raster; the path found is judged by the exact risk, and where the two differ by so much
    that the limit is passed, the search is repeated with a smaller limit.
    """
    outlook = outlook or Outlook()
    maps = prepare(problem, outlook.slack(problem.graded)) if maps is None else again(problem, maps)
    if problem.rule == "trajectory" and not problem.graded:
        return _within_total(problem, maps, outlook)
    limit = problem.instant_limit
    result = _solve(problem, maps, limit, problem.soft_risk_weight, outlook)
    for _ in range(2):
        if problem.graded or not result.feasible or respects(result.risk, problem.rule, problem.risk_limit):
            return result
        limit *= min(0.8, limit / float(result.risk.max(initial=0.0)))
        result = _solve(problem, result.maps, limit, problem.soft_risk_weight, outlook)
    if not respects(result.risk, problem.rule, problem.risk_limit):
        return replace(result, feasible=False, cost=math.inf)
    return result


def _within_total(problem: PlanningProblem, maps: SearchMaps, outlook: Outlook) -> SearchResult:
    """Rule `trajectory`: raise the price of risk until its sum fits, then lower it as far as that holds."""
    low, price = 0.0, problem.soft_risk_weight
    best = trial = _solve(problem, maps, problem.risk_limit, price, outlook)
    if not best.feasible or respects(best.risk, "trajectory", problem.risk_limit):
        return best
    found: SearchResult | None = None
    high = math.inf
    step = max(float(maps.stage.max()), 1e-6)
    for _ in range(14):
        price = low + step if found is None else 0.5 * (low + high)
        trial = _solve(problem, trial.maps, problem.risk_limit, price, outlook)
        if trial.feasible and respects(trial.risk, "trajectory", problem.risk_limit):
            if found is None or trial.cost <= found.cost:
                found = trial
            high = price
        else:
            low = price
            step *= 4.0
    return found if found is not None else replace(best, feasible=False, cost=math.inf)


def _solve(problem: PlanningProblem, maps: SearchMaps, limit: float, weight: float, outlook: Outlook) -> SearchResult:
    """The cheapest motion on the lattice, and the exact evaluation of it.

    What is looked at is widened until nothing that is left out can be cheaper than what was found.
    """
    path = np.empty((problem.horizon + 1, problem.dimension))
    total = _look(problem, maps, limit, weight, path)
    while total > maps.least + maps.slack:
        needed = (total - maps.least) * (1 + 1e-6) + 1e-6
        slack = needed if needed < ENOUGH * maps.slack else WIDER * maps.slack
        dearest = (problem.horizon + problem.terminal_weight) * float(maps.stage.max())
        maps = within(problem, maps, slack if 0.0 < slack < 0.25 * dearest else math.inf)
        total = _look(problem, maps, limit, weight, path)
    feasible = math.isfinite(total)
    if feasible and problem.inertia is not None:
        first = problem.first_velocity(path)
        path[1:] += (problem.begun(first) - first) * problem.time_step
    outlook.saw(problem.graded, total - maps.least if feasible else math.inf)
    risk = problem.risk_along(path)
    cost = problem.cost(path, risk) if feasible else math.inf
    return SearchResult(path=path, feasible=feasible, cost=cost, risk=risk, maps=maps)


def _look(problem: PlanningProblem, maps: SearchMaps, limit: float, weight: float, path: Path) -> float:
    """One backward induction over what the maps hold: its cost, and `path` (N+1, d) m written."""
    share, lattice, rasters = problem.half_share, maps.lattice, maps.rasters
    steep = sealed(share * problem.excess_weights) if problem.graded else _forbidding(problem.horizon)
    given = (
        problem.start, lattice.spacing, problem.horizon, lattice.radius, lattice.active, lattice.moves, lattice.effort,
        maps.first, maps.stage, maps.terminal, maps.blocked, maps.blocked_halfway,
        rasters.values, rasters.starts, rasters.some, *rasters.boxes,
        share * weight, limit * (1 + 1e-6) + 1e-9, steep, problem.standing_share, *maps.boxes,
    )  # fmt: skip
    change = math.inf if problem.inertia is None else problem.inertia.taps_apart(lattice.spacing)
    if change >= 2 * lattice.radius * math.sqrt(problem.dimension):  # any tap may follow any other
        return cheapest_path(*given, path)
    return gentle_path(*given, change, path)


@lru_cache(maxsize=64)
def _forbidding(horizon: int) -> FloatArray:
    """(N,) inf: what exceeds the limit is forbidden."""
    return frozen_array(np.full(horizon, math.inf))
