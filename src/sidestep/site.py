"""Where a robot is to go and what walls are there: checked together, and laid out once for all the calls to come."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from itertools import product

from sidestep.checks import numbers_in, of_kind
from sidestep.errors import InvalidInput
from sidestep.exits import exits
from sidestep.human.model import HumanModel
from sidestep.obstacles import Obstacles
from sidestep.planning.geodesic import DistanceField, Ways, ways_to_goal
from sidestep.planning.settings import PlannerSettings
from sidestep.robots import DifferentialDrive, Robot
from sidestep.types import Vector, VectorLike, frozen_array

_MOST_CELLS = 2e8  # a step's box times the steps; the mass of one person takes up to a third of it, 8 bytes each
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Site:
    """A goal among walls.

    Attributes:
        goal: (d,) m; obstacles: the map, or None where there are no walls.
        human: the model of people, exits of the map being their candidate goals where it asks for them.
        ways: where a way may lead on the map; field: the way to the goal around walls; None where there are none.
        margin: m to the walls that it keeps.
    """

    goal: Vector
    obstacles: Obstacles | None
    human: HumanModel
    ways: Ways | None
    field: DistanceField | None
    margin: float

    def no_way_from(self, start: Vector) -> str:
        """Say so where the map has no way from `start` (d,) m to the goal, or ''."""
        if self.field is None or self.obstacles is None:
            return ""
        if self.obstacles.distance(start) < 0.0:
            return "; on the map the robot is inside a wall"
        if self.field.reaches(start):
            return ""
        return f"; no way on the map leads to the goal with {self.margin:.3g} m to the walls"


def site_of(
    goal: VectorLike, obstacles: Obstacles | None, *, robot: Robot, human: HumanModel, settings: PlannerSettings
) -> Site:
    """Check a goal and a map for this robot, these people and these settings, and lay out the way.

    Raises:
        InvalidInput: they do not fit; one line that names the field.
    """
    of_kind("planner.obstacles", obstacles, Obstacles, optional=True)
    walls = obstacles or None  # a map without walls is no map
    place = frozen_array(numbers_in(goal))
    if place.size not in (1, 2, 3):
        raise InvalidInput("planner.goal", goal, "1, 2 or 3 finite numbers (m, up to 1e9)")
    if place.size != 2 and isinstance(robot, DifferentialDrive):
        raise InvalidInput("planner.goal", goal, "2 finite numbers (m) for a differential drive")
    if place.size == 1 and walls is not None:
        raise InvalidInput("planner.goal", goal, "2 or 3 finite numbers (m) where there is a map")
    _check_memory(settings, human, place.size)
    for whose, name in product(("planner", "human"), ("goal_weight", "effort_weight")):
        weight = getattr(settings if whose == "planner" else human, name)
        if isinstance(weight, tuple) and len(weight) != place.size:
            raise InvalidInput(f"{whose}.{name}", weight, f"one number, or one per axis ({place.size})")
    if walls is not None and not walls.free(place[None], robot.radius)[0]:
        allowed = f"a place at least the robot's radius ({robot.radius} m) away from walls"
        raise InvalidInput("planner.goal", place.tolist(), allowed, "move the goal or mend the map")
    margin = robot.wall_margin
    ways = None if walls is None else ways_to_goal(walls, place, margin=margin)
    return Site(
        goal=place,
        obstacles=walls,
        human=_placed(human, walls),
        ways=ways,
        field=None if ways is None else ways.field(),
        margin=margin,
    )


def _check_memory(settings: PlannerSettings, human: HumanModel, dimension: int) -> None:
    """Check that a person can be predicted over the whole horizon."""
    reach, steps = human.reach, settings.horizon
    if (2 * reach * steps + 1) ** dimension * steps > _MOST_CELLS:
        allowed = f"fewer steps in {dimension}-D with human.reach {reach}: one person's mass would fill the memory"
        raise InvalidInput("planner.horizon", steps, allowed)


def _placed(human: HumanModel, obstacles: Obstacles | None) -> HumanModel:
    """`human` with the exits of the map as candidate goals, where it asks for them."""
    if human.goals != "exits":
        return human
    ways = () if obstacles is None else exits(obstacles, human.radius)
    if not ways:
        _log.warning('human.goals = "exits": the map has no exits; directions are inferred instead')
    return replace(human, goals=ways)
