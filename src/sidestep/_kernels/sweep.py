"""Backward induction on the lattice (Eq. 2): value-only min-plus sweeps.

Layout: an array over cells has two axes, (rows, columns). A lattice of d dimensions keeps its last axis as columns; the
others, padded to two by axes of one cell, are the rows i0·R + i1, R being the number of cells of axis 1. So one
compiled kernel serves 1-D, 2-D and 3-D. A box of radius ρ around the anchor is `centre ± ρ` on the real axes.

Rows are named by an index, never cut out as views, and inner loops run over unsigned indices: views cost more than a
short row, and signed indices keep the loops from being vectorised.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep.types import IntArray

Values = NDArray[np.floating[Any]]


class CostTables(NamedTuple):
    """Stage costs c_t(x) = goal(x) + danger_t(x) in one dtype; whichever form is separable is kept per axis.

    Attributes:
        goal_axes: (3, C) summed over axes; not used where there is a `goal_table`.
        goal_table: (rows, C), or (0, 0); carries +inf where a person cannot be.
        danger_axes: (3·T, C), rows 3t + axis, multiplied over axes, the weight in the first; ones where there is a
            table.
        danger_table: (T·rows, C), or (0, 0).
    """

    goal_axes: Values
    goal_table: Values
    danger_axes: Values
    danger_table: Values


@njit(**KERNEL, nogil=True, forceinline=True)
def axis_radius(radius: int, dimension: int) -> tuple[int, int]:
    """Radius on the axes 0 and 1: 0 where the axis only pads to three (axis 2 is always real)."""
    return radius if dimension == 3 else 0, radius if dimension >= 2 else 0


@njit(**KERNEL, nogil=True, forceinline=True)
def row_count(centre: int, dimension: int) -> int:
    """R, cells of axis 1 in an array whose anchor is at `centre`."""
    return 2 * centre + 1 if dimension >= 2 else 1


@njit(**KERNEL, nogil=True)
def _lower_rows(
    source: Values,
    stride: int,
    first: int,
    last: int,
    start: int,
    stop: int,
    taps: Values,
    j: int,
    out: Values,
    back: int,
) -> None:
    """out[i − back, c] = min_u taps[j, 0, u] + source[i + (u − reach)·stride, c], first ≤ i < last, c likewise."""
    begin, end, step = np.uintp(start), np.uintp(stop), np.uintp(stride)
    count = taps.shape[2]
    for i in range(first, last):
        o, low = np.uintp(i - back), np.uintp(i - count // 2 * stride)
        if count == 5:
            t0, t1, t2, t3, t4 = taps[j, 0, 0], taps[j, 0, 1], taps[j, 0, 2], taps[j, 0, 3], taps[j, 0, 4]
            i1 = low + step
            i2 = i1 + step
            i3 = i2 + step
            i4 = i3 + step
            for c in range(begin, end):
                a = t0 + source[low, c]
                b = t1 + source[i1, c]
                e = t2 + source[i2, c]
                f = t3 + source[i3, c]
                g = t4 + source[i4, c]
                a = a if a < b else b
                e = e if e < f else f
                a = a if a < e else e
                out[o, c] = a if a < g else g
            continue
        for u in range(count):
            tap, row = taps[j, 0, u], low + np.uintp(u) * step
            for c in range(begin, end):
                q = tap + source[row, c]
                out[o, c] = q if u == 0 or q < out[o, c] else out[o, c]


@njit(**KERNEL, nogil=True)
def lower_layer(
    source: Values,
    shift: int,
    first: int,
    last: int,
    spans: IntArray,
    span: int,
    taps: Values,
    j: int,
    across: bool,
    goal: Values,
    goal_row: int,
    goal_step: int,
    perils: Values,
    peril_row: int,
    peril_step: int,
    lines: Values,
    target: Values,
) -> None:
    """One layer (axes 1 and 2) of a stage: target[i, c] = stage cost + min over both components of the action.

    Rows first ≤ i < last, of row i the columns spans[span + i − first, 0] to spans[span + i − first, 1]. The source's
    rows differ by `shift` from the target's. `across` False: there is no axis 1. Row i of the goal's and the danger's
    terms is goal_row + goal_step·(i − first), peril_row likewise; to the goal's it adds lines[1, i − first], the
    danger's it multiplies by lines[2, i − first]. j = M: the stage cost alone. lines[0] is scratch.
    """
    count = taps.shape[2]
    reach = np.uintp(count // 2)
    one, two, zero = np.uintp(1), np.uintp(2), np.uintp(0)
    ahead, five = j < taps.shape[0], count == 5
    k = j if ahead else 0
    t0, t1 = taps[k, 1, 0], taps[k, 1, 1 % count]
    t2, t3, t4 = taps[k, 1, 2 % count], taps[k, 1, 3 % count], taps[k, 1, 4 % count]
    s0, s1 = taps[k, 2, 0], taps[k, 2, 1 % count]
    s2, s3, s4 = taps[k, 2, 2 % count], taps[k, 2, 3 % count], taps[k, 2, 4 % count]
    for i in range(first, last):
        t, low = np.uintp(i), np.uintp(i - shift - (count // 2 if across else 0) if ahead else i)
        h, g = np.uintp(goal_row + goal_step * (i - first)), np.uintp(peril_row + peril_step * (i - first))
        scalar, factor = lines[1, i - first], lines[2, i - first]
        begin, end = np.uintp(spans[span + i - first, 0]), np.uintp(spans[span + i - first, 1] + 1)
        if not ahead:
            for c in range(begin, end):
                target[t, c] = (scalar + goal[h, c]) + factor * perils[g, c]
            continue
        if across and five:
            i1, i2, i3, i4 = low + one, low + two, low + one + two, low + two + two
            for c in range(begin - reach, end + reach):
                a = t0 + source[low, c]
                b = t1 + source[i1, c]
                e = t2 + source[i2, c]
                f = t3 + source[i3, c]
                q = t4 + source[i4, c]
                a = a if a < b else b
                e = e if e < f else f
                a = a if a < e else e
                lines[zero, c] = a if a < q else q
        elif across:
            for u in range(count):
                tap, row = taps[k, 1, u], low + np.uintp(u)
                for c in range(begin - reach, end + reach):
                    q = tap + source[row, c]
                    lines[zero, c] = q if u == 0 or q < lines[zero, c] else lines[zero, c]
        else:
            for c in range(begin - reach, end + reach):
                lines[zero, c] = source[low, c]
        if five:
            for c in range(begin, end):
                a = s0 + lines[zero, c - two]
                b = s1 + lines[zero, c - one]
                e = s2 + lines[zero, c]
                f = s3 + lines[zero, c + one]
                q = s4 + lines[zero, c + two]
                a = a if a < b else b
                e = e if e < f else f
                a = a if a < e else e
                a = a if a < q else q
                target[t, c] = (scalar + goal[h, c]) + factor * perils[g, c] + a
            continue
        for c in range(begin, end):
            best = s0 + lines[zero, c - reach]
            for u in range(np.uintp(1), np.uintp(count)):
                q = taps[k, 2, u] + lines[zero, c - reach + u]
                best = q if q < best else best
            target[t, c] = (scalar + goal[h, c]) + factor * perils[g, c] + best


@njit(**KERNEL, nogil=True)
def sweep(
    costs: CostTables,
    first_instant: int,
    danger: bool,
    taps: Values,
    radius: int,
    centre: int,
    dimension: int,
    even: Values,
    odd: Values,
    plane: Values,
    lines: Values,
) -> Values:
    """C(x) = c_1(x) + V_1(x), the cost of arriving at x with the first action, on the box of `radius` + reach.

    Stage j = M..1 lowers the values of stage j + 1, one min-plus pass per axis, and adds its own cost.

    Args:
        costs: stage costs; instant `first_instant + j − 1` of the danger belongs to stage j = 1..M.
        first_instant: index of the robot's position at the first charged instant.
        danger: False leaves the danger term out (β = 0).
        taps: (M, 3, 2·reach + 1) cost of the components of action j = 0..M−1; [0] is not used here.
        radius: of the box of cells whose first action is wanted.
        centre: index of the anchor on the real axes of `even` and `odd`.
        dimension: d.
        even: (rows, C) scratch for values.
        odd: the same.
        plane: (R, C) scratch.
        lines: (3, C) scratch.

    Returns:
        the scratch array that holds C.
    """
    steps, reach = taps.shape[0], taps.shape[2] // 2
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    _, r1 = axis_radius(reach, dimension)
    goal_axes, danger_axes = costs.goal_axes, costs.danger_axes
    goal_by_table, danger_by_table = costs.goal_table.size > 0, danger and costs.danger_table.size > 0
    goal = costs.goal_table if goal_by_table else goal_axes
    perils = goal_axes
    if danger:
        perils = costs.danger_table if danger_by_table else danger_axes
    source, target, spans = odd, even, np.empty((rows, 2), np.int64)
    for j in range(steps, 0, -1):
        source, target = target, source
        instant, box = first_instant + j - 1, radius + reach * j
        b0, b1 = axis_radius(box, dimension)
        for n in range(2 * b1 + 1):
            spans[n, 0], spans[n, 1] = centre - box, centre + box
        for i0 in range(c0 - b0, c0 + b0 + 1):
            for n in range(2 * b1 + 1):
                lines[1, n] = 0.0 if goal_by_table else goal_axes[0, i0] + goal_axes[1, c1 - b1 + n]
                lines[2, n] = 1.0 if danger_by_table else 0.0
                if danger and not danger_by_table:
                    lines[2, n] = danger_axes[3 * instant, i0] * danger_axes[3 * instant + 1, c1 - b1 + n]
            first, last = i0 * rows + c1 - b1, i0 * rows + c1 + b1 + 1
            peril_row = 3 * instant + 2 if danger else 2
            if danger_by_table:
                peril_row = instant * (2 * c0 + 1) * rows + first
            layer, shift = source, 0
            if dimension == 3 and j < steps:
                _lower_rows(
                    source, rows, first - r1, last + r1, centre - box - reach, centre + box + 1 + reach, taps, j, plane,
                    i0 * rows,
                )  # fmt: skip
                layer, shift = plane, i0 * rows
            lower_layer(
                layer, shift, first, last, spans, 0, taps, j, dimension >= 2, goal,
                first if goal_by_table else 2, 1 if goal_by_table else 0, perils, peril_row,
                1 if danger_by_table else 0, lines, target,
            )  # fmt: skip
    return target
