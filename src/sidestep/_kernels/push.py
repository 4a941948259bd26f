"""One step of probability mass (Eqs. 4, 6), whole rows at a time. Layout of cells as in `sweep`; mass is always float64.

All mass lies in one array, the field: (rows, C) sections, one after another. A section is named by its first row. "Free" mass ignores
the robot, "living" mass is what has not touched it. Mass that moves from x to x + u is at 2x + u at mid-step, on the lattice
with half the spacing; the section of mid-steps keeps the columns in two planes, row 2i (column c holding 2c) and row 2i + 1
(2c + 1), so that these moves run along rows too.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.sweep import axis_radius, row_count
from sidestep._kernels.sweep_choices import WORD
from sidestep.types import FloatArray, IntArray


@njit(cache=True, nogil=True, error_model="numpy")
def row_span(field: FloatArray, row: int, start: int, stop: int) -> tuple[int, int]:
    """First column with mass and one past the last within [start, stop); equal if there is none."""
    while start < stop and field[row, start] == 0.0:
        start += 1
    while stop > start and field[row, stop - 1] == 0.0:
        stop -= 1
    return start, stop


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
    """Move `share` of the mass along chosen actions (see `sweep_choices`); a cell's choices share its mass evenly (Eq. 5).

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
    zero, one = np.uintp(0), np.uintp(1)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            row = section + (c0 + i0) * rows + c1 + i1
            lo, hi = row_span(field, row, centre - radius, centre + radius + 1)
            if lo == hi:
                continue
            n = np.uintp(hi - lo)
            at = np.uintp(offset + ((x0 + i0) * (2 * x1 + 1) + x1 + i1) * (2 * box + 1) + box + lo - centre)
            _share_out(masks, odds, at, n, share, lines)
            for layer in range(masks.shape[0] // words if odds.size == 0 else 1):
                for a in range(actions):
                    word, shift, unit, some = (
                        np.uintp(layer * words + a // WORD),
                        np.int64(a % WORD),
                        np.int64(1),
                        np.int64(0),
                    )
                    if odds.size > 0:
                        for c in range(n):
                            lines[one, c] = share * odds[np.uintp(a), at + c]
                    else:
                        for c in range(n):
                            some |= masks[word, at + c]
                        if some >> shift & unit == 0:
                            continue
                        for c in range(n):
                            lines[one, c] = lines[zero, c] if masks[word, at + c] >> shift & unit else 0.0
                    u0 = a // count // (2 * r1 + 1) + count // 2 - r0
                    u1 = a // count % (2 * r1 + 1) + count // 2 - r1
                    _scatter(
                        field, row, living - section, lo, n, i0, i1, lo - centre, u0, u1, a % count, layer > 0, mixture, centre,
                        dimension, to_section, to_living, to_half, half_centre, lines,
                    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _share_out(masks: IntArray, odds: FloatArray, at: int, n: int, share: float, lines: FloatArray) -> None:
    """lines[0] = share / number of choices, for a row of n cells from column `at`."""
    zero = np.uintp(0)
    for c in range(n):
        lines[zero, c] = 0.0
    if odds.size > 0:
        return
    for word in range(np.uintp(masks.shape[0])):
        some, unit = np.int64(0), np.int64(1)
        for c in range(n):
            some |= masks[word, at + c]
        for bit in range(WORD):
            shift = np.int64(bit)
            if some >> shift & unit:
                for c in range(n):
                    lines[zero, c] += 1.0 if masks[word, at + c] >> shift & unit else 0.0
    for c in range(n):
        lines[zero, c] = share / lines[zero, c]


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
    i, begin, one, two, three = np.uintp(row), np.uintp(start), np.uintp(1), np.uintp(2), np.uintp(3)
    for c in range(n):
        lines[two, c] = lines[one, c] * field[i, begin + c]
    if to_living >= 0:
        i = np.uintp(row + to_living_row)
        for c in range(n):
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
                for c in range(n):
                    field[o, to + c] += weight * lines[two, c]
                if to_living >= 0:
                    o = np.uintp(to_living + line)
                    for c in range(n):
                        field[o, to + c] += weight * lines[three, c]
                if to_half >= 0:
                    column = half_centre + 2 * i2 + v2 - reach
                    line = (h0 + 2 * i0 + v0 - reach) * half_rows + h1 + 2 * i1 + v1 - reach
                    o, to = np.uintp(to_half + 2 * line + column % 2), np.uintp(column // 2)
                    for c in range(n):
                        field[o, to + c] += weight * lines[two, c]


@njit(cache=True, nogil=True, error_model="numpy")
def add_box(
    field: FloatArray, section: int, radius: int, centre: int, dimension: int, target: FloatArray, to_row: int
) -> None:
    """Add a section's box to rows of `target` that have the section's layout, from `to_row` on."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    for i0 in range(c0 - b0, c0 + b0 + 1):
        for i1 in range(c1 - b1, c1 + b1 + 1):
            i, o = np.uintp(section + i0 * rows + i1), np.uintp(to_row + i0 * rows + i1)
            for c in range(np.uintp(centre - radius), np.uintp(centre + radius + 1)):
                target[o, c] += field[i, c]


@njit(cache=True, nogil=True, error_model="numpy")
def add_planes(
    field: FloatArray, section: int, half_centre: int, radius: int, dimension: int, flat: FloatArray, start: int
) -> None:
    """Add the mid-steps of a section to the dense array of `radius` that begins at flat[start]."""
    rows = row_count(half_centre, dimension)
    c0, c1 = axis_radius(half_centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    width, first = 2 * radius + 1, half_centre - radius
    two = np.uintp(2)
    for i0 in range(2 * b0 + 1):
        for i1 in range(2 * b1 + 1):
            row = section + 2 * ((c0 - b0 + i0) * rows + c1 - b1 + i1)
            at = start + (i0 * (2 * b1 + 1) + i1) * width
            for skip in range(min(2, width)):
                plane, column = np.uintp(row + (first + skip) % 2), np.uintp((first + skip) // 2)
                to = np.uintp(at + skip)
                for c in range(np.uintp((width - skip + 1) // 2)):
                    flat[to + two * c] += field[plane, column + c]


@njit(cache=True, nogil=True, error_model="numpy")
def clear_rows(field: FloatArray, section: int, radius: int, centre: int, dimension: int, planes: int) -> None:
    """Set the rows of a section's box to 0 over their whole length."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    for i0 in range(c0 - b0, c0 + b0 + 1):
        first = section + (i0 * rows + c1 - b1) * planes
        for i in range(np.uintp(first), np.uintp(first + (2 * b1 + 1) * planes)):
            for c in range(np.uintp(field.shape[1])):
                field[i, c] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def remove_contact(
    field: FloatArray,
    section: int,
    radius: int,
    centre: int,
    dimension: int,
    robot: FloatArray,
    spacing: float,
    contact: float,
    fractions: FloatArray,
    instant: int,
    step: float,
) -> float:
    """Take out of a section what touches the robot and return how much that is.

    Args:
        field: all mass, changed.
        section: of the living mass.
        radius: of the box with mass.
        centre: index of the anchor.
        dimension: d.
        robot: (K, 3) m in the lattice's frame, 0 on the axes that only pad; row `instant` is where the robot is.
        spacing: m.
        contact: m; nearer is contact, if `fractions` is empty.
        fractions: (K, F) row `instant`: share removed at distance step·i, linear between, 0 beyond; or size 0.
        instant: k.
        step: m.
    """
    support = step * (fractions.shape[1] - 1) if fractions.size > 0 else contact
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    x0, x1, x2 = robot[instant, 0] / spacing, robot[instant, 1] / spacing, robot[instant, 2] / spacing
    wide, far = support / spacing, 1e9
    removed = 0.0
    for i0 in range(max(-b0, int(np.ceil(max(x0 - wide, -far)))), min(b0, int(np.floor(min(x0 + wide, far)))) + 1):
        for i1 in range(max(-b1, int(np.ceil(max(x1 - wide, -far)))), min(b1, int(np.floor(min(x1 + wide, far)))) + 1):
            left, right = int(np.ceil(max(x2 - wide, -far))), int(np.floor(min(x2 + wide, far)))
            for i2 in range(max(-radius, left), min(radius, right) + 1):
                row, column = section + (c0 + i0) * rows + c1 + i1, centre + i2
                here = field[row, column]
                if here == 0.0:
                    continue
                distance = spacing * np.sqrt((i0 - x0) ** 2 + (i1 - x1) ** 2 + (i2 - x2) ** 2)
                fraction = 1.0 if fractions.size == 0 and distance < contact else 0.0
                at = distance / step
                index = int(at)
                if index + 1 < fractions.shape[1]:
                    low = fractions[instant, index]
                    fraction = low + (at - index) * (fractions[instant, index + 1] - low)
                field[row, column] = here * (1.0 - fraction)
                removed += here * fraction
    return removed
