"""Who is there, between two messages: found in scans, or by something else, with a name or without one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from sidestep.human.observation import PersonObservation
from sidestep.obstacles import Obstacles
from sidestep.perception.scan import Scan
from sidestep.perception.table import TrackTable
from sidestep.perception.tracks import Tracker, TrackerSettings
from sidestep.ros.geometry import Pose2
from sidestep.ros.messages import LaserScan, Map, People
from sidestep.types import FloatArray, IntArray

_AGILITY = 1.0  # m²/s³, how fast a walking velocity changes
_FIRST_SPEED = 1.0  # m/s, standard deviation of the velocity of someone new
_FARTHEST = 0.8  # m between where someone was expected and where they may be found again
_FASTEST = 3.0  # m/s, by which nobody strays from there for as long as they were not seen


class ScannedPeople:
    """People whose legs a scanner sees.

    Args:
        walls_of: (map in the planning frame, or None) → walls, which are nobody's legs; None: no walls are known.
        body: m from the scanner, as far as the robot's own body reaches; what is farther away is not the robot.
    """

    def __init__(
        self, walls_of: Callable[[Map | None], Obstacles | None] | None = None, *, body: float = math.inf
    ) -> None:
        self._walls_of = walls_of
        usual = TrackerSettings()
        settings = replace(usual, own_body=min(usual.own_body, body))
        self._tracker = Tracker(settings=settings, walls=walls_of(None) if walls_of else None)

    def map(self, grid: Map) -> None:
        """Take a map in the planning frame; what nobody has seen of it hides nobody."""
        if self._walls_of is not None:
            self._tracker.walls = self._walls_of(grid.as_seen)

    def scan(self, scan: LaserScan, pose: Pose2, time: float) -> None:
        """Take a scan, measured at `time` (s) from `pose` in the planning frame."""
        place = np.array([pose.x, pose.y, pose.yaw])
        self._tracker.update(Scan(time=time, ranges=scan.ranges, beams=scan.beams, pose=place))

    def people(self, people: People, pose: Pose2, time: float) -> None:
        """Measured people are not looked at here."""

    def now(self, time: float) -> list[PersonObservation]:
        """Return everyone, carried forward to `time` (s)."""
        return self._tracker.people(time)

    def clear(self) -> None:
        """Forget everyone."""
        self._tracker.reset()


class MeasuredPeople:
    """People whom something else has found: a PoseArray without identities, or a MarkerArray with them.

    Args:
        noise: m, standard deviation of a measured position.
        memory: s for which someone unseen is expected to come back under the old name.
    """

    def __init__(self, *, noise: float, memory: float) -> None:
        self._variance = max(noise, 1e-3) ** 2
        self._memory = memory
        self._count = 0
        self._names: dict[int, str] = {}
        self.clear()

    def clear(self) -> None:
        """Forget everyone; numbers go on counting."""
        self._tracks = TrackTable()
        self._time = -math.inf
        self._names.clear()

    def map(self, grid: Map) -> None:
        """Whoever has measured people knows walls from legs."""

    def scan(self, scan: LaserScan, pose: Pose2, time: float) -> None:
        """Scans are not looked at here."""

    def people(self, people: People, pose: Pose2, time: float) -> None:
        """Take measured people, given in a frame that lies at `pose`; a message that is older than the last is late."""
        if time < self._time:
            return
        positions = pose.apply(people.positions)
        tracks = self._tracks
        if len(tracks):
            tracks.predict(time - self._time, _AGILITY)
            tracks.unseen = tracks.unseen + (time - self._time)
        self._time = time
        rows = self._expected(positions) if people.ids is None else self._called(people.ids, positions)
        old = rows >= 0
        count = int(old.sum())
        tracks.correct(rows[old], positions[old], np.full(count, self._variance), np.zeros(count))
        tracks.unseen[rows[old]] = 0.0
        self._add(
            positions[~old], None if people.ids is None else [n for n, o in zip(people.ids, old, strict=True) if not o]
        )
        tracks.keep(tracks.unseen <= self._memory)
        self._names = {n: self._names[n] for n in tracks.number.tolist()}

    def now(self, time: float) -> list[PersonObservation]:
        """Return those in the latest message, carried forward to `time` (s)."""
        later = replace(self._tracks)
        if len(later):
            later.predict(max(time - self._time, 0.0), _AGILITY)
        return [
            PersonObservation(
                id=self._names[int(later.number[row])],
                position=later.position[row],
                velocity=later.velocity[row],
                position_covariance=later.covariance[row, 0] * np.eye(2),
                velocity_covariance=later.covariance[row, 2] * np.eye(2),
            )
            for row in np.flatnonzero(later.unseen == 0.0)
        ]

    def _called(self, names: tuple[str, ...], positions: FloatArray) -> IntArray:
        """(P,) rows of those with these names, −1 for the new: who is where nobody could have walked to is another."""
        tracks = self._tracks
        numbered = {self._names[n]: row for row, n in enumerate(tracks.number.tolist())}
        rows = np.array([numbered.get(name, -1) for name in names], dtype=np.int64)
        known = np.flatnonzero(rows >= 0)
        apart = np.linalg.norm(tracks.position[rows[known]] - positions[known], axis=1)
        reach = _FARTHEST + 3.0 * math.sqrt(self._variance) + _FASTEST * tracks.unseen[rows[known]]
        rows[known[apart > reach]] = -1
        return rows

    def _expected(self, positions: FloatArray) -> IntArray:
        """(P,) rows of those who were expected there, −1 for the new."""
        rows = np.full(len(positions), -1, dtype=np.int64)
        if len(self._tracks) and len(positions):
            apart = np.linalg.norm(self._tracks.position[:, None] - positions[None], axis=2)
            for i, j in zip(*linear_sum_assignment(np.minimum(apart, _FARTHEST)), strict=True):
                if apart[i, j] < _FARTHEST:
                    rows[j] = i
        return rows

    def _add(self, positions: FloatArray, names: list[str] | None) -> None:
        count = len(positions)
        numbers = self._count + 1 + np.arange(count, dtype=np.int64)
        self._count += count
        self._tracks.add(numbers, positions, np.full(count, self._variance), _FIRST_SPEED)
        called = [str(n) for n in numbers] if names is None else names
        self._names |= dict(zip(numbers.tolist(), called, strict=True))
