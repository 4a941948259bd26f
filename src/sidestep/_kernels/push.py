"""One step of probability mass (Eqs. 4, 6), whole rows at a time. Layout as in `sweep`; mass is always float64.

Mid-steps: mass that moves from x to x + u is halfway at 2x + u on the lattice with half the spacing. There the columns are kept
in two planes, rows 2i (even columns, column c holding 2c) and 2i + 1 (odd ones, 2c + 1), so that these moves run along rows too.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.sweep import Values, axis_radius, row_count
from sidestep.types import FloatArray


@njit(cache=True, nogil=True)
def clear(array: FloatArray, radius: int, centre: int, dimension: int, planes: int) -> None:
    """Set the rows of a box to 0 over their whole length."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    for i0 in range(c0 - b0, c0 + b0 + 1):
        first = (i0 * rows + c1 - b1) * planes
        for i in range(np.uintp(first), np.uintp(first + (2 * b1 + 1) * planes)):
            for c in range(np.uintp(array.shape[1])):
                array[i, c] = 0.0


@njit(cache=True, nogil=True)
def add_box(source: FloatArray, target: FloatArray, radius: int, centre: int, dimension: int) -> None:
    """target += source on a box of two arrays of the same layout."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    for i0 in range(c0 - b0, c0 + b0 + 1):
        for i in range(np.uintp(i0 * rows + c1 - b1), np.uintp(i0 * rows + c1 + b1 + 1)):
            for c in range(np.uintp(centre - radius), np.uintp(centre + radius + 1)):
                target[i, c] += source[i, c]


@njit(cache=True, nogil=True)
def add_planes(half: FloatArray, half_centre: int, radius: int, dimension: int, flat: FloatArray, start: int) -> None:
    """Add mid-step mass in planes to the dense array of `radius` that begins at flat[start]."""
    rows = row_count(half_centre, dimension)
    c0, c1 = axis_radius(half_centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    width = 2 * radius + 1
    lowest = (half_centre - radius) % 2
    for i0 in range(2 * b0 + 1):
        for i1 in range(2 * b1 + 1):
            row = 2 * ((c0 - b0 + i0) * rows + c1 - b1 + i1)
            at = start + (i0 * (2 * b1 + 1) + i1) * width
            for parity in range(2):
                skip = (parity + lowest) % 2
                plane, first = np.uintp(row + parity), np.uintp((half_centre - radius + skip) // 2)
                to = np.uintp(at + skip)
                for c in range(np.uintp((width - skip + 1) // 2)):
                    flat[to + np.uintp(2) * c] += half[plane, first + c]


@njit(cache=True, nogil=True)
def row_span(mass: FloatArray, row: int, start: int, stop: int) -> tuple[int, int]:
    """First column with mass and one past the last within [start, stop); equal if there is none."""
    while start < stop and mass[row, start] == 0.0:
        start += 1
    while stop > start and mass[row, stop - 1] == 0.0:
        stop -= 1
    return start, stop


@njit(cache=True, nogil=True)
def push_separable(
    mass: FloatArray,
    radius: int,
    centre: int,
    tables: FloatArray,
    used: FloatArray,
    middle: int,
    share: float,
    dimension: int,
    factor: int,
    out: FloatArray,
    out_centre: int,
    line: FloatArray,
) -> None:
    """out(factor·x + u) += share · mass(x) · Π_a tables[a, u_a, x_a].

    Args:
        mass: (rows, C), read on the box of `radius` around `centre`.
        radius: of the box with mass.
        centre: index of the anchor in `mass`.
        tables: (3·T, C') rows axis·T + u + reach: probability of a component of the action.
        used: (3·T,) 0 where a row of `tables` is all zero.
        middle: index of the anchor in `tables`.
        share: of the mass that moves this way.
        dimension: d.
        factor: 1, or 2 for mid-steps (`out` then in planes).
        out: added to.
        out_centre: index of the anchor in `out` (in dense columns, for mid-steps).
        line: (2, C'') scratch, as long as rows of `out`.
    """
    count = tables.shape[0] // 3
    reach = count // 2
    planes = factor
    rows, out_rows = row_count(centre, dimension), row_count(out_centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    o0, o1 = axis_radius(out_centre, dimension)
    m0, m1 = axis_radius(middle, dimension)
    b0, b1 = axis_radius(radius, dimension)
    r0, r1 = axis_radius(reach, dimension)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            row = (c0 + i0) * rows + c1 + i1
            lo, hi = row_span(mass, row, centre - radius, centre + radius + 1)
            if lo == hi:
                continue
            if factor == 1:
                left = out_centre + lo - centre - reach
                right = out_centre + hi - centre + reach
            else:
                left = (out_centre + 2 * (lo - centre) - reach) // 2
                right = (out_centre + 2 * (hi - 1 - centre) + reach) // 2 + 1
            for parity in range(np.uintp(planes)):
                for c in range(np.uintp(left), np.uintp(right)):
                    line[parity, c] = 0.0
            begin, n, i = np.uintp(lo), np.uintp(hi - lo), np.uintp(row)
            for u in range(-reach, reach + 1):
                at = 2 * count + u + reach
                if used[at] == 0.0:
                    continue
                t, from_column = np.uintp(at), np.uintp(middle + lo - centre)
                if factor == 1:
                    p, to = np.uintp(0), np.uintp(out_centre + lo - centre + u)
                else:
                    first = out_centre + 2 * (lo - centre) + u
                    p, to = np.uintp(first % 2), np.uintp(first // 2)
                for c in range(n):
                    line[p, to + c] += tables[t, from_column + c] * mass[i, begin + c]
            for u0 in range(-r0, r0 + 1):
                for u1 in range(-r1, r1 + 1):
                    part = share
                    if r0 > 0:
                        part *= tables[u0 + reach, m0 + i0]
                    if r1 > 0:
                        part *= tables[count + u1 + reach, m1 + i1]
                    if part == 0.0:
                        continue
                    to_row = planes * ((o0 + factor * i0 + u0) * out_rows + o1 + factor * i1 + u1)
                    for parity in range(np.uintp(planes)):
                        o = np.uintp(to_row) + parity
                        for c in range(np.uintp(left), np.uintp(right)):
                            out[o, c] += part * line[parity, c]


@njit(cache=True, nogil=True)
def push_minimisers(
    mass: FloatArray,
    alive: FloatArray,
    both: bool,
    radius: int,
    centre: int,
    cost: Values,
    cost_centre: int,
    taps: Values,
    mixture: FloatArray,
    tolerance: float,
    share: float,
    dimension: int,
    out: FloatArray,
    out_alive: FloatArray,
    half: FloatArray,
    half_centre: int,
    values: Values,
    counts: Values,
    parts: FloatArray,
) -> None:
    """Move `share` of the mass along the minimisers of `cost` (Eq. 5): no walls, infinite rationality.

    Args:
        mass: (rows, C) on the box of `radius` around `centre`.
        alive: the part of it that has touched nobody, moved alongside if `both`.
        both: whether `alive` differs from `mass`.
        radius: of the box with mass.
        centre: index of the anchor in `mass`, `alive`, `out`, `out_alive`.
        cost: C of `sweep`.
        cost_centre: index of the anchor in it.
        taps: (M, 3, T); [0] is the cost of the components of the first action.
        mixture: (3, T, T) what a chosen component stands for, see `push_cells.deliberate`.
        tolerance: relative; costs this close are tied.
        share: of the mass that is deliberate in this way.
        dimension: d.
        out: added to.
        out_alive: added to.
        half: mid-step mass in planes, added to; size 0: not wanted.
        half_centre: index of the anchor in it, in dense columns.
        values: (T³, C) scratch.
        counts: (2, C) scratch.
        parts: (2, C) scratch.
    """
    count = taps.shape[2]
    reach = count // 2
    rows, cost_rows = row_count(centre, dimension), row_count(cost_centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    v0, v1 = axis_radius(cost_centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    r0, r1 = axis_radius(reach, dimension)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            row = (c0 + i0) * rows + c1 + i1
            lo, hi = row_span(mass, row, centre - radius, centre + radius + 1)
            if lo == hi:
                continue
            first = (v0 + i0 - r0) * cost_rows + v1 + i1 - r1
            _rate_row(
                cost, first, cost_rows, r0, r1, cost_centre + lo - centre, hi - lo, taps, tolerance, values, counts
            )
            i, begin = np.uintp(row), np.uintp(lo)
            for c in range(np.uintp(hi - lo)):
                parts[0, c] = share * mass[i, begin + c] / counts[1, c]
            if both:
                for c in range(np.uintp(hi - lo)):
                    parts[1, c] = share * alive[i, begin + c] / counts[1, c]
            _scatter_row(
                i0, i1, lo - centre, hi - lo, r0, r1, mixture, values, counts, parts, both, centre, dimension, out, out_alive,
                half, half_centre,
            )  # fmt: skip


@njit(cache=True, nogil=True)
def _rate_row(
    cost: Values,
    first: int,
    stride: int,
    r0: int,
    r1: int,
    start: int,
    width: int,
    taps: Values,
    tolerance: float,
    values: Values,
    counts: Values,
) -> None:
    """For a row of cells: values[a] of action a, counts[0] the limit of a tie, counts[1] how many actions are within it."""
    count = taps.shape[2]
    reach = count // 2
    n = np.uintp(width)
    one, zero = np.uintp(1), np.uintp(0)
    a = np.uintp(0)
    for u0 in range(-r0, r0 + 1):
        for u1 in range(-r1, r1 + 1):
            i = np.uintp(first + (u0 + r0) * stride + u1 + r1)
            base = taps[0, 0, u0 + reach] + taps[0, 1, u1 + reach]
            for u2 in range(count):
                tap, begin = base + taps[0, 2, u2], np.uintp(start + u2 - reach)
                if a == zero:
                    for c in range(n):
                        values[zero, c] = tap + cost[i, begin + c]
                        counts[zero, c] = values[zero, c]
                else:
                    for c in range(n):
                        q = tap + cost[i, begin + c]
                        values[a, c] = q
                        counts[zero, c] = q if q < counts[zero, c] else counts[zero, c]
                a += one
    nothing = taps[0, 0, 0] - taps[0, 0, 0]
    unit = np.exp(nothing)  # 1 of the values' dtype
    width_of_tie, least = unit * tolerance, unit * 1e-12
    for c in range(n):
        best = counts[zero, c]
        counts[zero, c] = best + width_of_tie * abs(best) + least
        counts[one, c] = nothing
    for b in range(a):
        for c in range(n):
            counts[one, c] += unit if values[b, c] <= counts[zero, c] else nothing


@njit(cache=True, nogil=True)
def _scatter_row(
    i0: int,
    i1: int,
    i2: int,
    width: int,
    r0: int,
    r1: int,
    mixture: FloatArray,
    values: Values,
    counts: Values,
    parts: FloatArray,
    both: bool,
    centre: int,
    dimension: int,
    out: FloatArray,
    out_alive: FloatArray,
    half: FloatArray,
    half_centre: int,
) -> None:
    """Send parts[0] (and parts[1], the living) of the cells (i0, i1, i2…) from the anchor to where their tied actions lead."""
    count = mixture.shape[1]
    reach = count // 2
    rows, half_rows = row_count(centre, dimension), row_count(half_centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    h0, h1 = axis_radius(half_centre, dimension)
    n, zero, one = np.uintp(width), np.uintp(0), np.uintp(1)
    for u0 in range(2 * r0 + 1):
        for u1 in range(2 * r1 + 1):
            for u2 in range(count):
                a = np.uintp((u0 * (2 * r1 + 1) + u1) * count + u2)
                hits = 0
                for c in range(n):
                    hits += 1 if values[a, c] <= counts[zero, c] else 0
                if hits == 0:
                    continue
                for v0 in range(2 * r0 + 1):
                    for v1 in range(2 * r1 + 1):
                        for v2 in range(count):
                            weight = mixture[2, u2, v2]
                            if r0 > 0:
                                weight *= mixture[0, u0, v0]
                            if r1 > 0:
                                weight *= mixture[1, u1, v1]
                            if weight == 0.0:
                                continue
                            o = np.uintp((c0 + i0 + v0 - r0) * rows + c1 + i1 + v1 - r1)
                            to = np.uintp(centre + i2 + v2 - reach)
                            for c in range(n):
                                out[o, to + c] += weight * parts[zero, c] if values[a, c] <= counts[zero, c] else 0.0
                            if both:
                                for c in range(n):
                                    out_alive[o, to + c] += (
                                        weight * parts[one, c] if values[a, c] <= counts[zero, c] else 0.0
                                    )
                            if half.size > 0:
                                column = half_centre + 2 * i2 + v2 - reach
                                line = (h0 + 2 * i0 + v0 - r0) * half_rows + h1 + 2 * i1 + v1 - r1
                                h, at = np.uintp(2 * line + column % 2), np.uintp(column // 2)
                                for c in range(n):
                                    half[h, at + c] += (
                                        weight * parts[zero, c] if values[a, c] <= counts[zero, c] else 0.0
                                    )


@njit(cache=True, nogil=True)
def remove_contact(
    alive: FloatArray,
    radius: int,
    centre: int,
    dimension: int,
    robot: FloatArray,
    spacing: float,
    contact: float,
    fractions: FloatArray,
    step: float,
) -> float:
    """Take out of `alive` what touches the robot and return how much that is.

    Args:
        alive: (rows, C), changed.
        radius: of the box with mass.
        centre: index of the anchor.
        dimension: d.
        robot: (3,) m in the lattice's frame, 0 on the axes that only pad.
        spacing: m.
        contact: m; nearer is contact, if `fractions` is empty.
        fractions: (F,) share removed at distance step·i, linear between, 0 beyond; or size 0.
        step: m.
    """
    support = step * (fractions.size - 1) if fractions.size > 0 else contact
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    bounds, anchor = (b0, b1, radius), (c0, c1, centre)
    lo, hi = np.empty(3, np.int64), np.empty(3, np.int64)
    for a in range(3):
        lo[a] = max(-bounds[a], int(np.ceil(max((robot[a] - support) / spacing, -1e9))))
        hi[a] = min(bounds[a], int(np.floor(min((robot[a] + support) / spacing, 1e9))))
    removed = 0.0
    for i0 in range(lo[0], hi[0] + 1):
        for i1 in range(lo[1], hi[1] + 1):
            for i2 in range(lo[2], hi[2] + 1):
                row, column = (anchor[0] + i0) * rows + anchor[1] + i1, anchor[2] + i2
                here = alive[row, column]
                if here == 0.0:
                    continue
                g0, g1, g2 = spacing * i0 - robot[0], spacing * i1 - robot[1], spacing * i2 - robot[2]
                distance = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
                fraction = 1.0 if fractions.size == 0 and distance < contact else 0.0
                at = distance / step
                index = int(at)
                if index + 1 < fractions.size:
                    fraction = fractions[index] + (at - index) * (fractions[index + 1] - fractions[index])
                alive[row, column] = here * (1.0 - fraction)
                removed += here * fraction
    return removed
