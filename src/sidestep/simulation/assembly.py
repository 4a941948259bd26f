"""From a scenario's numbers to the things they describe: robot, planner, walls, people, generators."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.robots import DifferentialDrive, Holonomic, Robot, RobotState
from sidestep.simulation.people import Person, Recorded
from sidestep.simulation.recordings import Recording, check_people
from sidestep.types import FloatArray

if TYPE_CHECKING:
    from sidestep.obstacles import Obstacles, OccupancyGrid
    from sidestep.planner import Planner
    from sidestep.simulation.scenario import Scenario


def robot_of(scenario: Scenario) -> Robot:
    """Return the robot of a scenario."""
    s = scenario.robot
    if s.kind == "differential":
        return DifferentialDrive(
            max_speed=s.max_speed,
            max_turn_rate=s.max_turn_rate,
            radius=s.radius,
            reference_offset=s.reference_offset,
            max_acceleration=s.max_acceleration,
            max_turn_acceleration=s.max_turn_acceleration,
        )
    return Holonomic(max_speed=s.max_speed, radius=s.radius, shape=s.shape, max_acceleration=s.max_acceleration)


def start_of(scenario: Scenario) -> RobotState:
    """Return the robot's state at the start: at rest, looking as told, or toward the goal."""
    s = scenario.robot
    heading = s.heading
    if s.kind == "differential" and heading is None:
        heading = math.atan2(s.goal[1] - s.start[1], s.goal[0] - s.start[0])
    return RobotState(position=s.start, heading=heading, velocity=np.zeros(scenario.dimension))


def planner_of(scenario: Scenario, obstacles: Obstacles | None = None) -> Planner:
    """Return the planner that a scenario describes.

    Args:
        scenario: the run.
        obstacles: walls; None: those of the scenario.
    """
    from sidestep.planner import Planner

    return Planner(
        robot=robot_of(scenario),
        goal=scenario.robot.goal,
        human=scenario.human,
        obstacles=obstacles_of(scenario) if obstacles is None else obstacles,
        settings=scenario.planner,
    )


def obstacles_of(scenario: Scenario, grid: OccupancyGrid | None = None) -> Obstacles | None:
    """Return the walls that a scenario itself holds, and those of a map where one is given; None: neither."""
    if not scenario.walls and grid is None:
        return None
    from sidestep.obstacles import Obstacles

    return Obstacles(polygons=walls_of(scenario), grid=grid)


def walls_of(scenario: Scenario) -> tuple[FloatArray, ...]:
    """Return the polygons of a scenario, each (V, 2) m; without its map."""
    return tuple(np.array(wall) for wall in scenario.walls)


def recorded_people(scenario: Scenario, recording: Recording | None) -> list[Person]:
    """Return the people of a scenario's recording who are there during the run.

    Raises:
        InvalidInput: the scenario names a recording that was not given, or that has no people in it.
    """
    wanted = scenario.recording
    if wanted is None:
        return []
    if recording is None:
        raise InvalidInput("recording", wanted.file, "the recording, read from that file", "pass it as `recording`")
    check_people([recording], wanted.kinds, wanted.file)
    radius = wanted.radius or scenario.human.radius
    present = recording.of_kinds(wanted.kinds).between(wanted.start, wanted.start + scenario.duration)
    return [Recorded(track, wanted.start, radius) for track in present]


def check_places(scenario: Scenario, obstacles: Obstacles | None, people: list[Person]) -> None:
    """Check that robot, goal and people are not inside walls, and that nobody stands in the robot at the start.

    Raises:
        InvalidInput: one of them is; says which.
    """
    if obstacles is not None:
        for name, point in (("robot.start", scenario.robot.start), ("robot.goal", scenario.robot.goal)):
            if not obstacles.free(np.array([point]), margin=scenario.robot.radius)[0]:
                allowed = f"a place at least the robot's radius, {scenario.robot.radius:g} m, from every wall"
                raise InvalidInput(name, point, allowed, "move it, or the wall")
        for i, person in enumerate(scenario.people):
            for name, point in (("start", person.start), ("goal", person.goal)):
                if point is not None and not obstacles.free(np.array([point]), margin=0.0)[0]:
                    raise InvalidInput(f"people.{i}.{name}", point, "a place outside walls", "move it, or the wall")
    start = np.array(scenario.robot.start)
    for person in people:
        place = person.position(0.0)
        if isinstance(person, Recorded) and place is not None:
            gap = float(np.linalg.norm(place - start))
            if gap < scenario.clearance:
                raise InvalidInput(
                    "robot.start",
                    scenario.robot.start,
                    f"at least the clearance, {scenario.clearance:g} m, from {person.id!r} ({gap:.2f} m)",
                    "move it, or start at another time",
                )
