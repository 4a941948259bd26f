"""HL, HRVO, ORCA and social force as navground implements them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sidestep.checks import one_of
from sidestep.errors import MissingExtra
from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.simulation.navigators import Steering, Trip, positions_and_velocities, steering
from sidestep.types import FloatArray

BEHAVIORS = ("HL", "HRVO", "ORCA", "SocialForce")


class Navground:
    """One of navground's behaviours at the wheel.

    HL: human-like (Guzzi et al., 2013); HRVO: hybrid reciprocal velocity obstacles (Snape et al., 2011); SocialForce:
    Helbing and Molnár (1995).
    """

    def __init__(self, trip: Trip, behavior: str, *, horizon: float = 5.0) -> None:
        """Prepare.

        Args:
            trip: goal and limits; the clearance is navground's safety margin.
            behavior: one of `BEHAVIORS`.
            horizon: m, how far ahead it looks.

        Raises:
            MissingExtra: navground is not installed.
            UnknownName: there is no such behaviour.
        """
        one_of("behavior", [behavior], BEHAVIORS)
        self._trip = trip
        self._core = load_navground()
        self._behavior_name = behavior
        self._horizon = horizon
        self._behavior = self._new()
        self._velocity = np.zeros(2)

    def reset(self) -> None:
        """Forget the last velocity."""
        self._behavior = self._new()
        self._velocity = np.zeros(2)

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Steering:
        """Return what the behaviour commands."""
        del time
        trip, core, behavior = self._trip, self._core, self._behavior
        behavior.position = robot.position
        behavior.velocity = self._velocity if robot.velocity is None else robot.velocity
        where, pace = positions_and_velocities(people, 2)
        behavior.environment_state.neighbors = neighbours(core, where, pace, trip.person_radius)
        behavior.target = core.Target.Point(np.array(trip.goal))
        behavior.optimal_speed = float(np.linalg.norm(trip.preferred(robot.position)))
        answer = steering(command(behavior, trip.time_step), trip.max_speed)
        self._velocity = np.array(answer.velocity)
        return answer

    def _new(self) -> Any:
        trip = self._trip
        behavior = new_behavior(self._core, self._behavior_name, trip.max_speed, trip.robot_radius, trip.walls)
        behavior.horizon = self._horizon
        behavior.safety_margin = trip.margin
        return behavior


def load_navground() -> Any:
    """Return navground's core module.

    Raises:
        MissingExtra: it is not installed.
    """
    try:
        from navground import core
    except ImportError:
        raise MissingExtra("navground's behaviours", "peers") from None
    return core


def new_behavior(core: Any, name: str, max_speed: float, radius: float, walls: Sequence[FloatArray]) -> Any:
    """Return a holonomic agent (m/s, m) that never turns, so that its frame is the world's, with walls (V, 2) m."""
    behavior = core.Behavior.make_type(name)
    behavior.kinematics = core.kinematics.OmnidirectionalKinematics(max_speed, 1.0)
    behavior.heading_behavior = core.Behavior.Heading.idle
    behavior.radius = radius
    behavior.optimal_speed = max_speed
    edges = [
        core.LineSegment(np.array(a, dtype=float), np.array(b, dtype=float))
        for wall in walls
        for a, b in zip(wall, np.roll(wall, -1, axis=0), strict=True)
    ]
    behavior.environment_state.line_obstacles = edges
    return behavior


def neighbours(core: Any, positions: FloatArray, velocities: FloatArray, radius: float) -> list[Any]:
    """Return navground's view of people at (P, 2) m with (P, 2) m/s."""
    return [
        core.Neighbor(position=x, radius=radius, velocity=v, id=i + 1)
        for i, (x, v) in enumerate(zip(positions, velocities, strict=True))
    ]


def command(behavior: Any, time_step: float) -> FloatArray:
    """Return the commanded velocity (2,) m/s in the world frame."""
    return np.asarray(behavior.compute_cmd(time_step).velocity, dtype=np.float64)
