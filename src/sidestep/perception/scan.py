"""What a 2-D scanner delivers: one turn of the mirror, and a recording of many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.types import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Beams:
    """How a scanner looks; the same for all scans of one device.

    Attributes:
        count: B, beams per scan.
        angle_min: rad, bearing of beam 0 in the scanner's frame (x ahead, y to the left).
        angle_increment: rad between neighbouring beams.
        range_min: m; anything nearer is no measurement.
        range_max: m; anything farther is no return.
        time_increment: s between neighbouring beams (0: all at once).

    """

    count: int
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    time_increment: float = 0.0

    @property
    def bearings(self) -> FloatArray:
        """Return the (B,) rad bearings of the beams."""
        return self.angle_min + self.angle_increment * np.arange(self.count, dtype=np.float64)

    @property
    def closed(self) -> bool:
        """Return whether the beams go round, so that the last one neighbours the first."""
        return abs(self.count * self.angle_increment - 2 * np.pi) < 1.5 * self.angle_increment


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scan:
    """One turn of the scanner.

    Attributes:
        time: s, when beam 0 was measured.
        ranges: (B,) m; +inf where nothing came back, NaN where the measurement failed.
        beams: how the scanner looks.
        pose: (3,) x m, y m, yaw rad of the scanner in a fixed frame (odometry) at `time`; None where unknown:
            then the scanner's own frame is taken for the fixed one.

    """

    time: float
    ranges: FloatArray
    beams: Beams
    pose: FloatArray | None = None

    def points(self) -> FloatArray:
        """Return the (B, 2) m end points of the beams in the scanner's frame, NaN where there is none."""
        bearings = self.beams.bearings
        ranges = np.where(self.valid(), self.ranges, np.nan)
        return np.stack((ranges * np.cos(bearings), ranges * np.sin(bearings)), axis=1)

    def valid(self) -> BoolArray:
        """Return the (B,) beams that hit something within the scanner's limits."""
        return (self.ranges > self.beams.range_min) & (self.ranges < self.beams.range_max)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Annotations:
    """Where people were seen by someone who looked at the scans. M entries.

    Attributes:
        scan: (M,) row of the recording.
        person: (M,) identity.
        positions: (M, 2) m, in the scanner's frame at that scan.

    """

    scan: IntArray
    person: IntArray
    positions: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LegLabels:
    """Which beams fell on which leg.

    Attributes:
        scans: (L,) rows of the recording that were looked at.
        beams: (N, B) k > 0: the beam fell on leg k of that scan; 0: unknown, not "no leg".

    """

    scans: IntArray
    beams: IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScanRecording:
    """Consecutive scans of one device, with whatever is known about them. N scans.

    Attributes:
        name: of the recording.
        beams: how the scanner looks.
        times: (N,) s.
        ranges: (N, B) m, as in `Scan`.
        poses: (N, 3) m, m, rad of the scanner in the odometry frame, or None.
        people: annotated positions, or None.
        legs: annotated beams, or None.

    """

    name: str
    beams: Beams
    times: FloatArray
    ranges: FloatArray
    poses: FloatArray | None = None
    people: Annotations | None = None
    legs: LegLabels | None = None

    def __len__(self) -> int:
        return int(self.times.size)

    def scan(self, row: int) -> Scan:
        """Return scan number `row`."""
        pose = None if self.poses is None else self.poses[row]
        return Scan(time=float(self.times[row]), ranges=self.ranges[row], beams=self.beams, pose=pose)
