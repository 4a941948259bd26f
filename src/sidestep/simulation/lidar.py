"""What a 2-D scanner sees: walls, furniture and legs, with noise, missing returns and a mirror that takes its time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep._kernels.ray import cast
from sidestep.perception.scan import Beams, Scan
from sidestep.simulation.scene import Scene
from sidestep.types import FloatArray, IntArray

_GRAZING = 0.08  # |cos|; light that meets a surface flatter than this often does not come back
_EDGE = 0.10  # m; a beam that meets two surfaces this far apart may report something in between


RPLIDAR_A2M8 = Beams(
    count=800,
    angle_min=-np.pi,
    angle_increment=2 * np.pi / 800,
    range_min=0.15,
    range_max=10.0,
    time_increment=0.1 / 800,
)
"""The LoCoBot's scanner at 10 turns per second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scanner:
    """A scanner and its errors. The defaults are those of an RPLidar A2M8 at 10 Hz: 800 beams all round, 10 m.

    Attributes:
        beams: how it looks.
        rate: Hz, turns per second.
        noise: m, standard deviation of a range, plus `noise_share` of the range.
        noise_share: see `noise`.
        missing: probability that a beam gets no return although something is there.
        failed: probability that a measurement fails (NaN), as in sunlight.
        mixed: probability that a beam on an edge reports a range between the two surfaces.
        spurious: probability of a return from where nothing is (dust, grass, rain).
    """

    beams: Beams = RPLIDAR_A2M8
    rate: float = 10.0
    noise: float = 0.004
    noise_share: float = 0.003
    missing: float = 0.02
    failed: float = 0.0
    mixed: float = 0.3
    spurious: float = 0.0005

    def sense(
        self,
        scene: Scene,
        legs: FloatArray,
        pose: FloatArray,
        twist: FloatArray,
        time: float,
        generator: np.random.Generator,
    ) -> tuple[Scan, IntArray]:
        """Return one scan, and what each beam truly hit.

        Args:
            scene: what stands still.
            legs: (M, 5) x, y, radius (m) and velocity (m/s) of everything that moves, at `time`, world frame.
            pose: (3,) x m, y m, yaw rad of the scanner at `time`.
            twist: (3,) m/s, m/s, rad/s of the scanner, world frame.
            time: s, when beam 0 is measured.
            generator: of all errors.

        Returns:
            The scan, with `pose`, and hits (B,): −1 nothing, 0 something that stands still, 1 + m the leg m.
        """
        offsets = self.beams.time_increment * np.arange(self.beams.count, dtype=np.float64)
        origins = pose[:2] + offsets[:, None] * twist[:2]
        bearings = pose[2] + offsets * twist[2] + self.beams.bearings
        segments, fixed = scene.segments(), scene.discs()
        discs = np.concatenate((fixed, legs.reshape(-1, 5)))
        ranges, index, squareness = cast(origins, bearings, offsets, segments, discs, self.beams.range_max)
        still = segments.shape[0] + fixed.shape[0]
        hits = np.where(index < 0, -1, np.maximum(index - still + 1, 0))
        ranges, hits = self.with_errors(ranges, hits, squareness, generator)
        return Scan(time=time, ranges=ranges, beams=self.beams, pose=pose.copy()), hits

    def with_errors(
        self, ranges: FloatArray, hits: IntArray, squareness: FloatArray, generator: np.random.Generator
    ) -> tuple[FloatArray, IntArray]:
        """Return ranges (B,) m and hits (B,) after noise, mixed edges, missing, failed and spurious returns."""
        count = ranges.size
        seen = np.isfinite(ranges)
        noisy = ranges + generator.normal(size=count) * (self.noise + self.noise_share * np.where(seen, ranges, 0.0))
        beyond = np.roll(ranges, -1)
        edge = seen & np.isfinite(beyond) & (np.abs(np.where(seen, ranges, 0.0) - beyond) > _EDGE)
        edge[-1] &= self.beams.closed
        mixing = edge & (generator.random(count) < self.mixed)
        weight = generator.random(count)
        noisy[mixing] = (weight * ranges + (1 - weight) * beyond)[mixing]
        lost = generator.random(count) < np.where(squareness < _GRAZING, 0.5, self.missing)
        spurious = generator.random(count) < self.spurious
        noisy[lost] = np.inf
        noisy[spurious] = generator.uniform(self.beams.range_min, self.beams.range_max, count)[spurious]
        noisy[noisy <= self.beams.range_min] = np.nan
        noisy[noisy >= self.beams.range_max] = np.inf
        noisy[generator.random(count) < self.failed] = np.nan
        changed = mixing | spurious
        return noisy, np.where(np.isfinite(noisy), np.where(changed, 0, hits), -1)
