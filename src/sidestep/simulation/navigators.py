"""Everything that can steer the robot, behind one protocol: same world, same limits, same observations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.types import FloatArray, Status, Vector, frozen_array


class Answer(Protocol):
    """What a navigator answers; a `Plan` is one."""

    @property
    def velocity(self) -> Vector:
        """(d,) m/s, to be applied until the next call."""
        ...

    @property
    def status(self) -> Status:
        """Of a `Plan`; a navigator that certifies nothing says "least_risk" while it moves."""
        ...


@runtime_checkable
class Navigator(Protocol):
    """Anything that turns observations into a velocity; `Planner` is one."""

    def reset(self) -> None:
        """Forget everything that was seen."""
        ...

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Answer:
        """Return the velocity until the next call.

        Args:
            time: s.
            robot: as measured.
            people: as measured, from the past only.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Steering:
    """A bare velocity, without a certificate.

    Attributes:
        velocity: (d,) m/s.
        status: "stopped" when it is zero, else "least_risk".
    """

    velocity: Vector
    status: Status


def steering(velocity: FloatArray, max_speed: float) -> Steering:
    """Return `velocity` ((d,) m/s) within the speed limit (m/s); what is not finite is a stop."""
    v = np.asarray(velocity, dtype=np.float64)
    if not np.isfinite(v).all():
        v = np.zeros_like(v)
    speed = float(np.linalg.norm(v))
    if speed > max_speed:
        v = v * (max_speed / speed)
    return Steering(velocity=frozen_array(v), status="least_risk" if speed > 1e-6 else "stopped")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trip:
    """What every navigator is told before it starts.

    Attributes:
        goal: (d,) m.
        max_speed: m/s, of the velocity (a disc).
        robot_radius, person_radius: m.
        clearance: m between centres that is to be kept.
        risk_limit: probability; for those who compute one.
        time_step: s between two calls.
        walls: closed polygons, each (V, 2) m.
    """

    goal: Vector
    max_speed: float
    robot_radius: float
    person_radius: float
    clearance: float
    risk_limit: float
    time_step: float
    walls: tuple[FloatArray, ...] = ()

    @property
    def margin(self) -> float:
        """Metres of clearance beyond contact."""
        return max(self.clearance - self.robot_radius - self.person_radius, 0.0)

    def preferred(self, position: Vector) -> Vector:
        """(d,) m/s straight to the goal at full speed, slower only where one call would overshoot."""
        gap = self.goal - position
        distance = float(np.linalg.norm(gap))
        return gap * min(self.max_speed / max(distance, 1e-9), 1.0 / self.time_step)


def positions_and_velocities(people: Sequence[PersonObservation], dimension: int) -> tuple[FloatArray, FloatArray]:
    """Return (P, d) m and (P, d) m/s of those people whose position is finite; an unknown velocity is zero."""
    rows = [
        (p.position, p.velocity if p.velocity is not None and np.isfinite(p.velocity).all() else np.zeros(dimension))
        for p in people
        if np.isfinite(p.position).all()
    ]
    if not rows:
        return np.zeros((0, dimension)), np.zeros((0, dimension))
    return np.array([r[0] for r in rows]), np.array([r[1] for r in rows])
