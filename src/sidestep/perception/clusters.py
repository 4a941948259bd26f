"""Scan → gap clusters: runs of neighbouring beams that fell on one surface, and what they look like."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.perception.scan import Scan
from sidestep.types import FloatArray, IntArray

LINK_GAP = 0.13
"""m; neighbouring returns farther apart belong to different surfaces (so were the recordings annotated)."""
_CAP = 1.0  # m; how far a cluster stands out from its surroundings counts up to here
_CROWD = 0.7  # m; other clusters this near may be the other leg

FEATURES = (
    "range", "points", "width", "depth", "length", "fill", "spread", "thickness", "elongation", "bulge", "radius",
    "circularity", "roughness", "turning", "step_left", "step_right", "nearest", "second_nearest", "crowd",
)  # fmt: skip
"""Names of the columns of `Clusters.features`; lengths in m, `points` a count, `turning` in rad per point."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clusters:
    """The clusters of one scan, in order of bearing. C clusters, V valid returns.

    Attributes:
        points: (V, 2) m, returns in the scanner's frame, in the order of `beam`.
        beam: (V,) beam of each return.
        start: (C+1,) cluster c owns the returns start[c] … start[c+1] − 1.
        centroids: (C, 2) m, mean of the returns (on the surface, not inside the body).
        features: (C, len(FEATURES)).
    """

    points: FloatArray
    beam: IntArray
    start: IntArray
    centroids: FloatArray
    features: FloatArray

    def __len__(self) -> int:
        return int(self.start.size) - 1

    def feature(self, name: str) -> FloatArray:
        """Return the (C,) column `name` of the features."""
        return self.features[:, FEATURES.index(name)]


def find_clusters(scan: Scan, *, gap: float = LINK_GAP, min_points: int = 3) -> Clusters:
    """Link neighbouring returns nearer than `gap` (m); keep runs of at least `min_points`.

    Beams without a return neither link nor part. In a scanner that sees all round, a run may cross the seam.
    """
    beam = np.flatnonzero(scan.valid())
    points = scan.points()[beam]
    beam, points, breaks = _from_a_break(beam, points, gap, closed=scan.beams.closed)
    count = np.diff(breaks)
    kept = count >= min_points
    owned = np.repeat(kept, count)
    start = np.concatenate(([0], np.cumsum(count[kept]))).astype(np.int64)
    own_points, own_beam = points[owned], beam[owned]
    centroids = _mean(own_points, start)
    steps = _steps(scan, own_beam, start)
    features = _features(own_points, start, centroids, steps, scan.beams.angle_increment)
    return Clusters(points=own_points, beam=own_beam, start=start, centroids=centroids, features=features)


def _from_a_break(
    beam: IntArray, points: FloatArray, gap: float, *, closed: bool
) -> tuple[IntArray, FloatArray, IntArray]:
    """Return beams and points turned so that they begin at a break, and the (runs+1,) bounds of the runs."""
    if beam.size == 0:
        return beam, points, np.zeros(1, dtype=np.int64)
    apart = np.hypot(*(points - np.roll(points, 1, axis=0)).T) > gap  # apart[i]: a break between i−1 and i
    if closed and not apart[0] and apart.any():
        first = int(np.argmax(apart))
        beam, points, apart = np.roll(beam, -first), np.roll(points, -first, axis=0), np.roll(apart, -first)
    apart[0] = True
    return beam, points, np.append(np.flatnonzero(apart), beam.size)


def _mean(values: FloatArray, start: IntArray) -> FloatArray:
    """Return the (C, …) mean of `values` over each cluster."""
    if start.size == 1:
        return np.zeros((0, *values.shape[1:]))
    count = np.diff(start).reshape(-1, *([1] * (values.ndim - 1)))
    return np.add.reduceat(values, start[:-1], axis=0) / count


def _steps(scan: Scan, beam: IntArray, start: IntArray) -> FloatArray:
    """Return (C, 2) m: how far the surroundings lie behind (+) or before (−) each cluster, at its right and left edge.

    A negative step means that something nearer hides a part. Two beams are looked at, and the nearer return decides.
    """
    ranges = np.where(np.isnan(scan.ranges), np.inf, scan.ranges)
    ranges[ranges <= scan.beams.range_min] = np.inf
    steps = np.full((start.size - 1, 2), _CAP)
    for side, (edge, direction) in enumerate(((start[:-1], -1), (start[1:] - 1, 1))):
        own = ranges[beam[edge]]
        for offset in (1, 2):
            index = beam[edge] + direction * offset
            inside = np.full(index.shape, True) if scan.beams.closed else (index >= 0) & (index < ranges.size)
            beyond = np.where(inside, ranges[index % ranges.size], np.inf)
            steps[:, side] = np.minimum(steps[:, side], np.clip(beyond - own, -_CAP, _CAP))
    return steps


