"""Goal costs and walls over the robot's lattice, place by place without lists of places in between."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep._kernels.walls import distance_bounds, interpolate, wall_distance
from sidestep.types import FloatArray, IntArray

BLOCK = 8
"""Places along an axis that are looked at together for walls."""


@njit(**KERNEL)
def goal_box(
    origin: FloatArray, goal: FloatArray, weight: FloatArray, squared: bool, spacing: float, half: IntArray
) -> tuple[NDArray[np.float32], float]:
    """Goal costs over a box, straight-line: Σ weight·(x − g)² or ‖weight·(x − g)‖.

    Args:
        origin: (d,) m, centre of the box.
        goal: (d,) m.
        weight: (d,) θ5.
        squared: which of the two.
        spacing: m.
        half: (3,) cells to the faces, 0 on the axes that only pad.

    Returns:
        costs above the smallest one, and that one.
    """
    out = np.empty((2 * half[0] + 1, 2 * half[1] + 1, 2 * half[2] + 1), np.float32)
    parts = np.zeros((3, 2 * max(half[0], half[1], half[2]) + 1))
    lowest = 0.0
    for axis in range(3 - origin.size, 3):
        a, least = axis - 3 + origin.size, np.inf
        for i in range(2 * half[axis] + 1):
            apart = origin[a] + spacing * (i - half[axis]) - goal[a]
            parts[axis, i] = apart * apart * weight[a] * (1.0 if squared else weight[a])
            least = min(least, parts[axis, i])
        lowest += least
    lowest = lowest if squared else math.sqrt(lowest)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            near = parts[0, i] + parts[1, j]
            row = out[i, j]
            if squared:
                for k in range(row.size):
                    row[k] = near + parts[2, k] - lowest
            else:
                for k in range(row.size):
                    row[k] = math.sqrt(near + parts[2, k]) - lowest
    return out, lowest


@njit(**KERNEL)
def range_around(costs: NDArray[np.float32], radius: int) -> float:
    """By how much costs over a box differ at most among the cells within `radius` of its middle."""
    low, high = np.float32(np.inf), np.float32(-np.inf)
    m0, m1, m2 = costs.shape[0] // 2, costs.shape[1] // 2, costs.shape[2] // 2
    for i in range(max(m0 - radius, 0), min(m0 + radius + 1, costs.shape[0])):
        for j in range(max(m1 - radius, 0), min(m1 + radius + 1, costs.shape[1])):
            for k in range(max(m2 - radius, 0), min(m2 + radius + 1, costs.shape[2])):
                low, high = min(low, costs[i, j, k]), max(high, costs[i, j, k])
    return float(high - low)


@njit(**KERNEL)
def field_box(
    origin: FloatArray,
    spacing: float,
    half: IntArray,
    values: FloatArray,
    corner: FloatArray,
    cell: float,
    goal: FloatArray,
    weight: float,
    squared: bool,
) -> tuple[NDArray[np.float32], float]:
    """Goal costs over a box from a distance field (`walls.interpolate`), as `goal_box` returns them.

    Args:
        origin: (3,) m, centre of the box.
        spacing: m.
        half: (3,) cells to the faces; the last two axes are x and y, unless all three exist: then the first two.
        values: (w, h) m, of the field.
        corner: (2,) m.
        cell: m, spacing of the field.
        goal: (2,) m.
        weight: θ5.
        squared: the distance or its square.
    """
    out = np.empty((2 * half[0] + 1, 2 * half[1] + 1, 2 * half[2] + 1), np.float32)
    flat = half[0] == 0
    x = 1 if flat else 0
    places = np.empty(((2 * half[x] + 1) * (2 * half[x + 1] + 1), 2))
    n = 0
    for i in range(-half[x], half[x] + 1):
        for j in range(-half[x + 1], half[x + 1] + 1):
            places[n, 0] = origin[x] + spacing * i
            places[n, 1] = origin[x + 1] + spacing * j
            n += 1
    walk = interpolate(places, values, corner, cell, goal)
    lowest = np.inf
    for n in range(walk.size):
        walk[n] = weight * (walk[n] * walk[n] if squared else walk[n])
        lowest = min(lowest, walk[n])
    for n in range(walk.size):
        i, j = n // (2 * half[x + 1] + 1), n % (2 * half[x + 1] + 1)
        if flat:
            out[0, i, j] = walk[n] - lowest
        else:
            for k in range(out.shape[2]):
                out[i, j, k] = walk[n] - lowest
    return out, lowest


@njit(**KERNEL)
def wall_box(
    origin: FloatArray,
    spacing: float,
    half: IntArray,
    margin: float,
    segments: FloatArray,
    grid: NDArray[np.bool_],
    frame: FloatArray,
    sizes: FloatArray,
    samples: FloatArray,
    corner: FloatArray,
) -> NDArray[np.bool_]:
    """Places of a box nearer to walls than `margin`; axes as in `field_box`, walls as in `walls.free_points`.

    The signed distance changes by at most the way gone: most blocks of `BLOCK`² places are decided by their middles.
    """
    out = np.empty((2 * half[0] + 1, 2 * half[1] + 1, 2 * half[2] + 1), np.bool_)
    flat = half[0] == 0
    a = 1 if flat else 0
    across = 0.5 * (BLOCK - 1)
    reach = spacing * across * math.sqrt(2.0) * (1.0 + 1e-9)
    for i0 in range(0, 2 * half[a] + 1, BLOCK):
        x0 = origin[a] + spacing * (i0 + across - half[a])
        for j0 in range(0, 2 * half[a + 1] + 1, BLOCK):
            y0 = origin[a + 1] + spacing * (j0 + across - half[a + 1])
            least, most = distance_bounds(x0, y0, samples, corner)
            free = least - reach >= margin
            known = free or most + reach < margin
            for i in range(i0, min(i0 + BLOCK, 2 * half[a] + 1)):
                x = origin[a] + spacing * (i - half[a])
                for j in range(j0, min(j0 + BLOCK, 2 * half[a + 1] + 1)):
                    near = not free
                    if not known:
                        y = origin[a + 1] + spacing * (j - half[a + 1])
                        least, most = distance_bounds(x, y, samples, corner)
                        near = most < margin
                        if not near and least < margin:
                            near = wall_distance(x, y, segments, grid, frame, sizes) < margin
                    if flat:
                        out[0, i, j] = near
                    else:
                        for k in range(out.shape[2]):
                            out[i, j, k] = near
    return out
