"""Why a motion has the status that it has, in plain words."""

from __future__ import annotations

import math

from sidestep.ladder import Outcome
from sidestep.planning.plan import limited_risk
from sidestep.situation import STAYS, Situation
from sidestep.types import FloatArray


def reason_of(outcome: Outcome, now: Situation, risk: FloatArray) -> str:
    """Say what was found in this situation; `risk` (N,) is what the rule limits, step by step."""
    said = _turning(outcome) or now.remark or _too_narrow(now, outcome) or _short_of_the_goal(now)
    return _of_status(outcome, now, risk) + said


def _turning(outcome: Outcome) -> str:
    return "; turning on the spot, since walls leave no room for another way" if outcome.turns else ""


def _of_status(outcome: Outcome, now: Situation, risk: FloatArray) -> str:
    settings, near = now.settings, len(outcome.foreseen.near)
    whom = "nobody" if near == 0 else "1 person" if near == 1 else f"{near} people"
    word = "summed" if settings.risk_rule == "trajectory" else "highest"
    worst = float(limited_risk(risk, settings.risk_rule))
    if outcome.status == "certified":
        return f"every limit holds with {whom} in reach; {word} risk {worst:.2g} of {settings.risk_limit:g}"
    if not outcome.stoppable:
        return f"with {whom} in reach no motion leaves a safe stop; taking the least risk, {word} {worst:.2g}"
    steps = now.recourse_steps
    if steps is not None and float(risk[:steps].max()) <= settings.risk_limit:
        return f"with {whom} in reach limits hold for now, not to the end; going on, highest risk {worst:.2g}"
    return f"no plan keeps every limit with {whom} in reach; taking the least risk, {word} {worst:.2g}"


def _too_narrow(now: Situation, outcome: Outcome) -> str:
    """Say so where nobody but walls can keep the robot from going on, or ''."""
    nobody = not outcome.foreseen.near and not now.among_robots
    walls_alone = outcome.problem.beside_walls and nobody and now.wish is None
    if walls_alone and now.gives_up(outcome.path, STAYS):
        return "; no motion leads on: the way may be too narrow here"
    return ""


def _short_of_the_goal(now: Situation) -> str:
    """Say so where the goal is nearer to walls than the robot's point may come, or ''."""
    if now.field is None:
        return ""
    gap = math.dist(now.field.goal, now.goal)
    if gap <= now.field.spacing:
        return ""
    return f"; walls keep the robot {gap:.2f} m from the goal: it needs {now.robot.wall_margin:.2f} m to them"