def _features(
    points: FloatArray, start: IntArray, centroids: FloatArray, steps: FloatArray, increment: float
) -> FloatArray:
    """Return (C, len(FEATURES)); after Arras, Martinez Mozos and Burgard (2007) and Leigh et al. (2015)."""
    if start.size == 1:
        return np.zeros((0, len(FEATURES)))
    count = np.diff(start)
    owner = np.repeat(np.arange(count.size), count)
    first, last = points[start[:-1]], points[start[1:] - 1]
    distance = np.hypot(*centroids.T)
    sight = centroids / distance[:, None]
    around = points - centroids[owner]
    along, across = _span(around, owner, sight, start)
    spread = np.sqrt(_mean(np.sum(around**2, axis=1), start))
    thickness, elongation = _axes(around, start)
    chord = last - first
    width = np.hypot(*chord.T)
    length, roughness, turning = _outline(points, start)
    radius, circularity = _circle(around, owner, start)
    nearest, second, crowd = _neighbours(centroids)
    expected = np.maximum(across / (increment * distance) + 1.0, 1.0)
    normal = np.stack((chord[:, 1], -chord[:, 0]), axis=1) / np.maximum(width, 1e-9)[:, None]
    middle = points[(start[:-1] + start[1:] - 1) // 2]
    bulge = np.sum((middle - (first + last) / 2) * normal, axis=1)  # toward the scanner: positive
    return np.stack(
        (
            distance, count, across, along, length, count / expected, spread, thickness, elongation, bulge, radius,
            circularity, roughness, turning, steps[:, 1], steps[:, 0], nearest, second, crowd,
        ),
        axis=1,
    )  # fmt: skip


def _span(around: FloatArray, owner: IntArray, sight: FloatArray, start: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return (C,) m extents of each cluster along and across the line of sight."""
    extents: list[FloatArray] = []
    for axis in (sight, np.stack((-sight[:, 1], sight[:, 0]), axis=1)):
        value = np.sum(around * axis[owner], axis=1)
        extents.append(np.maximum.reduceat(value, start[:-1]) - np.minimum.reduceat(value, start[:-1]))
    return extents[0], extents[1]


def _axes(around: FloatArray, start: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return (C,) m standard deviations across and along the principal axis."""
    xx, yy, xy = (_mean(around[:, a] * around[:, b], start) for a, b in ((0, 0), (1, 1), (0, 1)))
    centre, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return np.sqrt(np.maximum(centre - half, 0.0)), np.sqrt(centre + half)


def _outline(points: FloatArray, start: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return per cluster the length of the outline (m), the spread of its segments (m) and its mean turning (rad)."""
    segment = np.diff(points, axis=0, append=points[-1:])
    inner = np.ones(points.shape[0], dtype=np.bool_)
    inner[start[1:] - 1] = False
    size = np.hypot(*segment.T) * inner
    segments = np.maximum(np.diff(start) - 1, 1)
    length = np.add.reduceat(size, start[:-1])
    squares = np.add.reduceat(size**2, start[:-1]) / segments
    roughness = np.sqrt(np.maximum(squares - (length / segments) ** 2, 0.0))
    angle = np.arctan2(segment[:, 1], segment[:, 0])
    turn = (np.diff(angle, append=angle[-1:]) + np.pi) % (2 * np.pi) - np.pi
    inner[np.maximum(start[1:] - 2, 0)] = False
    turning = np.add.reduceat(turn * inner, start[:-1]) / np.maximum(segments - 1, 1)
    return length, roughness, turning


def _circle(around: FloatArray, owner: IntArray, start: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return per cluster radius and residual (m) of the algebraic circle fit (Kåsa), both capped at `_CAP`."""
    x, y = around.T
    z = x**2 + y**2
    xx, yy, xy, xz, yz = (_mean(v, start) for v in (x * x, y * y, x * y, x * z, y * z))
    determinant = 4 * (xx * yy - xy**2)
    safe = np.maximum(determinant, 1e-12)
    cx, cy = 2 * (xz * yy - yz * xy) / safe, 2 * (yz * xx - xz * xy) / safe
    radius = np.sqrt(cx**2 + cy**2 + xx + yy)
    off = np.hypot(x - cx[owner], y - cy[owner]) - radius[owner]
    residual = np.sqrt(_mean(off**2, start))
    return np.minimum(radius, _CAP), np.minimum(residual, _CAP)


def _neighbours(centroids: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return per cluster the distance to the nearest and second nearest other (m, capped), and how many are near."""
    apart = np.hypot(*(centroids[:, None] - centroids[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    ordered = np.sort(apart, axis=1)
    padded = np.pad(ordered, ((0, 0), (0, 2)), constant_values=np.inf)[:, :2]
    crowd = np.sum(apart < _CROWD, axis=1).astype(np.float64)
    return np.minimum(padded[:, 0], _CAP), np.minimum(padded[:, 1], _CAP), crowd
