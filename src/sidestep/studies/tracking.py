"""How well people are tracked: the score of a tracker on an annotated recording."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.perception.clear_mot import ClearMot, MotScore
from sidestep.perception.scan import Scan, ScanRecording
from sidestep.types import FloatArray

SECTOR_WITH_ODOMETRY = (np.radians(-80.0), np.radians(12.0))
"""rad; in the recordings from a driving robot only people at these bearings are annotated."""


class ScanTracker(Protocol):
    """Anything that turns consecutive scans into people."""

    def update(self, scan: Scan) -> Sequence[PersonObservation]:
        """Take one scan and return the people known at its time, in the frame of its pose."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingScore:
    """The score of one tracker on one recording.

    Attributes:
        recording: its name.
        scans: how many there are.
        mot: CLEAR MOT over the annotated scans; without annotations every report is a false positive.
        annotated_scans: how many scans have at least one annotated person.
        tracks: different identities over the whole recording.
        reports: reported positions over the whole recording.
        milliseconds: mean time per scan; slowest: the 99th percentile.
    """

    recording: str
    scans: int
    mot: MotScore
    annotated_scans: int
    tracks: int
    reports: int
    milliseconds: float
    slowest: float

    def as_dict(self) -> dict[str, Any]:
        """Return all numbers, lengths in m, times in ms."""
        mot = self.mot
        return {
            "recording": self.recording,
            "scans": self.scans,
            "annotated_scans": self.annotated_scans,
            "recall": mot.recall,
            "precision": mot.precision,
            "id_switches": mot.id_switches,
            "error_m": mot.error,
            "rmse_m": mot.rmse,
            "matches": mot.matches,
            "misses": mot.misses,
            "false_positives": mot.false_positives,
            "tracks": self.tracks,
            "reports": self.reports,
            "ms_mean": self.milliseconds,
            "ms_p99": self.slowest,
        }


def score(
    recording: ScanRecording, tracker: ScanTracker, *, sector: tuple[float, float] | None = None
) -> TrackingScore:
    """Run `tracker` over `recording` and count.

    Args:
        recording: with or without annotated people; without, it is taken to show nobody.
        tracker: fresh.
        sector: rad; only bearings between these count. None: all, or `SECTOR_WITH_ODOMETRY` where people were
            annotated from a driving robot.
    """
    if sector is None and recording.poses is not None and recording.people is not None:
        sector = SECTOR_WITH_ODOMETRY
    mot = ClearMot()
    identities: set[str] = set()
    reports, annotated = 0, 0
    durations = np.empty(len(recording))
    for row in range(len(recording)):
        scan = recording.scan(row)
        begin = time.perf_counter()
        found = tracker.update(scan)
        durations[row] = time.perf_counter() - begin
        identities.update(person.id for person in found)
        reports += len(found)
        ids, truth = _truth(recording, row)
        if recording.people is not None and not ids:
            continue
        annotated += bool(ids)
        tracks = [person.id for person in found]
        positions = in_scanner_frame(np.array([person.position for person in found]).reshape(-1, 2), scan.pose)
        seen, looked = _inside(truth, sector), _inside(positions, sector)
        mot.update([ids[i] for i in seen], truth[seen], [tracks[i] for i in looked], positions[looked])
    return TrackingScore(
        recording=recording.name,
        scans=len(recording),
        mot=mot.score(),
        annotated_scans=annotated,
        tracks=len(identities),
        reports=reports,
        milliseconds=1e3 * float(durations.mean()) if durations.size else 0.0,
        slowest=1e3 * float(np.quantile(durations, 0.99)) if durations.size else 0.0,
    )


def in_scanner_frame(points: FloatArray, pose: FloatArray | None) -> FloatArray:
    """Return points (K, 2) m of the fixed frame in the frame of a scanner at `pose` (3,)."""
    if pose is None:
        return points
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return (points - pose[:2]) @ np.array([[c, -s], [s, c]])


def _truth(recording: ScanRecording, row: int) -> tuple[list[int], FloatArray]:
    if recording.people is None:
        return [], np.zeros((0, 2))
    here = np.flatnonzero(recording.people.scan == row)
    return [int(i) for i in recording.people.person[here]], recording.people.positions[here]


def _inside(points: FloatArray, sector: tuple[float, float] | None) -> list[int]:
    if sector is None:
        return list(range(points.shape[0]))
    bearing = np.arctan2(points[:, 1], points[:, 0])
    return [int(i) for i in np.flatnonzero((bearing >= sector[0]) & (bearing <= sector[1]))]
