"""First hits of beams on segments and on moving discs, by brute force: a few hundred thousand tests per scan."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray, IntArray


@njit(**KERNEL)
def cast(
    origins: FloatArray,
    bearings: FloatArray,
    times: FloatArray,
    segments: FloatArray,
    discs: FloatArray,
    range_max: float,
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return for each beam how far it goes, what it hits, and how squarely.

    Args:
        origins: (B, 2) m, where each beam starts.
        bearings: (B,) rad in the world frame.
        times: (B,) s since the scan began; disc m stands at discs[m, :2] + times·discs[m, 3:5].
        segments: (S, 4) m, x and y of both ends.
        discs: (M, 5) x, y, radius (m), velocity (m/s).
        range_max: m.

    Returns:
        ranges (B,) m, +inf where nothing is hit before `range_max`;
        hits (B,) int64: index of the segment, S + index of the disc, or −1;
        squareness (B,): |cos| of the angle between beam and surface normal, 0 where nothing is hit.
    """
    count = bearings.size
    ranges = np.full(count, np.inf)
    hits = np.full(count, -1, dtype=np.int64)
    squareness = np.zeros(count)
    for b in range(count):
        ox, oy = origins[b, 0], origins[b, 1]
        dx, dy = np.cos(bearings[b]), np.sin(bearings[b])
        best = range_max
        for s in range(segments.shape[0]):
            ex, ey = segments[s, 2] - segments[s, 0], segments[s, 3] - segments[s, 1]
            cross = dx * ey - dy * ex
            if cross == 0.0:
                continue
            px, py = segments[s, 0] - ox, segments[s, 1] - oy
            along = (px * ey - py * ex) / cross
            share = (px * dy - py * dx) / cross
            if 0.0 < along < best and 0.0 <= share <= 1.0:
                best = along
                hits[b] = s
                squareness[b] = abs(cross) / np.hypot(ex, ey)
        for m in range(discs.shape[0]):
            cx = discs[m, 0] + times[b] * discs[m, 3] - ox
            cy = discs[m, 1] + times[b] * discs[m, 4] - oy
            radius = discs[m, 2]
            middle = cx * dx + cy * dy
            aside = cx * dy - cy * dx
            if middle <= 0.0 or abs(aside) >= radius:
                continue
            half = np.sqrt(radius * radius - aside * aside)
            along = middle - half
            if 0.0 < along < best:
                best = along
                hits[b] = segments.shape[0] + m
                squareness[b] = half / radius
        if hits[b] >= 0:
            ranges[b] = best
    return ranges, hits, squareness
