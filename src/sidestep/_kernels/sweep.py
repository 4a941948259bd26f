"""Backward induction on the lattice (Eq. 2): value-only min-plus sweeps.

All arrays over cells have three axes; a lattice of d < 3 dimensions keeps its real axes last and has one cell on the
others, so one compiled kernel serves 1-D, 2-D and 3-D. A box of radius ρ around the anchor is `centre ± ρ` on real axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.floating]


class CostTables(NamedTuple):
    """Stage costs c_t(x) = goal(x) + danger_t(x) in one dtype; whichever form is separable is kept per axis.

    Attributes:
        goal_axes: (3, W) summed over axes; zeros where `goal_table` is used.
        goal_table: (W0, W1, W2), or (0, 0, 0); carries +inf where a person cannot be.
        danger_axes: (T, 3, W) multiplied over axes, the weight in the first; (1, 1, 1) one where `danger_table` is used.
        danger_table: (T, W0, W1, W2), or (0, 0, 0, 0).
    """

    goal_axes: Array
    goal_table: Array
    danger_axes: Array
    danger_table: Array


@njit(cache=True, nogil=True)
def axis_radius(radius, dimension):
    """Radius per array axis: 0 on the axes that only pad to three."""
    return radius if dimension == 3 else 0, radius if dimension >= 2 else 0, radius


@njit(cache=True, nogil=True)
def _row_terms(costs, instant, danger, i0, i1):
    """(scalar, goal row, factor, danger row): c(i0, i1, ·) = scalar + goal row + factor · danger row."""
    if costs.goal_table.size > 0:
        scalar = costs.goal_axes[0, 0] - costs.goal_axes[0, 0]  # zero of the same dtype
        goal_row = costs.goal_table[i0, i1]
    else:
        scalar = costs.goal_axes[0, i0] + costs.goal_axes[1, i1]
        goal_row = costs.goal_axes[2]
    if not danger:
        return scalar, goal_row, costs.goal_axes[0, 0] - costs.goal_axes[0, 0], costs.goal_axes[2]
    if costs.danger_table.size > 0:
        return scalar, goal_row, costs.danger_axes[0, 0, 0], costs.danger_table[instant, i0, i1]
    factor = costs.danger_axes[instant, 0, i0] * costs.danger_axes[instant, 1, i1]
    return scalar, goal_row, factor, costs.danger_axes[instant, 2]


@njit(cache=True, nogil=True)
def _lower_rows(source, first, start, width, taps, out):
    """out[start + c] = min_u taps[u] + source[first + u, start + c]."""
    if taps.size == 5:
        t0, t1, t2, t3, t4 = taps[0], taps[1], taps[2], taps[3], taps[4]
        s0 = source[first, start : start + width]
        s1 = source[first + 1, start : start + width]
        s2 = source[first + 2, start : start + width]
        s3 = source[first + 3, start : start + width]
        s4 = source[first + 4, start : start + width]
        o = out[start : start + width]
        for c in range(width):
            a = t0 + s0[c]
            b = t1 + s1[c]
            e = t2 + s2[c]
            f = t3 + s3[c]
            g = t4 + s4[c]
            a = a if a < b else b
            e = e if e < f else f
            a = a if a < e else e
            o[c] = a if a < g else g
        return
    for c in range(start, start + width):
        out[c] = taps[0] + source[first, c]
    for u in range(1, taps.size):
        for c in range(start, start + width):
            q = taps[u] + source[first + u, c]
            out[c] = q if q < out[c] else out[c]


@njit(cache=True, nogil=True)
def _lower_columns(row, start, width, taps, scalar, goal_row, factor, danger_row, out):
    """out[start + c] = stage cost + min_u taps[u] + row[start + c + u − reach]."""
    reach = taps.size // 2
    r = row[start - reach : start + width + reach]
    h = goal_row[start : start + width]
    g = danger_row[start : start + width]
    o = out[start : start + width]
    if taps.size == 5:
        t0, t1, t2, t3, t4 = taps[0], taps[1], taps[2], taps[3], taps[4]
        for c in range(width):
            a = t0 + r[c]
            b = t1 + r[c + 1]
            e = t2 + r[c + 2]
            f = t3 + r[c + 3]
            q = t4 + r[c + 4]
            a = a if a < b else b
            e = e if e < f else f
            a = a if a < e else e
            a = a if a < q else q
            o[c] = (scalar + h[c]) + factor * g[c] + a
        return
    for c in range(width):
        best = taps[0] + r[c]
        for u in range(1, taps.size):
            q = taps[u] + r[c + u]
            best = q if q < best else best
        o[c] = (scalar + h[c]) + factor * g[c] + best


@njit(cache=True, nogil=True)
def _terminal(costs, instant, danger, radius, centre, dimension, target):
    """target(x) = c(x) on the box of `radius`."""
    c0, c1, c2 = axis_radius(centre, dimension)
    b0, b1, b2 = axis_radius(radius, dimension)
    for i0 in range(c0 - b0, c0 + b0 + 1):
        for i1 in range(c1 - b1, c1 + b1 + 1):
            scalar, goal_row, factor, danger_row = _row_terms(costs, instant, danger, i0, i1)
            out = target[i0, i1]
            for c in range(c2 - b2, c2 + b2 + 1):
                out[c] = (scalar + goal_row[c]) + factor * danger_row[c]


@njit(cache=True, nogil=True)
def _stage(costs, instant, danger, taps, radius, centre, dimension, source, target, plane, row):
    """target(x) = c(x) + min_u (taps(u) + source(x + u)) on the box of `radius`, one min-plus pass per axis."""
    reach = taps.shape[1] // 2
    c0, c1, c2 = axis_radius(centre, dimension)
    b0, b1, b2 = axis_radius(radius, dimension)
    start, width = c2 - b2, 2 * b2 + 1
    length = source.shape[2]
    flat = source.reshape((source.shape[0], source.shape[1] * length))
    flat_plane = plane.reshape(plane.size)
    for i0 in range(c0 - b0, c0 + b0 + 1):
        layer = source[i0]
        if dimension == 3:
            for i1 in range(c1 - b1 - reach, c1 + b1 + reach + 1):
                _lower_rows(flat, i0 - reach, i1 * length + start - reach, width + 2 * reach, taps[0], flat_plane)
            layer = plane
        for i1 in range(c1 - b1, c1 + b1 + 1):
            line = layer[i1]
            if dimension >= 2:
                _lower_rows(layer, i1 - reach, start - reach, width + 2 * reach, taps[1], row)
                line = row
            scalar, goal_row, factor, danger_row = _row_terms(costs, instant, danger, i0, i1)
            _lower_columns(line, start, width, taps[2], scalar, goal_row, factor, danger_row, target[i0, i1])


@njit(cache=True, nogil=True)
def sweep(costs, first_instant, danger, taps, radius, centre, dimension, even, odd, plane, row):
    """C(x) = c_1(x) + V_1(x), the cost of arriving at x with the first action, on the box of `radius` + reach.

    Args:
        costs: stage costs; row `first_instant + j − 1` of the danger belongs to stage j = 1..M.
        first_instant: index of the robot's position at the first charged instant.
        danger: False leaves the danger term out (β = 0).
        taps: (M, 3, 2·reach + 1) cost of the components of action j = 0..M−1; [0] is not used here.
        radius: of the box of cells whose first action is wanted.
        centre: index of the anchor on the real axes of `even` and `odd`.
        dimension: d.
        even, odd: (W0, W1, W2) scratch for values.
        plane, row: (W1, W2), (W2,) scratch.

    Returns:
        the scratch array that holds C.
    """
    reach = taps.shape[2] // 2
    steps = taps.shape[0]
    source, target = odd, even
    _terminal(costs, first_instant + steps - 1, danger, radius + reach * steps, centre, dimension, target)
    for j in range(steps - 1, 0, -1):
        source, target = target, source
        box = radius + reach * j
        _stage(costs, first_instant + j - 1, danger, taps[j], box, centre, dimension, source, target, plane, row)
    return target


@njit(cache=True, nogil=True)
def danger_factors(path, spacing, weight, rate, centre, dimension, out):
    """Squared decay: weight · Π_a exp(−rate · (x_a − r_a)²) per axis. path (T, d) m in the lattice's frame; out (T, 3, W)."""
    for t in range(path.shape[0]):
        for pad in range(3 - dimension):
            out[t, pad, 0] = 1.0
        for a in range(dimension):
            axis = 3 - dimension + a
            for c in range(2 * centre + 1):
                gap = spacing * (c - centre) - path[t, a]
                out[t, axis, c] = np.exp(-rate * gap * gap)
        for c in range(out.shape[2]):
            out[t, 0, c] *= weight


