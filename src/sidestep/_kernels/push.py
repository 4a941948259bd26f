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

from sidestep._kernels.push_sections import row_span
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep._kernels.sweep_choices import WORD
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
    lines: FloatArray,
) -> None:
    """Move `share` of the mass along chosen actions (see `sweep_choices`); a cell's choices share it evenly (Eq. 5).

    Args:
        field: all mass.
        section: free mass, read on the box of `radius`.
        living: living mass, moved alongside; < 0: none.
        radius: of the box with mass.
        centre: index of the anchor in these sections.
        masks: (words or 2·words, cells), see `sweep_choices.Choices`.
        words: rows of `masks` that hold all actions once.
        odds: (n, cells), or size 0.
        offset: column of `masks` or `odds` where the box of these choices begins.
        box: its radius.
        mixture: (3, T, T) what a chosen component stands for.
        share: of the mass that moves this way.
        dimension: d.
        to_section: where free mass is added.
        to_living: where living mass is added.
        to_half: where mid-step mass is added; < 0: not wanted.
        half_centre: index of its anchor, in dense columns.
        lines: (≥ 4, C) scratch.
    """
    count = mixture.shape[1]
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    x0, x1 = axis_radius(box, dimension)
    r0, r1 = axis_radius(count // 2, dimension)
    actions = (2 * r0 + 1) * (2 * r1 + 1) * count
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            row = section + (c0 + i0) * rows + c1 + i1
            lo, hi = row_span(field, row, centre - radius, centre + radius + 1)
            if lo == hi:
                continue
            n = hi - lo
            at = offset + ((x0 + i0) * (2 * x1 + 1) + x1 + i1) * (2 * box + 1) + box + lo - centre
            if odds.size == 0:
                _share_out(masks, at, n, share, lines)
            for layer in range(masks.shape[0] // words if odds.size == 0 else 1):
                for a in range(actions):
                    if odds.size > 0:
                        _read_odds(odds, a, at, n, share, lines)
                    elif not _read_choice(masks, layer * words, a, at, n, lines):
                        continue
                    u0 = a // count // (2 * r1 + 1) + count // 2 - r0
                    u1 = a // count % (2 * r1 + 1) + count // 2 - r1
                    _scatter(
                        field, row, living - section, lo, n, i0, i1, lo - centre, u0, u1, a % count, layer > 0, mixture,
                        centre, dimension, to_section, to_living, to_half, half_centre, lines,
                    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _share_out(masks: IntArray, at: int, n: int, share: float, lines: FloatArray) -> None:
    """lines[0] = share / number of choices, for a row of n cells from column `at`."""
    zero, begin, width = np.uintp(0), np.uintp(at), np.uintp(n)
    for c in range(width):
        lines[zero, c] = 0.0
    for word in range(np.uintp(masks.shape[0])):
        some, unit = np.int64(0), np.int64(1)
        for c in range(width):
            some |= masks[word, begin + c]
        for bit in range(WORD):
            shift = np.int64(bit)
            if some >> shift & unit:
                for c in range(width):
                    lines[zero, c] += 1.0 if masks[word, begin + c] >> shift & unit else 0.0
    for c in range(width):
        lines[zero, c] = share / lines[zero, c]


@njit(cache=True, nogil=True, error_model="numpy")
def _read_choice(masks: IntArray, first_word: int, action: int, at: int, n: int, lines: FloatArray) -> bool:
    """lines[1] = lines[0] where a cell of the row chooses the action, else 0; False if none does."""
    word, begin, width = np.uintp(first_word + action // WORD), np.uintp(at), np.uintp(n)
    zero, one = np.uintp(0), np.uintp(1)
    shift, unit, some = np.int64(action % WORD), np.int64(1), np.int64(0)
    for c in range(width):
        some |= masks[word, begin + c]
    if some >> shift & unit == 0:
        return False
    for c in range(width):
        lines[one, c] = lines[zero, c] if masks[word, begin + c] >> shift & unit else 0.0
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _read_odds(odds: FloatArray, action: int, at: int, n: int, share: float, lines: FloatArray) -> None:
    """lines[1] = share · probability of the action, for a row of n cells from column `at`."""
    row, begin, one = np.uintp(action), np.uintp(at), np.uintp(1)
    for c in range(np.uintp(n)):
        lines[one, c] = share * odds[row, begin + c]


@njit(cache=True, nogil=True, error_model="numpy")
def _scatter(
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
    mixture: FloatArray,
    centre: int,
    dimension: int,
    to_section: int,
    to_living: int,
    to_half: int,
    half_centre: int,
    lines: FloatArray,
) -> None:
    """Add the part lines[1] of a row's mass to where action u leads: free, living (unless to_living < 0), mid-step."""
    count = mixture.shape[1]
    reach = count // 2
    rows, half_rows = row_count(centre, dimension), row_count(half_centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    h0, h1 = axis_radius(half_centre, dimension)
    i, begin, width = np.uintp(row), np.uintp(start), np.uintp(n)
    one, two, three = np.uintp(1), np.uintp(2), np.uintp(3)
    for c in range(width):
        lines[two, c] = lines[one, c] * field[i, begin + c]
    if to_living >= 0:
        i = np.uintp(row + to_living_row)
        for c in range(width):
            lines[three, c] = lines[one, c] * field[i, begin + c]
    for v0 in range(count):
        w0 = mixture[0, u0, v0] if not plain else 1.0 if u0 == v0 else 0.0
        if w0 == 0.0:
            continue
        for v1 in range(count):
            w1 = w0 * mixture[1, u1, v1] if not plain else w0 if u1 == v1 else 0.0
            if w1 == 0.0:
                continue
            for v2 in range(count):
                weight = w1 * mixture[2, u2, v2] if not plain else w1 if u2 == v2 else 0.0
                if weight == 0.0:
                    continue
                line, to = (c0 + i0 + v0 - reach) * rows + c1 + i1 + v1 - reach, np.uintp(centre + i2 + v2 - reach)
                o = np.uintp(to_section + line)
                for c in range(width):
                    field[o, to + c] += weight * lines[two, c]
                if to_living >= 0:
                    o = np.uintp(to_living + line)
                    for c in range(width):
                        field[o, to + c] += weight * lines[three, c]
                if to_half >= 0:
                    column = half_centre + 2 * i2 + v2 - reach
                    line = (h0 + 2 * i0 + v0 - reach) * half_rows + h1 + 2 * i1 + v1 - reach
                    o, to = np.uintp(to_half + 2 * line + column % 2), np.uintp(column // 2)
                    for c in range(width):
                        field[o, to + c] += weight * lines[two, c]
