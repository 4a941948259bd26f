"""A base that moves in any direction at once (Eq. 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep.checks import WIDEST, Checks
from sidestep.robots.state import RobotState
from sidestep.types import Shape, Vector, VectorLike, sealed


def diagonal(shape: Shape, dimension: int) -> float:
    """Return how many times its limit a base's speed can be: where every axis is limited by itself, askew to them."""
    return math.sqrt(dimension) if shape == "box" else 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Holonomic:
    """Moves in any direction at once (Eq. 3).

    Attributes:
        max_speed: m/s; of every axis with shape "box" (the paper), of the norm with "disc".
        radius: m, of the footprint around the centre (≤ 100).
        shape: "box" or "disc".
        max_acceleration: m/s², or None for no limit.
    """

    max_speed: float = 1.0
    radius: float = 0.3
    shape: Shape = "box"
    max_acceleration: float | None = None

    def __post_init__(self) -> None:
        check = Checks(self, "robot")
        check.numbers("max_speed", above=0.0, unit="m/s")
        check.numbers("radius", above=0.0, most=WIDEST, unit="m")
        check.numbers("max_acceleration", above=0.0, unit="m/s²", optional=True)
        check.words("shape", Shape)

    @property
    def planning_speed(self) -> float:
        """m/s that planning may ask of the reference, per axis or as norm (see `shape`)."""
        return self.max_speed

    @property
    def planning_radius(self) -> float:
        """m, of a disc around the reference that covers the robot at every heading."""
        return self.radius

    @property
    def wall_margin(self) -> float:
        """m, that the reference keeps from walls."""
        return self.radius

    @property
    def planning_acceleration(self) -> float | None:
        """m/s² that planning may ask of the reference."""
        return self.max_acceleration

    def reference(self, state: RobotState) -> Vector:
        """Return the (d,) m point that planning moves."""
        return state.position

    def reference_velocity(self, state: RobotState) -> Vector | None:
        """Return the (d,) m/s velocity of the reference, None when unknown."""
        return state.velocity

    def limited(self, velocity: VectorLike) -> Vector:
        """Return `velocity` (d,) m/s scaled into the speed limit, its direction kept."""
        u = np.asarray(velocity, dtype=np.float64)
        fastest = max(map(abs, u.tolist())) if self.shape == "box" else math.sqrt(u.dot(u))
        return u if fastest <= self.max_speed else u * (self.max_speed / fastest)

    def command(self, velocity: VectorLike, state: RobotState, *, hold: float = 0.0) -> Vector:
        """Return what the base takes: the velocity itself, (d,) m/s, within the limits."""
        del state, hold
        return self.limited(velocity)

    def executed(self, command: VectorLike, state: RobotState, dt: float) -> RobotState:
        """Return the state after `command` (d,) m/s has been applied for `dt` s.

        With limited acceleration the velocity ramps straight from `state.velocity` to the command.
        """
        u = self.limited(command)
        heading = state.heading
        if self.max_acceleration is None or state.velocity is None:
            return RobotState(position=sealed(state.position + u * dt), heading=heading, velocity=u)
        change = u - state.velocity
        size = float(np.linalg.norm(change))
        ramp = size / self.max_acceleration
        if ramp <= dt:
            position = state.position + u * dt - 0.5 * change * ramp
            return RobotState(position=position, heading=heading, velocity=u)
        rate = change * (self.max_acceleration / size)
        position = state.position + state.velocity * dt + 0.5 * rate * dt * dt
        return RobotState(position=position, heading=heading, velocity=state.velocity + rate * dt)

    def follow(self, velocity: VectorLike, state: RobotState, dt: float) -> RobotState:
        """Return the state after the base has followed a planned velocity (d,) m/s for `dt` s."""
        return self.executed(velocity, state, dt)
