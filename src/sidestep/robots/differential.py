"""A base with two driven wheels on one axle (Eq. 10)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep.checks import WIDEST, Checks
from sidestep.errors import InvalidInput
from sidestep.robots.state import RobotState
from sidestep.types import Shape, Vector, VectorLike, sealed


@dataclass(frozen=True, slots=True, kw_only=True)
class DifferentialDrive:
    """Two driven wheels on one axle (Eq. 10): v = cosθ·u_x + sinθ·u_y, ω = (−sinθ·u_x + cosθ·u_y)/ℓ.

    The reference lies `reference_offset` ahead of the axle. Planning asks at most `planning_speed` of it, in any
    direction: a disc that lies within the limits at every heading, so what is planned can be executed exactly. The
    base's own loop turns the planned velocity into (v, ω) every `control_period` s, each held constant: the reference
    leaves the straight line by at most (speed·control_period)²/(8·ℓ) within a period and is back on it at its end.

    Attributes:
        max_speed: m/s, |v|; max_turn_rate: rad/s, |ω|.
        radius: m, of the footprint around the middle of the axle (≤ 100).
        reference_offset: m, ℓ; None takes max_speed/max_turn_rate within [0.05, 0.3], which wastes no speed.
        max_acceleration: m/s² of v, or None; max_turn_acceleration: rad/s² of ω, or None.
        control_period: s, of the base's own loop.
    """

    max_speed: float = 0.7
    max_turn_rate: float = 3.14
    radius: float = 0.18
    reference_offset: float | None = None
    max_acceleration: float | None = None
    max_turn_acceleration: float | None = None
    control_period: float = 0.05

    def __post_init__(self) -> None:
        check = Checks(self, "robot")
        check.numbers("max_speed", above=0.0, unit="m/s")
        check.numbers("max_turn_rate", above=0.0, unit="rad/s")
        check.numbers("radius", above=0.0, most=WIDEST, unit="m")
        check.numbers("reference_offset", above=0.0, most=WIDEST, unit="m", optional=True)
        check.numbers("max_acceleration", above=0.0, unit="m/s²", optional=True)
        check.numbers("max_turn_acceleration", above=0.0, unit="rad/s²", optional=True)
        check.numbers("control_period", above=0.0, unit="s")

    @property
    def shape(self) -> Shape:
        """The admissible velocities of the reference form a disc."""
        return "disc"

    @property
    def offset(self) -> float:
        """m, ℓ from the axle to the reference."""
        if self.reference_offset is not None:
            return self.reference_offset
        return min(max(self.max_speed / self.max_turn_rate, 0.05), 0.3)

    @property
    def planning_speed(self) -> float:
        """m/s that planning may ask of the reference in any direction: |v| ≤ u and |ω| ≤ u/ℓ for every heading."""
        return min(self.max_speed, self.offset * self.max_turn_rate)

    @property
    def planning_radius(self) -> float:
        """m, of a disc around the reference that covers the robot at every heading."""
        return self.radius + self.offset

    @property
    def wall_margin(self) -> float:
        """m, that the reference keeps from walls: √(radius² + ℓ²).

        The axle goes straight toward the reference, ℓ ahead of it. It comes nearer to a place r away only while that
        lies less than 90° off this way, and then the reference is less than √(r² + ℓ²) from that place. So the body
        comes into no wall while it drives forward; what it does until the next call is judged itself
        (`planning.body`), and when it backs up that is what counts.
        """
        return math.hypot(self.radius, self.offset)

    @property
    def planning_acceleration(self) -> float | None:
        """m/s² that planning may ask of the reference in any direction; what turning itself needs is left out."""
        limits = [a for a in (self.max_acceleration,) if a is not None]
        if self.max_turn_acceleration is not None:
            limits.append(self.max_turn_acceleration * self.offset)
        return min(limits) if limits else None

    def reference(self, state: RobotState) -> Vector:
        """Return the (2,) m point that planning moves."""
        return sealed(state.position + self.offset * _direction(_heading(state)))

    def reference_velocity(self, state: RobotState) -> Vector | None:
        """Return the (2,) m/s velocity of the reference, None when unknown."""
        return state.velocity

    def limited(self, velocity: VectorLike) -> Vector:
        """Return `velocity` (2,) m/s of the reference scaled into the disc that is executable at every heading."""
        u = np.asarray(velocity, dtype=np.float64)
        speed = float(np.linalg.norm(u))
        return u if speed <= self.planning_speed else u * (self.planning_speed / speed)

    def command(self, velocity: VectorLike, state: RobotState, *, hold: float = 0.0) -> Vector:
        """Return (v, ω) in m/s and rad/s that give the reference a velocity (2,) m/s.

        Args:
            velocity: wanted; scaled into the limits with its direction kept.
            state: with heading.
            hold: s for which the command will be held. At 0 it is Eq. 10, exact at this instant; else the (v, ω)
                whose arc ends where the straight motion would.
        """
        heading = _heading(state)
        u = np.asarray(velocity, dtype=np.float64)
        along = math.cos(heading) * float(u[0]) + math.sin(heading) * float(u[1])
        across = -math.sin(heading) * float(u[0]) + math.cos(heading) * float(u[1])
        v, turn = along, across / self.offset
        if hold > 0.0:
            v, turn = _arc(along * hold, across * hold, self.offset, hold, (v, turn))
        excess = max(abs(v) / self.max_speed, abs(turn) / self.max_turn_rate, 1.0)
        return np.array([v / excess, turn / excess])

    def executed(self, command: VectorLike, state: RobotState, dt: float) -> RobotState:
        """Return the state after (v, ω) was held for `dt` s: an exact arc.

        Args:
            command: (v, ω), scaled into the limits; where accelerations are limited and `state.velocity` is known, into
                what they leave.
            state: with heading.
            dt: s.
        """
        v, turn = (float(x) for x in command)
        excess = max(abs(v) / self.max_speed, abs(turn) / self.max_turn_rate, 1.0)
        v, turn = v / excess, turn / excess
        heading = _heading(state)
        if state.velocity is not None:
            v, turn = self._ramped((v, turn), self._twist(state), dt)
        end = heading + turn * dt
        if abs(turn * dt) < 1e-9:
            shift = v * dt * _direction(heading + 0.5 * turn * dt)
        else:
            turned = np.array([math.sin(end) - math.sin(heading), math.cos(heading) - math.cos(end)])
            shift = v / turn * turned
        velocity = v * _direction(end) + turn * self.offset * _direction(end + 0.5 * math.pi)
        return RobotState(position=state.position + shift, heading=end, velocity=velocity)

    def follow(self, velocity: VectorLike, state: RobotState, dt: float) -> RobotState:
        """Return the state after the base's own loop made the reference follow a velocity (2,) m/s for `dt` s.

        Every `control_period` the loop aims at where the reference should be at the end of the period.
        """
        u = self.limited(velocity)
        target = self.reference(state)
        periods = max(1, math.ceil(dt / self.control_period - 1e-9))
        step = dt / periods
        for _ in range(periods):
            target = target + u * step
            command = self.command((target - self.reference(state)) / step, state, hold=step)
            state = self.executed(command, state, step)
        return state

    def _twist(self, state: RobotState) -> tuple[float, float]:
        """(v, ω) that the state's velocity tells of."""
        assert state.velocity is not None
        heading = _heading(state)
        across = float(_direction(heading + 0.5 * math.pi) @ state.velocity)
        return float(_direction(heading) @ state.velocity), across / self.offset

    def _ramped(self, wanted: tuple[float, float], before: tuple[float, float], dt: float) -> tuple[float, float]:
        """(v, ω) that the limits on acceleration leave after `dt` s, the direction of the change kept."""
        steps = (wanted[0] - before[0], wanted[1] - before[1])
        limits = (self.max_acceleration, self.max_turn_acceleration)
        excess = max([1.0] + [abs(s) / (a * dt) for s, a in zip(steps, limits, strict=True) if a is not None])
        return before[0] + steps[0] / excess, before[1] + steps[1] / excess


