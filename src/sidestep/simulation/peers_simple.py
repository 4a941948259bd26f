"""Opponents that need nothing but numpy: stop-and-go, and constant velocity with a chance constraint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr

from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.simulation.navigators import Steering, Trip, positions_and_velocities, steering
from sidestep.simulation.walls import WallEdges
from sidestep.types import FloatArray, Vector


class StopAndGo:
    """Straight to the goal at full speed; stands while a person is, or would come, too close within `look_ahead` s."""

    def __init__(self, trip: Trip, *, look_ahead: float = 2.0) -> None:
        self._trip = trip
        self._look_ahead = look_ahead

    def reset(self) -> None:
        """Nothing is remembered."""

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Steering:
        """Return full speed or none."""
        del time
        trip = self._trip
        wanted = trip.preferred(robot.position)
        where, pace = positions_and_velocities(people, robot.position.size)
        gap = where - robot.position
        closest = closest_approach(gap, pace - wanted, self._look_ahead)
        ahead = (gap * wanted).sum(axis=1) > 0
        blocked = bool(((closest < trip.clearance) & (ahead | (closest < np.linalg.norm(gap, axis=1) - 1e-9))).any())
        return steering(np.zeros_like(wanted) if blocked else wanted, trip.max_speed)


class ConstantVelocityChance:
    """Candidate velocities against people who keep theirs with growing Gaussian doubt; awareness ignored.

    A candidate is admissible when, at every instant of the horizon, P(person beyond the half-plane at `clearance`) is
    within the limit: Φ((clearance − distance)/σ(t)), the linearised chance constraint of Zhu and Alonso-Mora (2019).
    Among the admissible ones the one nearest to straight-on is taken; without any, the one of least risk.
    """

    def __init__(
        self,
        trip: Trip,
        *,
        horizon: float = 3.0,
        interval: float = 0.2,
        position_sigma: float = 0.1,
        velocity_sigma: float = 0.2,
        directions: int = 32,
        speeds: int = 4,
    ) -> None:
        self._trip = trip
        self._times = np.arange(1, round(horizon / interval) + 1) * interval  # (K,) s
        self._sigma = np.hypot(position_sigma, velocity_sigma * self._times)  # (K,) m
        self._walls = WallEdges(trip.walls)
        angles = 2 * np.pi * np.arange(directions) / directions
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        levels = trip.max_speed * np.arange(1, speeds + 1) / speeds
        self._candidates = np.concatenate([(rays[:, None] * levels[:, None]).reshape(-1, 2), np.zeros((1, 2))])

    def reset(self) -> None:
        """Nothing is remembered."""

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Steering:
        """Return the best admissible candidate."""
        del time
        trip, x = self._trip, robot.position
        wanted = trip.preferred(x)
        candidates = np.concatenate([self._candidates, wanted[None]])
        risk = self._risk(candidates, x, *positions_and_velocities(people, 2))
        paths = x + candidates[:, None] * self._times[:, None]  # (A, K, 2) m
        standing = ~candidates.any(axis=1)  # is always possible
        blocked = (self._walls.distance(paths) < trip.robot_radius).any(axis=1) & ~standing
        cost = np.linalg.norm(candidates - wanted, axis=1)
        admissible = ~blocked & (risk <= trip.risk_limit)
        if admissible.any():
            best = int(np.argmin(np.where(admissible, cost, np.inf)))
        else:
            best = int(np.argmin(np.where(blocked, np.inf, risk + 1e-3 * cost)))
        return steering(candidates[best], trip.max_speed)

    def _risk(self, candidates: FloatArray, x: Vector, where: FloatArray, pace: FloatArray) -> FloatArray:
        """(A,) the largest over people and instants of the linearised collision probability."""
        if not len(where):
            return np.zeros(len(candidates))
        relative = pace[:, None] - candidates[None]  # (P, A, 2) m/s
        gap = (where - x)[:, None, None] + relative[:, :, None] * self._times[:, None]  # (P, A, K, 2) m
        distance = np.sqrt((gap**2).sum(axis=-1))
        return ndtr((self._trip.clearance - distance) / self._sigma).max(axis=(0, 2))


def closest_approach(gap: FloatArray, relative: FloatArray, horizon: float) -> FloatArray:
    """Return (P,) m, the smallest |gap + t·relative| for 0 ≤ t ≤ horizon; gap (P, d) m, relative (P, d) m/s."""
    square = (relative**2).sum(axis=1)
    t = np.clip(-(gap * relative).sum(axis=1) / np.maximum(square, 1e-12), 0.0, horizon)
    return np.linalg.norm(gap + t[:, None] * relative, axis=1)
