"""The least that can be called a leg tracker: the yardstick for the real one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from sidestep.human.observation import PersonObservation
from sidestep.perception.clusters import find_clusters
from sidestep.perception.scan import Scan
from sidestep.types import FloatArray

_WIDTH = (0.05, 0.25)  # m; a leg
_PAIR = 0.5  # m between two legs of one person
_GATE = 0.6  # m from the predicted position
_HITS = 3  # before a track is reported
_LIFE = 1.0  # s without a detection


@dataclass(slots=True)
class _Track:
    id: str
    state: FloatArray  # (4,) m, m/s
    covariance: FloatArray  # (4, 4)
    seen: float  # s
    hits: int = 1


class TrivialTracker:
    """Clusters 0.05 m to 0.25 m wide, paired, nearest neighbour, constant-velocity Kalman filter.

    A pair starts a track, a pair or a single leg carries it on. Odometry is not used.
    """

    def __init__(self) -> None:
        self._tracks: list[_Track] = []
        self._time = 0.0
        self._count = 0

    def update(self, scan: Scan) -> list[PersonObservation]:
        """Take one scan; return the tracks seen at least three times, in the scanner's frame."""
        duration, self._time = scan.time - self._time, scan.time
        for track in self._tracks:
            _predict(track, duration)
        free, pairs = _detections(scan)
        for track in sorted(self._tracks, key=lambda t: -t.hits):
            if len(free) == 0:
                break
            distance = np.hypot(*(free - track.state[:2]).T)
            nearest = int(np.argmin(distance))
            if distance[nearest] < _GATE:
                _correct(track, free[nearest], scan.time)
                free = np.delete(free, nearest, axis=0)
                pairs -= nearest < pairs
        self._tracks = [t for t in self._tracks if scan.time - t.seen < _LIFE]
        for detection in free[:pairs]:
            self._count += 1
            state = np.array([*detection, 0.0, 0.0])
            self._tracks.append(_Track(str(self._count), state, np.diag([0.01, 0.01, 1.0, 1.0]), scan.time))
        return [
            PersonObservation(id=t.id, position=t.state[:2], velocity=t.state[2:])
            for t in self._tracks
            if t.hits >= _HITS
        ]


def _detections(scan: Scan) -> tuple[FloatArray, int]:
    """Return (K, 2) m: middles of nearest pairs of leg-sized clusters, then single ones; and how many are pairs."""
    clusters = find_clusters(scan)
    width = clusters.feature("width")
    legs = clusters.centroids[(width >= _WIDTH[0]) & (width <= _WIDTH[1])]
    apart = cdist(legs, legs)
    single = np.ones(len(legs), dtype=np.bool_)
    found: list[FloatArray] = []
    pairs = np.argwhere(np.triu(apart < _PAIR, k=1))
    for i, j in sorted(pairs.tolist(), key=lambda pair: apart[pair[0], pair[1]]):
        if single[i] and single[j]:
            single[i] = single[j] = False
            found.append((legs[i] + legs[j]) / 2)
    return np.concatenate((np.array(found).reshape(-1, 2), legs[single])), len(found)


def _predict(track: _Track, duration: float) -> None:
    step = np.eye(4) + duration * np.eye(4, k=2)
    noise = np.diag([duration**3 / 3] * 2 + [duration] * 2) + duration**2 / 2 * (np.eye(4, k=2) + np.eye(4, k=-2))
    track.state = step @ track.state
    track.covariance = step @ track.covariance @ step.T + 2.0 * noise


def _correct(track: _Track, position: FloatArray, time: float) -> None:
    gain = track.covariance[:, :2] @ np.linalg.inv(track.covariance[:2, :2] + 0.01 * np.eye(2))
    track.state = track.state + gain @ (position - track.state[:2])
    track.covariance = track.covariance - gain @ track.covariance[:2]
    track.seen, track.hits = time, track.hits + 1
