"""What surrounds a lattice path: how far each of its points may move before it meets forbidden cells."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep.types import FloatArray, IntArray


@njit(cache=True)
def _risk_near(
    c: FloatArray, block: int, radius: int, active: IntArray, values: NDArray[np.float32], starts: IntArray
) -> float:
    """Risk at c (3,) cells from the robot, interpolated; 1 outside the raster."""
    half = (radius * block + 1) // 2
    total = 0.0
    for corner in range(8):
        weight = 1.0
        place = 0
        for a in range(3):
            h = half * active[a]
            up = (corner >> a) & 1
            q = math.floor(c[a])
            part = c[a] - q if active[a] else 0.0
            weight *= part if up else 1.0 - part
            q = q + up if active[a] else 0
            if weight > 0.0 and (q < -h or q > h):
                return 1.0
            place = place * (2 * h + 1) + q + h
        if weight > 0.0:
            total += weight * float(values[starts[block] + place])
    return total


@njit(cache=True)
def _highest_near(
    c: FloatArray,
    reach: float,
    block: int,
    radius: int,
    active: IntArray,
    values: NDArray[np.float32],
    starts: IntArray,
) -> float:
    """Highest risk of the raster cells that `reach` touches around c; 1 if that leaves the raster."""
    half = (radius * block + 1) // 2
    w1, w2 = 2 * half * active[1] + 1, 2 * half * active[2] + 1
    low = np.zeros(3, np.int64)
    high = np.zeros(3, np.int64)
    for a in range(3):
        if active[a]:
            low[a] = math.floor(c[a] - reach) + half
            high[a] = math.ceil(c[a] + reach) + half
            if low[a] < 0 or high[a] > 2 * half:
                return 1.0
    highest = 0.0
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(low[2], high[2] + 1):
                highest = max(highest, float(values[starts[block] + (i * w1 + j) * w2 + k]))
    return highest


@njit(cache=True)
def corridor(
    doubled: FloatArray,
    directions: FloatArray,
    reach: float,
    radius: int,
    active: IntArray,
    values: NDArray[np.float32],
    starts: IntArray,
    some: NDArray[np.bool_],
    limit: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Look around the points of a path in the rasters.

    Args:
        doubled: (2N, 3) cells, the path at half instants 1..2N.
        directions: (m, 3) unit vectors; reach: cells, how far to look.
        radius, active, values, starts, some: as in `_kernels.risk.rasterise_all`.
        limit: risk above which a place is forbidden.

    Returns:
        (2N, m) cells to the last allowed sample in each direction (inf if none is forbidden, or the point itself is),
        (2N, 3) slope of the risk per cell, and (2N,) the risk.
    """
    count = doubled.shape[0]
    room = np.full((count, directions.shape[0]), np.inf)
    slope = np.zeros((count, 3))
    level = np.zeros(count)
    c = np.zeros(3)
    for n in range(count):
        block = n + 1
        if not some[block]:
            continue
        level[n] = _risk_near(doubled[n], block, radius, active, values, starts)
        for a in range(3):
            if active[a]:
                for b in range(3):
                    c[b] = doubled[n, b]
                c[a] += 1.0
                above = _risk_near(c, block, radius, active, values, starts)
                c[a] -= 2.0
                slope[n, a] = (above - _risk_near(c, block, radius, active, values, starts)) / 2.0
        if level[n] > limit or _highest_near(doubled[n], reach, block, radius, active, values, starts) <= limit:
            continue
        for m in range(directions.shape[0]):
            t = 0.25
            while t <= reach + 0.25:
                for b in range(3):
                    c[b] = doubled[n, b] + t * directions[m, b]
                if _risk_near(c, block, radius, active, values, starts) > limit:
                    room[n, m] = t - 0.25
                    break
                t += 0.25
    return room, slope, level


@njit(cache=True)
def soft_slope(
    slope: FloatArray, level: FloatArray, soft: float, steep: FloatArray, limit: float, dimension: int
) -> FloatArray:
    """Slope (N, d) of the soft risk at steps 1..N, half of what is charged midway reckoned to either side.

    Args:
        slope: (2N, 3) per cell, with
        level: (2N,), of `corridor`.
        soft: price of a unit of risk at a half instant.
        steep: (N,) further price above `limit`, at each step and midway to it.
        limit: risk limit.
        dimension: d.
    """
    steps = level.size // 2
    out = np.zeros((steps, dimension))
    for n in range(level.size):
        price = soft + (steep[n // 2] if level[n] > limit else 0.0)
        for a in range(dimension):
            rise = price * slope[n, 3 - dimension + a]
            if n % 2 == 1:
                out[n // 2, a] += rise
            else:
                out[n // 2, a] += 0.5 * rise
                if n > 0:
                    out[n // 2 - 1, a] += 0.5 * rise
    return out
