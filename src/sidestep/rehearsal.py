"""Encounters with people who do not exist: whoever has planned through them has everything compiled and loaded."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.human.policy import NEAR_FROM
from sidestep.obstacles import Obstacles
from sidestep.prediction.ground import SINGLE_FROM
from sidestep.robots import Robot, RobotState
from sidestep.types import Vector

GOAL = 8.0
"""m ahead of the robot."""
PERIOD = 0.4
"""s between two calls."""
HORIZONS = (4, math.ceil(math.sqrt(SINGLE_FROM)), math.ceil(math.sqrt(NEAR_FROM)))
"""Steps from which on other kernels are used: values of lower precision, sweeps of where the robot matters alone."""

_CROSSING, _HEAD_ON = ((1.8, 0.9), (0.0, -1.0)), ((5.0, 0.1), (-1.0, 0.0))
_CLOSE, _IN_THE_WAY = ((0.4, 0.1), (0.0, 0.0)), ((3.0, 0.1), (0.0, 0.0))
_SCENES = (
    (5, (_HEAD_ON,)),  # as long as it takes to tell whether somebody makes room
    (2, (_CROSSING, _HEAD_ON)),
    (2, (_CLOSE, _CROSSING)),
    (3, (_IN_THE_WAY,)),  # as long as it takes to be gone around, if that is a `PERIOD`
    (1, ()),
)
"""Calls, and whoever is there: m from where the robot is at first, m/s."""


def goal(dimension: int) -> Vector:
    """Return (d,) m, where the robot of `calls` is to go."""
    return _along((GOAL, 0.0), dimension)


def walls(robot: Robot) -> Obstacles:
    """Return a map beside the robot's way, however wide it is."""
    near, far = robot.planning_radius + 0.9, robot.planning_radius + 1.1
    return Obstacles(polygons=[[(0.5, near), (3.5, near), (3.5, far), (0.5, far)]])


def calls(robot: Robot, dimension: int) -> Iterator[tuple[float, RobotState, list[PersonObservation]]]:
    """Yield what `Planner.step` is asked: time (s), robot, people.

    Args:
        robot: the base; it drives on at half its speed.
        dimension: of space.
    """
    pace = _along((0.5 * robot.planning_speed, 0.0), dimension)
    time = 0.0
    for scene, (count, people) in enumerate(_SCENES):
        begun = time
        for _ in range(count):
            seen = [
                PersonObservation(
                    id=f"{scene}/{number}",
                    position=begun * pace + _along(place, dimension) + (time - begun) * _along(velocity, dimension),
                    velocity=_along(velocity, dimension) if number == 0 else None,
                    goal=_along((0.0, 0.0), dimension) if number == 1 and scene == 1 else None,
                )
                for number, (place, velocity) in enumerate(people)
            ]
            yield time, RobotState(position=time * pace, heading=0.0, velocity=pace), seen
            time += PERIOD


def _along(flat: tuple[float, float], dimension: int) -> Vector:
    """(d,) what two numbers are on a line, on the floor or in space."""
    out = np.zeros(dimension)
    out[:2] = flat[:dimension]
    return out
