"""From a scenario and what the visitor changed in it to the scenario of one trip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.simulation.scenario import Scenario
from sidestep.simulation.settings import PersonSettings
from sidestep.types import FloatArray, VectorLike
from sidestep.viewer.live.settings import Ignores, LiveSettings

if TYPE_CHECKING:
    from sidestep.obstacles import Obstacles

CONTROL_STEP = 0.05  # s: twenty frames a second
VISITOR = "visitor"  # the kind of person whom the visitor steers
MARGIN = 1.5  # m of floor around everything
MOST_PEOPLE = 12
SMALLEST = 8.0  # m, of the floor's sides
LONGEST_TRIP = 600.0  # s; after that the record begins anew
CERTAIN = 1e-9  # distance to 0 or 1 of a belief that is meant to be fixed
FORGETFUL = 1e3  # 1/s; whatever a person does, the belief is back at its prior before the next step

Bounds = tuple[float, float, float, float]


def with_settings(scenario: Scenario, settings: LiveSettings) -> Scenario:
    """Return `scenario` with the visitor's numbers in it, in live time steps, checked again.

    Raises:
        InvalidInput: the scenario is not flat, or a number does not fit it.
    """
    if scenario.dimension != 2:
        raise InvalidInput("live.scenario", scenario.name, "a scenario in 2-D", "choose another one")
    data = scenario.settings()
    data["control_step"], data["planning_period"] = CONTROL_STEP, 1.0 / settings.planning_rate
    data["duration"], data["recording"], data["people"], data["robots"] = LONGEST_TRIP, None, [], []
    for table, name, value in (
        ("planner", "horizon", settings.horizon),
        ("planner", "risk_limit", settings.risk_limit),
        ("planner", "clearance", settings.clearance),
        ("robot", "max_speed", settings.robot_speed),
        ("human", "randomness", settings.randomness),
    ):
        if value is not None:
            data[table][name] = value
    if settings.randomness is not None:
        data["human"]["online_randomness"] = False
    return Scenario.parse(data, "live")


def ignoring(scenario: Scenario, ignores: Ignores) -> Scenario:
    """Return `scenario` with part of the method switched off in the planner's model of people."""
    changes: dict[str, Any] = {
        "nothing": {},
        "assume_concerned": {"prior_concerned": 1.0 - CERTAIN, "switch_rate": FORGETFUL},
        "assume_unconcerned": {"prior_concerned": CERTAIN, "switch_rate": FORGETFUL},
        "no_prediction": {"horizon": 0},
    }[ignores]
    return scenario.model_copy(update={"human": replace(scenario.human, **changes)})


def bounds_of(scenario: Scenario, obstacles: Obstacles | None) -> Bounds:
    """Return the floor (x0, y0, x1, y1) m: everything in the scenario and its walls, and some room around."""
    points: list[VectorLike] = [scenario.robot.start, scenario.robot.goal]
    for person in scenario.people:
        points += [person.start, *([] if person.goal is None else [person.goal])]
    if obstacles is not None:
        x0, y0, x1, y1 = obstacles.bounds
        points += [(x0, y0), (x1, y1)]
    return around(np.array(points, dtype=np.float64))


def around(points: FloatArray) -> Bounds:
    """Return a floor (x0, y0, x1, y1) m with some room around `points` ((K, 2) m)."""
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    missing = np.maximum(SMALLEST - (high - low), 0.0) / 2
    low, high = low - missing, high + missing
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def visitor_start(scenario: Scenario) -> tuple[float, float]:
    """Return where the visitor begins: in the place of the scenario's first person, or beside the robot's way."""
    if scenario.people:
        x, y = scenario.people[0].start
        return float(x), float(y)
    start, goal = np.array(scenario.robot.start), np.array(scenario.robot.goal)
    way = goal - start
    side = np.array([-way[1], way[0]]) / max(float(np.linalg.norm(way)), 1e-9)
    x, y = (start + goal) / 2 + 2.5 * side
    return float(x), float(y)


def people_count(scenario: Scenario, settings: LiveSettings) -> int:
    """Return the number of simulated people."""
    return min(max(len(scenario.people) - 1, 0), MOST_PEOPLE) if settings.people is None else settings.people


def crowd(
    scenario: Scenario, settings: LiveSettings, bounds: Bounds, generator: np.random.Generator, free: Any
) -> list[PersonSettings]:
    """Return the simulated people: the scenario's own beyond the first, then others who cross the floor.

    Args:
        scenario: the run.
        settings: number and kind.
        bounds: of the floor.
        generator: of the places.
        free: (point) → whether a person may stand there.
    """
    own = [person.model_copy(update={"id": None}) for person in scenario.people[1:]]
    count = people_count(scenario, settings)
    while len(own) < count:
        start, goal = _crossing(scenario, bounds, generator, free)
        kind = "unconcerned" if len(own) % 2 else "concerned"
        own.append(PersonSettings(kind=kind, start=start, goal=goal, goal_known=False))
    kinds = {"mixed": ("concerned", "unconcerned"), "scenario": ()}.get(settings.kind, (settings.kind,))
    return [
        person.model_copy(update={"id": f"p{i + 1}"} | ({"kind": kinds[i % len(kinds)]} if kinds else {}))
        for i, person in enumerate(own[:count])
    ]


def trip(
    scenario: Scenario, *, start: VectorLike, goal: VectorLike, visitor: VectorLike, people: Sequence[PersonSettings]
) -> Scenario:
    """Return the scenario of one trip from where everybody is now; people may stand anywhere, the robot too."""
    you = PersonSettings(id="you", kind=VISITOR, start=_pair(visitor), goal=None, goal_known=False)
    robot = scenario.robot.model_copy(update={"start": _pair(start), "goal": _pair(goal), "heading": None})
    return scenario.model_copy(update={"robot": robot, "people": (you, *people)})


def _crossing(
    scenario: Scenario, bounds: Bounds, generator: np.random.Generator, free: Any
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Two free places on opposite sides of the floor, away from the robot's start."""
    low, high = np.array(bounds[:2]) + 0.6, np.array(bounds[2:]) - 0.6
    robot = np.array(scenario.robot.start)
    start = goal = (low + high) / 2
    for _ in range(200):
        axis = int(generator.integers(2))
        ends = generator.uniform(low, high, size=(2, 2))
        side = int(generator.integers(2))
        ends[0, axis], ends[1, axis] = (low[axis], high[axis]) if side else (high[axis], low[axis])
        start, goal = ends
        if free(start) and free(goal) and float(np.linalg.norm(start - robot)) > scenario.clearance + 1.0:
            break
    return _pair(start), _pair(goal)


def _pair(point: VectorLike | FloatArray) -> tuple[float, float]:
    return float(point[0]), float(point[1])
