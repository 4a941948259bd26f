"""From situation to motion: rounds of prediction and planning, the certificate, and the ladder of fall-backs.

People respond to the plan, and the plan to the people. So a plan is made under the prediction that the last one
induces, and then judged under the prediction that *it* induces: certified if every limit holds there, otherwise planned
again. Where no round is certified the motion of least risk is taken; its cost rises steeply with the risk above the
limit and mildly below it, so that there is no switch from driving to braking.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sidestep.forecast import Forecast
from sidestep.planning.polish import polish
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import SearchResult, search
from sidestep.planning.turning import waits
from sidestep.situation import STAYS, Situation
from sidestep.types import FloatArray, Path, Status

_GIVEN_UP = 0.5  # a motion that gains less than this share of the open way gives way
_CREEP = 0.5, 0.25  # of the top speed


class View(NamedTuple):
    """What is foreseen, Eq. 9 under it, and how many predictions were made until then."""

    seen: Forecast
    problem: PlanningProblem
    made: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """A motion and the prediction under which it was judged.

    Attributes:
        path: (N+1, d) m.
        status: "certified" or "least_risk".
        risk: (2N,) what the rule limits, at half instants 1..2N, under `foreseen`.
        cost: objective (Eq. 9a), soft risk included.
        foreseen: the prediction that this very path induces; problem: Eq. 9 under it.
        rounds: predictions made so far.
        stoppable: the base could still come to stand in time.
        turns: it is a turn on the spot.
    """

    path: Path
    status: Status
    risk: FloatArray
    cost: float
    foreseen: Forecast
    problem: PlanningProblem
    rounds: int
    stoppable: bool
    turns: bool = False

    @property
    def view(self) -> View:
        """What this motion was judged under."""
        return View(self.foreseen, self.problem, self.rounds)


def climb(now: Situation, anticipated: Path) -> Outcome:
    """Plan until a round is certified, else take the motion of least risk.

    Args:
        now: the situation.
        anticipated: (≥ N+1, d) m, the motion that people are taken to expect.

    Raises:
        OutOfTime: the deadline of the situation is near.
    """
    view = _induced(now, anticipated, 0)
    best: Outcome | None = None
    for path in now.wished():
        outcome = judged(now, path, view)
        if outcome.status == "certified":
            return outcome
        view = view._replace(made=outcome.rounds)
    for _ in range(now.settings.rounds):
        path = _motion(now, view.problem)
        if path is None:
            break
        if not view.seen.foretells(path):
            made = view.made
            del view, best  # what is no longer needed goes before as much is made anew; at N = 50 that is 40 MB
            view = _induced(now, path, made)
        best = judged(now, path, view)
        view = best.view
        if best.status == "certified":
            return _turned(now, _going_on(now, _braking(now, best)))
    return _turned(now, replace(_least_risk(now, view, best), rounds=view.made))


def _induced(now: Situation, path: Path, made: int) -> View:
    """What people will do if the robot moves along `path`, after `made` predictions."""
    seen = now.foresee(path)
    return View(seen, now.problem_under(seen), made + 1)


def judged(now: Situation, path: Path, view: View) -> Outcome:
    """Judge a path under the prediction that it induces; the one in `view` is used where it was made for this path."""
    seen, problem, made = view if view.seen.foretells(path) else _induced(now, path, view.made)
    risk = problem.risk_along(path)
    certified = problem.allows(path, risk)
    return Outcome(
        path=path,
        status="certified" if certified else "least_risk",
        risk=risk,
        cost=problem.cost(path, risk),
        foreseen=seen,
        problem=problem,
        rounds=made,
        stoppable=certified or problem.can_stop(path),
    )


def _braking(now: Situation, safe: Outcome) -> Outcome:
    """The certified motion; where the base would pass its goal with it, the hardest stop if that is cheaper.

    Where calls are rare, the change of velocity that a search may begin with does not brake in time.
    """
    if safe.problem.overshoot_costs(safe.problem.first_velocity(safe.path))[0] <= 0.0:
        return safe
    stop = judged(now, now.standing(), safe.view)
    return stop if stop.status == "certified" and stop.cost < safe.cost else safe


def _going_on(now: Situation, safe: Outcome) -> Outcome:
    """The certified motion; where it gives up the way to the goal, one that goes on as long as it can still change.

    Uncertainty grows with the time ahead, and what will be seen meanwhile is not in the prediction. So beyond some
    horizon every way past somebody may exceed the limit, and the only certified motion is to give way until there is
    room: the "freezing robot" (Trautman and Krause 2010). A motion that keeps the limits until `recourse`, and is
    charged for what exceeds them later, is judged again before it comes to that.
    """
    steps = now.recourse_steps
    if steps is None or now.wish is not None:
        return safe
    if not now.gives_up(safe.path, _GIVEN_UP):
        return safe
    path = _motion(now, replace(safe.problem, graded=True))
    if path is None:
        return safe
    onward = judged(now, path, safe.view)
    first = onward.problem.first_velocity(path)
    kept = onward.risk[: 2 * steps].max() <= now.settings.risk_limit
    if not kept or not np.isfinite(onward.problem.first_step_costs(first)[0]):
        return safe
    return min(safe, onward, key=lambda o: _price(o, replace(o.problem, graded=True)))


def _turned(now: Situation, best: Outcome) -> Outcome:
    """The motion; where walls leave a base with two wheels no room for it, a turn on the spot, if that is certified.

    Its reference may come as near to walls as it likes meanwhile: the body stays where it is.
    """
    velocity = now.turning(best.path)
    if velocity is None:
        return best
    path = np.repeat(now.start[None], now.around.horizon + 1, axis=0)
    path[1:] += best.problem.begun(velocity[None]) * now.settings.time_step
    seen, problem, made = best.view if best.foreseen.foretells(path) else _induced(now, path, best.rounds)
    turned = judged(now, path, View(seen, replace(problem, margin=0.0), made))
    return replace(turned, turns=True) if turned.status == "certified" else replace(best, rounds=made)


def _motion(now: Situation, problem: PlanningProblem) -> Path | None:
    now.check()
    found = search(problem, outlook=now.outlook)
    if _hesitates(now, problem, found.path):
        found = _creeping(now, problem, found)
    if not found.feasible:
        return None
    now.check()
    return polish(problem, found, late=now.late).path if now.settings.polish else found.path


def _hesitates(now: Situation, problem: PlanningProblem, path: Path) -> bool:
    """Whether a motion beside a wall leads nowhere, or begins with that."""
    return problem.beside_walls and (waits(path) or now.gives_up(path, STAYS))


def _creeping(now: Situation, problem: PlanningProblem, found: SearchResult) -> SearchResult:
    """What leads on through a gap that is narrower than the steps of a fast robot's lattice: a slow one's are small."""
    pace = 0.0 if problem.inertia is None else math.hypot(*problem.inertia.velocity.tolist())
    least = found.cost if problem.allows(found.path, found.risk) else math.inf
    for share in _CREEP:
        speed = share * problem.max_speed
        if pace <= speed:
            now.check()
            slow = search(replace(problem, max_speed=speed))
            if slow.feasible and slow.cost < least:
                found, least = slow, slow.cost
    return found


def _least_risk(now: Situation, view: View, best: Outcome | None) -> Outcome:
    """The cheapest of the graded plan, the last uncertified one, and standing; each judged under its own effect."""
    graded = _motion(now, view.problem.for_least_risk)
    outcomes = [] if best is None else [best]
    if graded is not None:
        outcomes.append(judged(now, graded, view))
        if outcomes[-1].status == "certified":
            return outcomes[-1]
    outcomes.append(judged(now, now.standing(), view))
    return min(outcomes, key=lambda o: _price(o, o.problem.for_least_risk))


def _price(outcome: Outcome, graded: PlanningProblem) -> float:
    """What a motion costs where no risk is forbidden and all of it is charged."""
    price = graded.cost(outcome.path, outcome.risk)
    return price if np.isfinite(price) else np.inf
