"""How the robot itself moves, as far as anybody knows: as measured, else reckoned from where it was before."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sidestep.planning.stopping import time_to_stop
from sidestep.robots import Robot, RobotState
from sidestep.types import Vector

_IMPLAUSIBLE = 100.0  # times what the base can do; a velocity beyond is a fault of whoever measured it


class OwnMotion:
    """What the calls so far tell of the robot's own velocity.

    Args:
        robot: the base.
        timeout: s, after which what was known does not count any more.
    """

    def __init__(self, robot: Robot, timeout: float) -> None:
        self._robot = robot
        self._timeout = timeout
        self._was: tuple[float, Vector] | None = None  # s and m, the reference at the last call
        self._mean: Vector | None = None  # m/s, its mean velocity until then, where nobody measures it
        self._reckoned: Vector | None = None  # m/s, its velocity at the last call, as far as positions tell
        self._asked: tuple[float, Vector | None] = (-math.inf, None)  # s and m/s, by the last call; None for a stop
        self._held = self._asked  # what had been asked for until then

    def asks(self, time: float, velocity: Vector | None) -> None:
        """Keep what is asked for at `time` s: (d,) m/s of the reference, or None for a stop."""
        at = time if isinstance(time, float) else math.nan  # what was told may be no time, nor compare with one
        if at != self._asked[0]:
            self._held = self._asked
        self._asked = at, velocity

    def velocity(self, time: float, state: RobotState) -> Vector | None:
        """(d,) m/s, that the robot moves with: as measured where acceleration is limited, else as last asked for."""
        if self._robot.planning_acceleration is not None:
            return self._robot.reference_velocity(state)
        since, velocity = self._held if time == self._asked[0] else self._asked
        if velocity is None or time - since > self._timeout:
            return None
        return velocity

    def time_to_stand(self, state: RobotState, interval: float) -> float:
        """Return how many s the base needs to stand, if asked to `interval` s from now; 0: it can at once."""
        limit, velocity = self._robot.planning_acceleration, self._robot.reference_velocity(state)
        return 0.0 if limit is None or velocity is None else time_to_stop(velocity, limit, interval)

    def completed(self, time: float, measured: RobotState) -> RobotState:
        """Return the state with a velocity where one is needed: as measured, else reckoned since the last call.

        What cannot be a velocity of this base is none, whether one is needed or not.
        """
        before, here = self._was, self._robot.reference(measured)
        if before is None or time != before[0]:  # who is asked again in the same instant knows no more
            self._was = time, here
            self._reckoned = self._since(before, time, here)
        fastest = _IMPLAUSIBLE * self._robot.planning_speed
        told = (
            v
            for v in (measured.velocity, self._reckoned)
            if v is not None and v.shape == here.shape and np.isfinite(v).all() and np.abs(v).max() <= fastest
        )
        return replace(measured, velocity=next(told, None))

    def _since(self, before: tuple[float, Vector] | None, time: float, here: Vector) -> Vector | None:
        """(d,) m/s at `time` s by the way since `before` tells, None where none is needed or known."""
        if self._robot.planning_acceleration is None:
            return None  # the base has whatever velocity it is asked for
        if before is None or not 0.0 < time - before[0] <= self._timeout:
            self._mean = None
            return None
        elapsed = time - before[0]
        return self._reached((here - before[1]) / elapsed, elapsed)

    def _reached(self, mean: Vector, elapsed: float) -> Vector:
        """Return (d,) m/s, the velocity now of a base that moved with `mean` since the last call, `elapsed` s ago.

        Where it speeds up or brakes, the mean lags behind by half of what has changed since the mean before.
        """
        before, self._mean = self._mean, mean
        limit = self._robot.planning_acceleration
        if before is None or limit is None or before.shape != mean.shape:
            return mean
        change = 0.5 * (mean - before)
        size, most = math.hypot(*change.tolist()), 0.5 * limit * elapsed
        return mean + change * min(most / size, 1.0) if size > 0.0 else mean
