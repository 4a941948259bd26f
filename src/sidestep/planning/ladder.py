"""From problem to motion: rounds of prediction and planning, the certificate, and the ladder of fall-backs.

People respond to the plan, and the plan to the people. So a plan is made under the prediction that the last one
induces, and then judged under the prediction that *it* induces: certified if every limit holds there, otherwise planned
again. Where no round is certified the motion of least risk is taken; its cost rises steeply with the risk above the
limit and mildly below it, so that there is no switch from driving to braking.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from sidestep.planning.polish import polish
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import search
from sidestep.types import FloatArray, Path, Status

_SAME = 1e-6  # m; motions closer than this induce the same prediction


class Foreseen(Protocol):
    """What people will do if the robot moves along `path` ((≥ N+1, d) m)."""

    @property
    def path(self) -> Path:
        """The motion that they respond to."""
        ...


F = TypeVar("F", bound=Foreseen)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome(Generic[F]):
    """A motion and the prediction under which it was judged.

    Attributes:
        path: (N+1, d) m.
        status: "certified" or "least_risk".
        risk: (2N,) what the rule limits, at half instants 1..2N, under `foreseen`.
        cost: objective (Eq. 9a), soft risk included.
        foreseen: the prediction that this very path induces.
        rounds: predictions made.
    """

    path: Path
    status: Status
    risk: FloatArray
    cost: float
    foreseen: F
    rounds: int


def climb(
    problem_under: Callable[[F], PlanningProblem],
    foresee: Callable[[Path], F],
    anticipated: Path,
    *,
    rounds: int,
    polished: bool,
    in_time: Callable[[], bool],
) -> Outcome[F]:
    """Plan until a round is certified, else take the motion of least risk.

    Args:
        problem_under: Eq. 9 under a prediction.
        foresee: the prediction that a motion (N+1, d) m induces.
        anticipated: (N+1, d) m, the motion that people are taken to expect now.
        rounds: plans at most.
        polished: refine the lattice motion continuously.
        in_time: False when no further round may begin.
    """
    seen = foresee(anticipated)
    made = 1
    best: Outcome[F] | None = None
    for round_ in range(rounds):
        if round_ > 0 and not in_time():
            break
        problem = problem_under(seen)
        path = _motion(problem, polished)
        if path is None:
            break
        seen, new = _foreseen(seen, path, foresee)
        made += new
        best = _judge(problem_under(seen), path, seen, made)
        if best.status == "certified":
            return best
    return _least_risk(problem_under, foresee, seen, best, made, polished)


def _motion(problem: PlanningProblem, polished: bool) -> Path | None:
    found = search(problem)
    if not found.feasible:
        return None
    return polish(problem, found).path if polished else found.path


def _foreseen(seen: F, path: Path, foresee: Callable[[Path], F]) -> tuple[F, int]:
    """The prediction that `path` induces, and how many predictions that took."""
    if np.abs(seen.path[: len(path)] - path).max() < _SAME:
        return seen, 0
    return foresee(path), 1


def _judge(problem: PlanningProblem, path: Path, seen: F, made: int) -> Outcome[F]:
    risk = problem.risk_along(path)
    good = problem.allows(path, risk)
    return Outcome(
        path=path,
        status="certified" if good else "least_risk",
        risk=risk,
        cost=problem.cost(path, risk),
        foreseen=seen,
        rounds=made,
    )


def _least_risk(
    problem_under: Callable[[F], PlanningProblem],
    foresee: Callable[[Path], F],
    seen: F,
    best: Outcome[F] | None,
    made: int,
    polished: bool,
) -> Outcome[F]:
    """The cheapest of the graded plan, the last uncertified one, and standing; each judged under its own effect."""
    problem = replace(problem_under(seen), graded=True)
    still = np.repeat(problem.start[None], problem.horizon + 1, axis=0)
    graded = _motion(problem, polished)
    outcomes: list[tuple[float, Outcome[F]]] = []
    for path in (graded, None if best is None else best.path, still):
        if path is None:
            continue
        after, new = _foreseen(seen, path, foresee)
        made += new
        judged = problem_under(after)
        outcome = _judge(judged, path, after, made)
        if outcome.status == "certified" and path is not still:
            return outcome
        strict = replace(judged, graded=True)
        first = np.diff(path[:2], axis=0) / strict.time_step
        price = strict.cost(path, outcome.risk) + float(strict.first_step_costs(first)[0])
        outcomes.append((price if np.isfinite(price) else np.inf, outcome))
    price, outcome = min(outcomes, key=lambda pair: pair[0])
    return replace(outcome, rounds=made)
