"""From settings to a running node: robot, planner, walls, senses, threads."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sidestep.obstacles import Obstacles, OccupancyGrid
from sidestep.perception.scan import Beams
from sidestep.planner import Planner
from sidestep.planning.plan import Plan
from sidestep.robots import DifferentialDrive, RobotState
from sidestep.ros.core import Core
from sidestep.ros.frames import Frames, Lookup
from sidestep.ros.geometry import Pose2
from sidestep.ros.inputs import Inputs, Sensing
from sidestep.ros.messages import LaserScan, Map, People
from sidestep.ros.outgoing import Maker
from sidestep.ros.predicted import occupancy_raster
from sidestep.ros.publisher import Publisher
from sidestep.ros.runner import Runner
from sidestep.ros.sensing import MeasuredPeople, ScannedPeople
from sidestep.ros.settings import NodeSettings
from sidestep.ros.wiring import Subscription, subscriptions
from sidestep.simulation.assembly import obstacles_of, planner_of, robot_of
from sidestep.simulation.scenario import Scenario
from sidestep.types import FloatArray, Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class AssembledNode:
    """Everything that a node is made of.

    Attributes:
        core: decides; inputs: what has arrived; runner: threads.
        subscriptions: what to listen to.
    """

    core: Core
    inputs: Inputs
    runner: Runner
    subscriptions: list[Subscription]


class PlannerSource:
    """Makes a planner, and keeps it, with what it has learned of people, while goals and maps change."""

    def __init__(self, settings: NodeSettings) -> None:
        self._settings = settings
        self._map: Map | None = None
        self._planner: Planner | None = None

    def __call__(self, goal: Vector, grid: Map | None) -> Planner:
        """Return a planner that leads to `goal` (2,) m among the walls of `grid`.

        Raises:
            InvalidInput: the goal is inside a wall.
        """
        scenario = scenario_of(self._settings, goal)
        if self._planner is None:
            self._planner = planner_of(scenario, walls_of(scenario, grid))
        elif grid is not self._map:
            self._planner.set_world(goal=goal, obstacles=walls_of(scenario, grid))
        elif not np.array_equal(self._planner.goal, goal):
            self._planner.goal = goal
        self._map = grid
        return self._planner


def assemble(
    settings: NodeSettings,
    *,
    make: Maker,
    send: Callable[[str, Any], None],
    clock: Callable[[], float],
    lookup: Lookup,
) -> AssembledNode:
    """Return a node that is ready to be started.

    Args:
        settings: parameters.
        make: dialect of the messages.
        send: (topic, message) publishes.
        clock: s, the time of stamps.
        lookup: tf.
    """
    node = settings.node
    core, inputs = brain(settings, lookup)
    radius = settings.human.radius

    def raster(plan: Plan, corner: Vector, resolution: float, cells: int) -> FloatArray:
        return occupancy_raster(plan, corner, resolution, cells, radius=radius)

    outlet = Publisher(make=make, send=send, node=node, raster=raster, radius=radius)
    return AssembledNode(
        core=core,
        inputs=inputs,
        runner=Runner(
            settings, core=core, inputs=inputs, outlet=outlet, clock=clock, prepare=lambda: warm_up(settings)
        ),
        subscriptions=subscriptions(settings, core=core, inputs=inputs, clock=clock),
    )


def brain(settings: NodeSettings, lookup: Lookup) -> tuple[Core, Inputs]:
    """Return what decides and what it decides from: a node without threads and topics."""
    node = settings.node
    frames = Frames(
        planning=node.frame, base=node.base_frame, mount=node.scanner_mount, same=node.same_frames, lookup=lookup
    )
    robot = robot_of(scenario_of(settings, np.zeros(2)))
    lead = robot.offset if isinstance(robot, DifferentialDrive) else 0.0
    inputs = Inputs(settings, sensing=sensing_of(settings), frames=frames, lead=lead)
    return Core(settings, inputs=inputs, wheels=robot, make_planner=PlannerSource(settings)), inputs


def warm_up(settings: NodeSettings) -> None:
    """Plan past people who do not exist, so that everything is compiled and loaded before anything moves."""
    planner = PlannerSource(settings)(np.array([5.0, 0.0]), None)
    planner.warm_up()
    planner.warm_up(walled=True)  # a map may come
    measured, scanned = MeasuredPeople(noise=0.05, memory=1.0), ScannedPeople()
    beams = Beams(count=360, angle_min=0.0, angle_increment=np.pi / 180, range_min=0.1, range_max=10.0)
    for step in range(2):
        time = 0.1 * step
        places = np.array([[2.0, 1.0 - time], [3.0 - time, 0.2]])
        measured.people(People(time=time, frame="", ids=None, positions=places), Pose2(), time)
        ranges = np.where(np.arange(360) % 90 < 4, 2.0, np.inf)
        scanned.scan(LaserScan(time=time, frame="", beams=beams, ranges=ranges), Pose2(), time)
        robot = RobotState(position=(0.1 * time, 0.0), heading=0.0, velocity=(0.1, 0.0))
        plan = planner.step(time=time, robot=robot, people=measured.now(time))
        occupancy_raster(plan, np.zeros(2), 0.1, 10, radius=settings.human.radius)


def scenario_of(settings: NodeSettings, goal: Vector) -> Scenario:
    """Return the scenario, without people, that says of robot, planner and people's model what the parameters say."""
    return Scenario(
        name="node",
        robot=settings.robot.model_copy(update={"goal": tuple(goal.tolist())}),
        planner=settings.planner,
        human=settings.human,
        walls=settings.walls,
    )


def walls_of(scenario: Scenario, grid: Map | None) -> Obstacles | None:
    """Return the walls of the parameters and those of the map, or None where there are none."""
    if grid is None or not grid.occupied.any():
        return obstacles_of(scenario)
    cells = OccupancyGrid(
        occupied=np.ascontiguousarray(grid.occupied.T),  # messages have rows along y
        resolution=grid.resolution,
        origin=(grid.origin.x, grid.origin.y),
        yaw=grid.origin.yaw,
    )
    return obstacles_of(scenario, cells)


def sensing_of(settings: NodeSettings) -> Sensing:
    """Return what turns messages into people."""
    if settings.node.people_from == "scan":
        scenario = scenario_of(settings, np.zeros(2))
        walls = partial(walls_of, scenario) if settings.node.map_for_scans else None
        x, y, _ = settings.node.mount
        return ScannedPeople(walls, body=settings.robot.radius + math.hypot(x, y))
    return MeasuredPeople(noise=settings.human.measurement_noise, memory=settings.planner.memory)
