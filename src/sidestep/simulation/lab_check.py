"""What the tracker says in the lab, held against the truth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sidestep._kernels.ray import cast
from sidestep.human.observation import PersonObservation
from sidestep.perception.clear_mot import ClearMot, MotScore
from sidestep.robots import RobotState
from sidestep.simulation.scene import Scene
from sidestep.types import BoolArray, FloatArray

_FARTHEST = 6.0  # m; people and tracks beyond this do not count: a leg is hardly two beams wide there
_HIDDEN = 0.3  # m; who is this far behind something is hidden


class TrackerCheck:
    """CLEAR MOT over a run, in the robot's own frame, of people as the planner is told of them: present, not past.

    People who are out of range or behind furniture do not count, nor do tracks that stand for them.

    Args:
        scene: what hides people.

    Attributes:
        names: track → index of the person it stands for.
    """

    def __init__(self, scene: Scene) -> None:
        self._segments, self._discs = scene.segments(), scene.discs()
        self._mot = ClearMot()
        self.names: dict[str, int] = {}

    def update(
        self, found: Sequence[PersonObservation], believed: FloatArray, true: FloatArray, bodies: FloatArray
    ) -> None:
        """Count one instant.

        Args:
            found: people as told, in the robot's odometry frame.
            believed: (3,) m, m, rad, pose of the robot in that frame.
            true: (3,) its true pose.
            bodies: (P, 2) m, true positions of everybody, NaN where absent.
        """
        told = _seen_from(np.array([person.position for person in found]).reshape(-1, 2), believed)
        real = _seen_from(bodies, true)
        counts = self._in_sight(bodies, true)
        apart = np.hypot(*(told[:, None] - real[None]).transpose(2, 0, 1))
        elsewhere = np.where(np.isnan(apart) | counts, np.inf, apart) < self._mot.distance
        looked = ~elsewhere.any(axis=1) & (np.hypot(*told.T) < _FARTHEST)
        people, tracks = np.flatnonzero(counts), np.flatnonzero(looked)
        pairs = self._mot.update(
            [int(p) for p in people], real[people], [found[int(t)].id for t in tracks], told[tracks]
        )
        self.names |= pairs

    def score(self) -> MotScore:
        """Return the counts so far."""
        return self._mot.score()

    def _in_sight(self, bodies: FloatArray, true: FloatArray) -> BoolArray:
        away = bodies - true[:2]
        distance = np.hypot(*away.T)
        present = np.isfinite(distance)
        bearings = np.where(present, np.arctan2(away[:, 1], away[:, 0]), 0.0)
        origins = np.repeat(true[None, :2], len(bodies), axis=0)
        free, _, _ = cast(origins, bearings, np.zeros(len(bodies)), self._segments, self._discs, 100.0)
        return present & (distance < _FARTHEST) & (distance < free + _HIDDEN)


def pose_of(state: RobotState) -> FloatArray:
    """Return (3,) x m, y m, yaw rad."""
    return np.array([*state.position, 0.0 if state.heading is None else state.heading])


def _seen_from(points: FloatArray, pose: FloatArray) -> FloatArray:
    """Return points (K, 2) m in the frame of `pose`."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return (points - pose[:2]) @ np.array([[c, -s], [s, c]])
