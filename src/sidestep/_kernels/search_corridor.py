"""What surrounds a lattice path: how far each of its points may move before it meets forbidden cells."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray, IntArray

NEXT_TO_NOTHING = 1e-6
"""Cells that a place may lie beyond the raster by rounding alone."""


@njit(**KERNEL)
def _risk_near(c: FloatArray, active: IntArray, values: NDArray[np.float32], low: IntArray, size: IntArray) -> float:
    """Risk at c (3,) cells from the robot, interpolated; 1 outside the raster (over `low`, `size`)."""
    total = 0.0
    for corner in range(8):
        weight = 1.0
        place = 0
        for a in range(3):
            up = (corner >> a) & 1
            q = math.floor(c[a] + NEXT_TO_NOTHING)
            part = c[a] - q if active[a] and c[a] - q > NEXT_TO_NOTHING else 0.0
            weight *= part if up else 1.0 - part
            q = q + up - low[a] if active[a] else 0
            if weight > 0.0 and not 0 <= q < size[a]:
                return 1.0
            place = place * size[a] + q
        if weight > 0.0:
            total += weight * float(values[place])
    return total


@njit(**KERNEL)
def _slope_near(
    c: FloatArray,
    level: float,
    active: IntArray,
    values: NDArray[np.float32],
    low: IntArray,
    size: IntArray,
    out: FloatArray,
) -> None:
    """Write the slope of the risk (3,) per cell at c (3,), where it is `level`: over a cell to either side.

    A side that lies outside the raster is not known, and counts for nothing.
    """
    beside = c.copy()
    for a in range(3):
        if not active[a]:
            continue
        ahead, behind, span = level, level, 0.0
        if c[a] + 1.0 <= low[a] + size[a] - 1 + NEXT_TO_NOTHING:
            beside[a] = c[a] + 1.0
            ahead, span = _risk_near(beside, active, values, low, size), span + 1.0
        if c[a] - 1.0 >= low[a] - NEXT_TO_NOTHING:
            beside[a] = c[a] - 1.0
            behind, span = _risk_near(beside, active, values, low, size), span + 1.0
        beside[a] = c[a]
        out[a] = (ahead - behind) / span if span > 0.0 else 0.0


@njit(**KERNEL)
def _highest_near(
    c: FloatArray, reach: float, active: IntArray, values: NDArray[np.float32], low: IntArray, size: IntArray
) -> float:
    """Highest risk of the raster cells that `reach` touches around c; 1 if that leaves the raster."""
    first, last = np.zeros(3, np.int64), np.zeros(3, np.int64)
    for a in range(3):
        if active[a]:
            first[a] = math.floor(c[a] - reach) - low[a]
            last[a] = math.ceil(c[a] + reach) - low[a]
            if first[a] < 0 or last[a] >= size[a]:
                return 1.0
    highest = 0.0
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            for k in range(first[2], last[2] + 1):
                highest = max(highest, float(values[(i * size[1] + j) * size[2] + k]))
    return highest


@njit(**KERNEL)
def corridor(
    doubled: FloatArray,
    directions: FloatArray,
    reach: float,
    active: IntArray,
    values: NDArray[np.float32],
    starts: IntArray,
    some: NDArray[np.bool_],
    low: IntArray,
    size: IntArray,
    limit: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Look around the points of a path in the rasters.

    Args:
        doubled: (2N, 3) cells, the path at half instants 1..2N.
        directions: (m, 3) unit vectors; reach: cells, how far to look.
        active, values, starts, some, low, size: as in `_kernels.risk_raster.rasterise_all`.
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
        risk, corner, cells = values[starts[block] : starts[block + 1]], low[block], size[block]
        level[n] = _risk_near(doubled[n], active, risk, corner, cells)
        _slope_near(doubled[n], level[n], active, risk, corner, cells, slope[n])
        if level[n] > limit or _highest_near(doubled[n], reach, active, risk, corner, cells) <= limit:
            continue
        for m in range(directions.shape[0]):
            t = 0.25
            while t <= reach + 0.25:
                for b in range(3):
                    c[b] = doubled[n, b] + t * directions[m, b]
                if _risk_near(c, active, risk, corner, cells) > limit:
                    room[n, m] = t - 0.25
                    break
                t += 0.25
    return room, slope, level


@njit(**KERNEL)
def soft_slope(
    slope: FloatArray, level: FloatArray, soft: float, steep: FloatArray, limit: float, paid: FloatArray, dimension: int
) -> FloatArray:
    """Slope (N, d) of the soft risk at steps 1..N, half of what is charged midway reckoned to either side.

    Args:
        slope: (2N, 3) per cell, with
        level: (2N,), of `corridor`.
        soft: price of a unit of risk at a half instant.
        steep: (N,) further price above `limit`, at each step and midway to it.
        limit: risk limit.
        paid: (N,) part of it that is charged at each step and midway to it.
        dimension: d.
    """
    steps = level.size // 2
    out = np.zeros((steps, dimension))
    for n in range(level.size):
        price = paid[n // 2] * (soft + (steep[n // 2] if level[n] > limit else 0.0))
        for a in range(dimension):
            rise = price * slope[n, 3 - dimension + a]
            if n % 2 == 1:
                out[n // 2, a] += rise
            else:
                out[n // 2, a] += 0.5 * rise
                if n > 0:
                    out[n // 2 - 1, a] += 0.5 * rise
    return out
