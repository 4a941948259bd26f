"""ORCA: optimal reciprocal collision avoidance, by its reference implementation (RVO2 through pyrvo)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sidestep.errors import MissingExtra
from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.simulation.navigators import Steering, Trip, positions_and_velocities, steering
from sidestep.types import FloatArray

NEIGHBOUR_DISTANCE = 15.0  # m, beyond which nobody is avoided


class Orca:
    """The robot as an ORCA agent that takes everybody else for one."""

    def __init__(self, trip: Trip, *, horizon: float = 4.0, wall_horizon: float = 2.0) -> None:
        """Prepare.

        Args:
            trip: goal and limits; the clearance is kept by a larger radius.
            horizon: s within which no person may be hit.
            wall_horizon: s within which no wall may be hit.
        """
        self._trip = trip
        self._horizon = horizon
        self._wall_horizon = wall_horizon
        self._rvo = load_rvo()
        self._velocity = np.zeros(2)

    def reset(self) -> None:
        """Forget the last velocity."""
        self._velocity = np.zeros(2)

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Steering:
        """Return the velocity nearest to straight-on outside all velocity obstacles."""
        del time
        trip = self._trip
        simulator = new_simulator(self._rvo, trip.time_step, trip.walls, self._horizon, self._wall_horizon)
        own = self._velocity if robot.velocity is None else robot.velocity
        add_agent(simulator, robot.position, own, trip.robot_radius + trip.margin, trip.max_speed)
        simulator.set_agent_pref_velocity(0, tuple(map(float, trip.preferred(robot.position))))
        where, pace = positions_and_velocities(people, 2)
        for x, v in zip(where, pace, strict=True):
            add_agent(simulator, x, v, trip.person_radius, max(float(np.linalg.norm(v)), 0.1))
        simulator.do_step()
        answer = steering(as_vector(simulator.get_agent_velocity(0)), trip.max_speed)
        self._velocity = np.array(answer.velocity)
        return answer


def load_rvo() -> Any:
    """Return the module of the reference implementation.

    Raises:
        MissingExtra: it is not installed.
    """
    try:
        import pyrvo
    except ImportError:
        raise MissingExtra("ORCA", "peers") from None
    return pyrvo


def new_simulator(rvo: Any, time_step: float, walls: Sequence[FloatArray], horizon: float, wall_horizon: float) -> Any:
    """Return a simulator without agents; each wall a closed polygon (V, 2) m, counter-clockwise where it is solid."""
    simulator = rvo.RVOSimulator()
    simulator.set_time_step(time_step)
    simulator.set_agent_defaults(NEIGHBOUR_DISTANCE, 20, horizon, wall_horizon, 0.3, 1.0)
    for wall in walls:
        simulator.add_obstacle([tuple(map(float, corner)) for corner in counter_clockwise(wall)])
    if walls:
        simulator.process_obstacles()
    return simulator


def add_agent(simulator: Any, position: FloatArray, velocity: FloatArray, radius: float, max_speed: float) -> int:
    """Add one agent ((2,) m, (2,) m/s) that wants to keep its velocity; return its number."""
    number = simulator.add_agent(tuple(map(float, position)))
    v = tuple(map(float, velocity))
    simulator.set_agent_velocity(number, v)
    simulator.set_agent_pref_velocity(number, v)
    simulator.set_agent_radius(number, radius)
    simulator.set_agent_max_speed(number, max_speed)
    return number


def counter_clockwise(polygon: FloatArray) -> FloatArray:
    """Return the corners (V, 2) in counter-clockwise order."""
    x, y = polygon[:, 0], polygon[:, 1]
    area = float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    return polygon if area > 0 else polygon[::-1]


def as_vector(value: Any) -> FloatArray:
    """Return the simulator's own vector as (2,)."""
    return np.array([value.x, value.y]) if hasattr(value, "x") else np.array(value, dtype=np.float64)
