"""Who is there, between two messages: people who come with a name, or without one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from sidestep.human.observation import PersonObservation
from sidestep.ros.geometry import Pose2
from sidestep.ros.messages import LaserScan, People
from sidestep.types import FloatArray, Vector

_WANDERING = 1.0  # m²/s³, how fast a walking velocity changes
_FIRST_SPEED = 1.0  # m/s, standard deviation of the velocity of someone new
_FARTHEST = 0.8  # m between where someone was expected and where they may be found again


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Position and velocity of one person, by a constant-velocity Kalman filter whose axes do not mix.

    Attributes:
        time: s.
        position: (2,) m; velocity: (2,) m/s.
        covariance: (2, 2) of position and velocity along either axis.
    """

    time: float
    position: Vector
    velocity: Vector
    covariance: FloatArray

    @classmethod
    def first(cls, time: float, position: Vector, noise: float) -> Motion:
        """Someone new, measured with a standard deviation of `noise` m."""
        return cls(time=time, position=position, velocity=np.zeros(2), covariance=np.diag([noise**2, _FIRST_SPEED**2]))

    def at(self, time: float) -> Motion:
        """Carried forward to `time` s."""
        dt = max(time - self.time, 0.0)
        move = np.array([[1.0, dt], [0.0, 1.0]])
        noise = _WANDERING * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        return Motion(
            time=max(time, self.time),
            position=self.position + dt * self.velocity,
            velocity=self.velocity,
            covariance=move @ self.covariance @ move.T + noise,
        )

    def measured(self, time: float, position: Vector, noise: float) -> Motion:
        """After a measurement at `time` s; one that is older than the last is left out."""
        if time < self.time:
            return self
        ahead = self.at(time)
        gain = ahead.covariance[:, 0] / (ahead.covariance[0, 0] + noise**2)
        surprise = position - ahead.position
        return Motion(
            time=time,
            position=ahead.position + gain[0] * surprise,
            velocity=ahead.velocity + gain[1] * surprise,
            covariance=ahead.covariance - np.outer(gain, ahead.covariance[0]),
        )

    def observation(self, name: str) -> PersonObservation:
        """What a planner is told."""
        return PersonObservation(
            id=name,
            position=self.position,
            velocity=self.velocity,
            position_covariance=self.covariance[0, 0] * np.eye(2),
            velocity_covariance=self.covariance[1, 1] * np.eye(2),
        )


class MeasuredPeople:
    """People whom something else has found: a PoseArray without identities, or a MarkerArray with them.

    Args:
        noise: m, standard deviation of a measured position.
        memory: s for which someone unseen is expected to come back under the old name.
    """

    def __init__(self, *, noise: float, memory: float) -> None:
        self._noise = max(noise, 1e-3)
        self._memory = memory
        self._people: dict[str, Motion] = {}
        self._latest = -np.inf
        self._names = 0

    def people(self, people: People, pose: Pose2, time: float) -> None:
        """Take measured people, given in a frame that lies at `pose`."""
        if time < self._latest:
            return
        self._latest = time
        positions = pose.apply(people.positions)
        names = self._named(positions, time) if people.ids is None else list(people.ids)
        for name, position in zip(names, positions, strict=True):
            known = self._people.get(name)
            self._people[name] = (
                Motion.first(time, position, self._noise)
                if known is None
                else known.measured(time, position, self._noise)
            )
        self._people = {n: m for n, m in self._people.items() if time - m.time <= self._memory}

    def scan(self, scan: LaserScan, pose: Pose2, time: float) -> None:
        """Scans are not looked at here."""

    def now(self, time: float) -> list[PersonObservation]:
        """Return those in the latest message, carried forward to `time`."""
        return [m.at(time).observation(name) for name, m in self._people.items() if m.time >= self._latest]

    def clear(self) -> None:
        """Forget everyone."""
        self._people.clear()
        self._latest = -np.inf

    def _named(self, positions: FloatArray, time: float) -> list[str]:
        """Names for positions without any: of whoever was expected there, or new ones."""
        known = list(self._people)
        names = [""] * len(positions)
        if known and len(positions):
            expected = np.array([self._people[name].at(time).position for name in known])
            apart = np.linalg.norm(expected[:, None] - positions[None], axis=2)
            for i, j in zip(*linear_sum_assignment(np.minimum(apart, _FARTHEST)), strict=True):
                if apart[i, j] < _FARTHEST:
                    names[j] = known[i]
        return [name or self._new_name() for name in names]

    def _new_name(self) -> str:
        self._names += 1
        return f"person {self._names}"