@njit(cache=True, nogil=True)
def danger_tables(path, radii, spacing, weight, rate, centre, dimension, out):
    """Decay with the distance itself: weight · exp(−rate · ‖x − r‖), instant t on the box of radii[t]. out (T, W0, W1, W2)."""
    c0, c1, c2 = axis_radius(centre, dimension)
    r = np.zeros(3)
    for t in range(path.shape[0]):
        r[3 - dimension :] = path[t]
        b0, b1, b2 = axis_radius(radii[t], dimension)
        for i0 in range(c0 - b0, c0 + b0 + 1):
            for i1 in range(c1 - b1, c1 + b1 + 1):
                g0 = spacing * (i0 - c0) - r[0]
                g1 = spacing * (i1 - c1) - r[1]
                base = g0 * g0 + g1 * g1
                line = out[t, i0, i1]
                for c in range(c2 - b2, c2 + b2 + 1):
                    g2 = spacing * (c - c2) - r[2]
                    line[c] = weight * np.exp(-rate * np.sqrt(base + g2 * g2))


@njit(cache=True, nogil=True)
def axis_policies(goal_axes, taps, radius, centre, dimension, tolerance, rationality, tables):
    """P_d per axis for separable costs and β = 0: tables (3, T, W) of the first action's components on ±radius cells.

    Arguments as for `sweep`; `centre` is the anchor's index in goal_axes (3, W), the middle of `tables` its own.
    """
    steps, _, count = taps.shape
    reach = count // 2
    middle = (tables.shape[2] - 1) // 2
    tables[:] = 0.0
    values = np.empty(goal_axes.shape[1])
    for axis in range(3):
        if axis < 3 - dimension:
            tables[axis, reach] = 1.0
            continue
        values[:] = goal_axes[axis]
        for j in range(steps - 1, 0, -1):
            box = radius + reach * j
            lower = np.empty(2 * box + 1)
            for i in range(2 * box + 1):
                best = np.inf
                for u in range(count):
                    best = min(best, taps[j, axis, u] + values[centre - box + i + u - reach])
                lower[i] = best + goal_axes[axis, centre - box + i]
            values[centre - box : centre + box + 1] = lower
        for i in range(-radius, radius + 1):
            best = np.inf
            for u in range(count):
                best = min(best, taps[0, axis, u] + values[centre + i + u - reach])
            total = 0.0
            for u in range(count):
                gap = taps[0, axis, u] + values[centre + i + u - reach] - best
                weight = 1.0 if gap <= tolerance * abs(best) + 1e-12 else 0.0
                if np.isfinite(rationality):
                    weight = np.exp(-rationality * gap)
                tables[axis, u, middle + i] = weight
                total += weight
            for u in range(count):
                tables[axis, u, middle + i] /= total