def _arc(along: float, across: float, offset: float, time: float, guess: tuple[float, float]) -> tuple[float, float]:
    """(v, ω) held for `time` that move a point `offset` ahead of the axle by (along, across), both in the axle's frame.

    Newton's method; where it does not settle (a chord longer than the turn allows) the guess is returned.
    """
    v, turn = guess
    for _ in range(12):
        a = turn * time
        sine, cosine = math.sin(a), math.cos(a)
        if abs(a) < 1e-4:
            s, c = 1.0 - a * a / 6.0, 0.5 * a - a**3 / 24.0
            ds, dc = -a / 3.0, 0.5 - a * a / 8.0
        else:
            s, c = sine / a, (1.0 - cosine) / a
            ds, dc = (cosine - s) / a, (sine - c) / a
        x = v * time * s + offset * (cosine - 1.0) - along
        y = v * time * c + offset * sine - across
        if abs(x) + abs(y) < 1e-12:
            return v, turn
        j11, j12 = time * s, (v * time * ds - offset * sine) * time
        j21, j22 = time * c, (v * time * dc + offset * cosine) * time
        determinant = j11 * j22 - j12 * j21
        if abs(determinant) < 1e-12:
            return guess
        v -= (j22 * x - j12 * y) / determinant
        turn -= (j11 * y - j21 * x) / determinant
    return (v, turn) if abs(turn * time) < math.pi else guess


def _direction(heading: float) -> Vector:
    return np.array([math.cos(heading), math.sin(heading)])


def _heading(state: RobotState) -> float:
    if state.heading is None:
        raise InvalidInput("robot.heading", None, "a number (rad)", "a DifferentialDrive needs RobotState(heading=…)")
    return state.heading
