"""What a scan says about places where nothing was detected: hidden or empty; and whether the scanner stands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sidestep.perception.scan import Scan
from sidestep.types import BoolArray, FloatArray

_BODY = 0.15  # m; half the width of a person's legs
_NEARER = 0.3  # m; a return this much nearer than a person hides them
_HIDDEN = 0.6  # share of the beams toward a person that must end on nearer things, or fail
_CHANGED = 0.4  # share of beams that may differ while the scanner stands (people walk through)
_SAME_RANGE = (0.05, 0.02)  # m, and share of the range: no change
_WATCH = 0.4  # s that the scanner must have been watched


def in_view(scan: Scan, positions: FloatArray) -> BoolArray:
    """Return (K,) whether people at `positions` (K, 2) m, fixed frame, could be seen: not hidden, in view."""
    visible = np.zeros(positions.shape[0], dtype=np.bool_)
    ranges = np.where(np.isnan(scan.ranges), np.inf, scan.ranges)
    ranges[ranges <= scan.beams.range_min] = np.inf
    away = positions if scan.pose is None else positions - scan.pose[:2]
    yaw = 0.0 if scan.pose is None else scan.pose[2]
    distance = np.hypot(*away.T)
    first = np.arctan2(away[:, 1], away[:, 0]) - yaw - scan.beams.angle_min
    turn = np.remainder(first, 2 * np.pi)
    half = np.arctan2(_BODY, np.maximum(distance, 0.1))
    for k in range(positions.shape[0]):
        low = int(np.floor((turn[k] - half[k]) / scan.beams.angle_increment))
        high = int(np.ceil((turn[k] + half[k]) / scan.beams.angle_increment))
        beams = np.arange(low, high + 1)
        if scan.beams.closed:
            beams %= scan.beams.count
        elif low < 0 or high >= scan.beams.count:
            continue  # leaves the field of view
        blind = np.isnan(scan.ranges[beams]) | (ranges[beams] < distance[k] - _NEARER)
        visible[k] = distance[k] < scan.beams.range_max and np.mean(blind) < _HIDDEN
    return visible


def stands_still(scan: Scan, past: Sequence[Scan]) -> bool:
    """Return whether the scanner, whose pose is unknown, has stood over the `past` scans (oldest first)."""
    if not past or scan.time - past[0].time < _WATCH:
        return False
    before = past[0]
    both = scan.valid() & before.valid()
    if before.ranges.shape != scan.ranges.shape or both.sum() < 20:
        return False
    change = np.abs(scan.ranges[both] - before.ranges[both])
    return bool(np.mean(change > _SAME_RANGE[0] + _SAME_RANGE[1] * scan.ranges[both]) < _CHANGED)
