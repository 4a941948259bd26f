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
    """Risk at the raster point nearest to c (3,) cells from the robot; 1 outside the raster."""
    odd = block & 1
    half = (radius * block + 1) // 2 if odd else radius * (block // 2)
    place = 0
    parity = 0
    for a in range(3):
        z = int(math.floor((2.0 if odd else 1.0) * c[a] + 0.5)) if active[a] else 0
        q = z >> 1 if odd else z
        if odd and active[a]:
            parity = 2 * parity + (z & 1)
        h = half * active[a]
        if q < -h or q > h:
            return 1.0
        place = place * (2 * h + 1) + q + h
    if odd:
        size = 1
        for a in range(3):
            size *= 2 * half * active[a] + 1
        place += parity * size
    return values[starts[block] + place]


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
) -> tuple[FloatArray, FloatArray]:
    """Look around the points of a path in the rasters.

    Args:
        doubled: (2N, 3) cells, the path at half instants 1..2N.
        directions: (m, 3) unit vectors; reach: cells, how far to look.
        radius, active, values, starts, some: as in `_kernels.risk.rasterise_all`.
        limit: risk above which a place is forbidden.

    Returns:
        (2N, m) cells to the last allowed sample in each direction (inf if none is forbidden), and (2N, 3) slope of the
        risk per cell.
    """
    count = doubled.shape[0]
    room = np.full((count, directions.shape[0]), np.inf)
    slope = np.zeros((count, 3))
    c = np.zeros(3)
    for n in range(count):
        block = n + 1
        if not some[block]:
            continue
        fine = 0.5 if block & 1 else 1.0
        for a in range(3):
            if active[a]:
                c[:] = doubled[n]
                c[a] += fine
                above = _risk_near(c, block, radius, active, values, starts)
                c[a] -= 2.0 * fine
                slope[n, a] = (above - _risk_near(c, block, radius, active, values, starts)) / (2.0 * fine)
        for m in range(directions.shape[0]):
            t = 0.5 * fine
            while t <= reach + 0.5 * fine:
                c[:] = doubled[n] + t * directions[m]
                if _risk_near(c, block, radius, active, values, starts) > limit:
                    room[n, m] = t - 0.5 * fine
                    break
                t += 0.5 * fine
    return room, slope
