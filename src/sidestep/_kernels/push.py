"""One step of probability mass (Eqs. 4, 6), whole rows at a time. Layout of cells as in `sweep`; mass is float64.

All mass lies in one array, the field: (rows, C) sections, one after another. A section is named by its first row.
    "Free"
mass ignores the robot, "living" mass is what has not touched it. Mass that moves from x to x + u is at 2x + u at
mid-step, on the lattice with half the spacing; the section of mid-steps keeps the columns in two planes, row 2i
(column c holding 2c) and row 2i + 1 (2c + 1), so that these moves run along rows too.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.bits import lowest_bit
from sidestep._kernels.push_sections import row_span
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep._kernels.sweep_marks import WORD
from sidestep.types import FloatArray, IntArray


@njit(cache=True, nogil=True, error_model="numpy")
def push_separable(
    field: FloatArray,
    section: int,
    radius: int,
    centre: int,
    tables: FloatArray,
    used: FloatArray,
    middle: int,
    share: float,
    dimension: int,
    factor: int,
    to_section: int,
    to_centre: int,
    lines: FloatArray,
) -> None:
    """field[to](factor·x + u) += share · field[section](x) · Π_a tables[a, u_a, x_a].

    Args:
        field: all mass.
        section: where the mass is read, on the box of `radius`.
        radius: of the box with mass.
        centre: index of the anchor in that section.
        tables: (3·T, C') rows axis·T + u + reach: probability of a component of the action.
        used: (3·T,) 0 where a row of `tables` is all zero.
        middle: index of the anchor in `tables`.
        share: of the mass that moves this way.
        dimension: d.
        factor: 1, or 2 for mid-steps.
        to_section: where the mass is added.
        to_centre: index of the anchor there (in dense columns, for mid-steps).
        lines: (≥ 2, C) scratch.
    """
    count = tables.shape[0] // 3
    reach = count // 2
    rows, to_rows = row_count(centre, dimension), row_count(to_centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    o0, o1 = axis_radius(to_centre, dimension)
    m0, m1 = axis_radius(middle, dimension)
    b0, b1 = axis_radius(radius, dimension)
    r0, r1 = axis_radius(reach, dimension)
    planes = np.uintp(factor)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            row = section + (c0 + i0) * rows + c1 + i1
            lo, hi = row_span(field, row, centre - radius, centre + radius + 1)
            if lo == hi:
                continue
            leftmost = to_centre + factor * (lo - centre) - reach
            rightmost = to_centre + factor * (hi - 1 - centre) + reach
            left, right = np.uintp(leftmost // factor), np.uintp(rightmost // factor + 1)
            for p in range(planes):
                for c in range(left, right):
                    lines[p, c] = 0.0
            begin, n, i = np.uintp(lo), np.uintp(hi - lo), np.uintp(row)
            t, from_column = np.uintp(2 * count), np.uintp(middle + lo - centre)
            for u in range(count):
                if used[t] != 0.0:
                    p, to = np.uintp((leftmost + u) % factor), np.uintp((leftmost + u) // factor)
                    for c in range(n):
                        lines[p, to + c] += tables[t, from_column + c] * field[i, begin + c]
                t += np.uintp(1)
            for u0 in range(-r0, r0 + 1):
                for u1 in range(-r1, r1 + 1):
                    part = share
                    if r0 > 0:
                        part *= tables[u0 + reach, m0 + i0]
                    if r1 > 0:
                        part *= tables[count + u1 + reach, m1 + i1]
                    if part == 0.0:
                        continue
                    o = np.uintp(to_section + factor * ((o0 + factor * i0 + u0) * to_rows + o1 + factor * i1 + u1))
                    for p in range(planes):
                        for c in range(left, right):
                            field[o, c] += part * lines[p, c]
                        o += np.uintp(1)


@njit(cache=True, nogil=True, error_model="numpy")
def push_choices(
    field: FloatArray,
    section: int,
    living: int,
    radius: int,
    centre: int,
    masks: IntArray,
    words: int,
    offset: int,
    box: int,
    mixture: FloatArray,
    share: float,
    dimension: int,
    to_section: int,
    to_living: int,
    to_half: int,
    half_centre: int,
) -> None:
    """Move `share` of the mass along chosen actions (see `sweep_choices`); a cell's choices share it evenly (Eq. 5).

    Cells of a row that choose alike lie together; such a run is moved at once, action by action.

    Args:
        field: all mass.
        section: free mass, read on the box of `radius`.
        living: living mass, moved alongside; < 0: none.
        radius: of the box with mass.
        centre: index of the anchor in these sections.
        masks: (words or 2·words, cells), see `sweep_choices.Choices`.
        words: rows of `masks` that hold all actions once.
        offset: column of `masks` where the box of these choices begins.
        box: its radius.
        mixture: (3, T, T) what a chosen component stands for.
        share: of the mass that moves this way.
        dimension: d.
        to_section: where free mass is added.
        to_living: where living mass is added; < 0: not wanted.
        to_half: where mid-step mass is added; < 0: not wanted.
        half_centre: index of its anchor, in dense columns.
    """
    count = mixture.shape[1]
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    x0, x1 = axis_radius(box, dimension)
    r0, r1 = axis_radius(count // 2, dimension)
    spans = _spans(mixture)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            row = section + (c0 + i0) * rows + c1 + i1
            lo, hi = row_span(field, row, centre - radius, centre + radius + 1)
            first = offset + ((x0 + i0) * (2 * x1 + 1) + x1 + i1) * (2 * box + 1) + box - centre
            while lo < hi:
                stop, chosen = _run(masks, first + lo, first + hi)
                part = share / chosen
                for word in range(masks.shape[0]):
                    left = masks[word, first + lo]
                    while left != 0:
                        a = word % words * WORD + lowest_bit(left)
                        left &= left - 1
                        u0 = a // count // (2 * r1 + 1) + count // 2 - r0
                        u1 = a // count % (2 * r1 + 1) + count // 2 - r1
                        _move(
                            field, row, living - section, lo, stop - first - lo, i0, i1, lo - centre, u0, u1, a % count,
                            word >= words, part, mixture, spans, centre, dimension, to_section, to_living, to_half,
                            half_centre,
                        )  # fmt: skip
                lo = stop - first


@njit(cache=True, nogil=True, error_model="numpy")
def push_odds(
    field: FloatArray,
    section: int,
    living: int,
    radius: int,
    centre: int,
    odds: FloatArray,
    offset: int,
    box: int,
    mixture: FloatArray,
    share: float,
    dimension: int,
    to_section: int,
    to_living: int,
    to_half: int,
    half_centre: int,
) -> None:
    """Move `share` of the mass as the probabilities `odds` (n, cells) say; other arguments as for `push_choices`."""
    count = mixture.shape[1]
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    x0, x1 = axis_radius(box, dimension)
    r0, r1 = axis_radius(count // 2, dimension)
    spans = _spans(mixture)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            row = section + (c0 + i0) * rows + c1 + i1
            lo, hi = row_span(field, row, centre - radius, centre + radius + 1)
            first = offset + ((x0 + i0) * (2 * x1 + 1) + x1 + i1) * (2 * box + 1) + box - centre
            for c in range(lo, hi):
                for a in range(odds.shape[0]):
                    if odds[a, first + c] == 0.0:
                        continue
                    u0 = a // count // (2 * r1 + 1) + count // 2 - r0
                    u1 = a // count % (2 * r1 + 1) + count // 2 - r1
                    _move(
                        field, row, living - section, c, 1, i0, i1, c - centre, u0, u1, a % count, False,
                        share * odds[a, first + c], mixture, spans, centre, dimension, to_section, to_living, to_half,
                        half_centre,
                    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _run(masks: IntArray, start: int, stop: int) -> tuple[int, int]:
    """One past the last column that chooses as column `start` does, and how many actions they choose."""
    chosen = 0
    end = stop
    for word in range(masks.shape[0]):
        first = masks[word, start]
        c = start + 1
        while c < end and masks[word, c] == first:
            c += 1
        end = c
        while first != 0:
            first &= first - 1
            chosen += 1
    return end, chosen


@njit(cache=True, nogil=True, error_model="numpy")
def _spans(mixture: FloatArray) -> IntArray:
    """(3, T, 2) first component that a chosen one stands for, and one past the last."""
    spans = np.zeros((3, mixture.shape[1], 2), np.int64)
    for axis in range(3):
        for u in range(mixture.shape[1]):
            for v in range(mixture.shape[1]):
                if mixture[axis, u, v] != 0.0:
                    spans[axis, u, 0] = v if spans[axis, u, 1] == 0 else spans[axis, u, 0]
                    spans[axis, u, 1] = v + 1
    return spans


@njit(cache=True, nogil=True, error_model="numpy")
def _move(
    field: FloatArray,
    row: int,
    to_living_row: int,
    start: int,
    n: int,
    i0: int,
    i1: int,
    i2: int,
    u0: int,
    u1: int,
    u2: int,
    plain: bool,
    share: float,
    mixture: FloatArray,
    spans: IntArray,
    centre: int,
    dimension: int,
    to_section: int,
    to_living: int,
    to_half: int,
    half_centre: int,
) -> None:
    """Add `share` of n cells' mass to where action u leads: free, living (unless to_living < 0), mid-step.

    `plain`: the action stands for itself, not for its mixture.
    """
    reach = mixture.shape[1] // 2
    rows, half_rows = row_count(centre, dimension), row_count(half_centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    h0, h1 = axis_radius(half_centre, dimension)
    i, begin, width = np.uintp(row), np.uintp(start), np.uintp(n)
    alive = np.uintp(row + to_living_row)
    for v0 in range(u0 if plain else spans[0, u0, 0], u0 + 1 if plain else spans[0, u0, 1]):
        for v1 in range(u1 if plain else spans[1, u1, 0], u1 + 1 if plain else spans[1, u1, 1]):
            for v2 in range(u2 if plain else spans[2, u2, 0], u2 + 1 if plain else spans[2, u2, 1]):
                part = share
                if not plain:
                    part *= mixture[0, u0, v0] * mixture[1, u1, v1] * mixture[2, u2, v2]
                line, to = (c0 + i0 + v0 - reach) * rows + c1 + i1 + v1 - reach, np.uintp(centre + i2 + v2 - reach)
                o = np.uintp(to_section + line)
                for c in range(width):
                    field[o, to + c] += part * field[i, begin + c]
                if to_living >= 0:
                    o = np.uintp(to_living + line)
                    for c in range(width):
                        field[o, to + c] += part * field[alive, begin + c]
                if to_half >= 0:
                    column = half_centre + 2 * i2 + v2 - reach
                    line = (h0 + 2 * i0 + v0 - reach) * half_rows + h1 + 2 * i1 + v1 - reach
                    o, to = np.uintp(to_half + 2 * line + column % 2), np.uintp(column // 2)
                    for c in range(width):
                        field[o, to + c] += part * field[i, begin + c]
