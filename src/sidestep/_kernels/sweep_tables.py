"""What a sweep reads, laid out beforehand: the danger of every instant; and policies of costs that separate by axis."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.sweep import Values, axis_radius, row_count
from sidestep.types import FloatArray, IntArray


@njit(cache=True, nogil=True)
def danger_factors(
    path: FloatArray, spacing: float, weight: float, rate: float, centre: int, dimension: int, out: Values
) -> None:
    """Decay with the squared distance: weight · Π_a exp(−rate · (x_a − r_a)²), per axis into `out` (3·T, C).

    `path` (T, 3) m, the robot in the lattice's frame.
    """
    for t in range(path.shape[0]):
        for axis in range(3):
            scale = weight if axis == 0 else 1.0
            if axis < 3 - dimension:
                out[3 * t + axis, 0] = scale
                continue
            for c in range(out.shape[1]):
                gap = spacing * (c - centre) - path[t, axis]
                out[3 * t + axis, c] = scale * np.exp(-rate * gap * gap)


@njit(cache=True, nogil=True)
def danger_tables(
    path: FloatArray,
    radii: IntArray,
    spacing: float,
    weight: float,
    rate: float,
    centre: int,
    dimension: int,
    out: Values,
) -> None:
    """Decay with the distance itself: weight · exp(−rate · ‖x − r‖), instant t on the box of radii[t]; (T·rows, C)."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    for t in range(path.shape[0]):
        first = t * (2 * c0 + 1) * rows
        b0, b1 = axis_radius(radii[t], dimension)
        for i0 in range(-b0, b0 + 1):
            for i1 in range(-b1, b1 + 1):
                g0, g1 = spacing * i0 - path[t, 0], spacing * i1 - path[t, 1]
                row = first + (c0 + i0) * rows + c1 + i1
                for i2 in range(-radii[t], radii[t] + 1):
                    g2 = spacing * i2 - path[t, 2]
                    distance = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
                    out[row, centre + i2] = weight * np.exp(-rate * distance)


@njit(cache=True, nogil=True)
def axis_policies(
    goal_axes: FloatArray,
    taps: FloatArray,
    radius: int,
    centre: int,
    dimension: int,
    tolerance: float,
    rationality: float,
    tables: FloatArray,
) -> None:
    """P_d per axis for separable costs and β = 0: `tables` (3·T, C), the first action's components on ±radius cells.

    Arguments as for `sweep`; `centre` is the anchor's index in `goal_axes` (3, C), the middle of `tables` its own.
    """
    steps, _, count = taps.shape
    reach = count // 2
    middle = (tables.shape[1] - 1) // 2
    values = np.empty(goal_axes.shape[1])
    lower = np.empty(goal_axes.shape[1])
    for axis in range(3):
        if axis < 3 - dimension:
            continue
        values[:] = goal_axes[axis]
        for j in range(steps - 1, 0, -1):
            box = radius + reach * j
            for i in range(centre - box, centre + box + 1):
                best = np.inf
                for u in range(count):
                    best = min(best, taps[j, axis, u] + values[i + u - reach])
                lower[i] = best + goal_axes[axis, i]
            values[centre - box : centre + box + 1] = lower[centre - box : centre + box + 1]
        for i in range(-radius, radius + 1):
            _spread_over_minimisers(
                values, centre + i, taps[0, axis], tolerance, rationality, tables, axis * count, middle + i
            )


@njit(cache=True, nogil=True)
def _spread_over_minimisers(
    values: FloatArray,
    at: int,
    taps: FloatArray,
    tolerance: float,
    rationality: float,
    tables: FloatArray,
    first: int,
    column: int,
) -> None:
    reach = taps.size // 2
    best = np.inf
    for u in range(taps.size):
        best = min(best, taps[u] + values[at + u - reach])
    total = 0.0
    for u in range(taps.size):
        gap = taps[u] + values[at + u - reach] - best
        weight = 1.0 if gap <= tolerance * abs(best) + 1e-12 else 0.0
        if np.isfinite(rationality):
            weight = np.exp(-rationality * gap)
        tables[first + u, column] = weight
        total += weight
    for u in range(taps.size):
        tables[first + u, column] /= total
