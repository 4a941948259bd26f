"""Scan → things that may be legs: where their middles are, and how much they look like it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.perception.classifier import LegClassifier
from sidestep.perception.clusters import find_clusters
from sidestep.perception.scan import Scan
from sidestep.types import FloatArray

_BEHIND_SURFACE = 0.045  # m; the middle of a leg lies this far behind the mean of what is seen of its surface
_WIDEST = 0.6  # m; nothing wider is a person's legs


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LegCandidates:
    """What may be legs in one scan. K candidates.

    Attributes:
        positions: (K, 2) m, estimated middles, in the fixed frame.
        delays: (K,) s after `Scan.time` at which each was measured.
        distances: (K,) m from the scanner.
        leg: (K,) log likelihood ratio of being leg or legs against anything else, from the shape alone.
        both: (K,) probability of being both legs of a person at once, given that it is leg or legs.
    """

    positions: FloatArray
    delays: FloatArray
    distances: FloatArray
    leg: FloatArray
    both: FloatArray

    def __len__(self) -> int:
        return int(self.delays.size)


def find_legs(
    scan: Scan, classifier: LegClassifier, *, twist: FloatArray | None = None, nearest: float = 0.0
) -> LegCandidates:
    """Return the clusters of `scan` narrower than 0.6 m, however little they resemble legs.

    Args:
        scan: with a pose, where known.
        classifier: of the clusters.
        twist: (3,) m/s, m/s, rad/s of the scanner in the fixed frame, to undo the distortion of a scan that takes
            its time; None: it stands.
        nearest: m; what is nearer to the scanner is left out.
    """
    clusters = find_clusters(scan)
    narrow = (clusters.feature("width") < _WIDEST) & (clusters.feature("range") >= nearest)
    probability = np.clip(classifier.probabilities(clusters.features[narrow]), 1e-3, 1.0)
    centroids, distances = clusters.centroids[narrow], clusters.feature("range")[narrow]
    middles = centroids * (1.0 + _BEHIND_SURFACE / np.maximum(distances, 1e-3))[:, None]
    first = clusters.beam[clusters.start[:-1]][narrow]
    last = clusters.beam[clusters.start[1:] - 1][narrow]
    delays = scan.beams.time_increment * (first + last) / 2
    return LegCandidates(
        positions=in_fixed_frame(middles, scan.pose, twist, delays),
        delays=delays,
        distances=distances,
        leg=np.log((probability[:, 1] + probability[:, 2]) / probability[:, 0]),
        both=probability[:, 2] / (probability[:, 1] + probability[:, 2]),
    )


def in_fixed_frame(
    points: FloatArray, pose: FloatArray | None, twist: FloatArray | None = None, delays: FloatArray | float = 0.0
) -> FloatArray:
    """Return points (K, 2) m of the scanner's frame in the fixed one; `delays` (K,) s after the time of `pose` (3,)."""
    if pose is None:
        return points
    moved = np.zeros(3) if twist is None else twist
    yaw = pose[2] + moved[2] * np.asarray(delays)
    c, s = np.cos(yaw), np.sin(yaw)
    turned = np.stack((c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]), axis=1)
    return turned + pose[:2] + np.multiply.outer(np.asarray(delays), moved[:2])
