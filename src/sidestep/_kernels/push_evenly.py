"""Mass that moves at random: evenly over all components of the action, one axis after another (Eq. 4).

A box is (6,) cells from the anchor, first and last on each axis. Sections as in `push`; the mass at a half instant is a
dense flat block, see `blocks`. Among walls only the cells from which every action is admissible are dealt with here,
the others in `push_walled`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep._kernels.push_walled import all_admissible, spread_walled_midway
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep.types import FloatArray, IntArray


@njit(**KERNEL, nogil=True)
def _read_row(
    flat: FloatArray, at: int, n: int, reach: int, masks: IntArray, cell: int, actions: int, line: FloatArray
) -> None:
    """Read n cells from flat[at] into `line`, between 2·reach zeros on either side; 0 also where walls are near."""
    for c in range(2 * reach):
        line[c] = 0.0
        line[2 * reach + n + c] = 0.0
    to, from_ = np.uintp(2 * reach), np.uintp(at)
    for c in range(np.uintp(n)):
        line[to + c] = flat[from_ + c]
    for c in range(n if masks.size > 0 else 0):
        if not all_admissible(masks, cell + c, actions):
            line[2 * reach + c] = 0.0


@njit(**KERNEL, nogil=True)
def _sum_along(line: FloatArray, n: int, count: int, flat: FloatArray, at: int) -> None:
    """flat[at + c] = Σ_u line[c + u], 0 ≤ u < count, for n cells."""
    to, one = np.uintp(at), np.uintp(1)
    two, three, four = one + one, one + one + one, one + one + one + one
    if count == 5:
        for c in range(np.uintp(n)):
            flat[to + c] = (line[c] + line[c + one]) + (line[c + two] + line[c + three]) + line[c + four]
        return
    for c in range(np.uintp(n)):
        total = line[c]
        for u in range(one, np.uintp(count)):
            total += line[c + u]
        flat[to + c] = total


@njit(**KERNEL, nogil=True)
def _sum_every_other(line: FloatArray, first: int, n: int, terms: int, flat: FloatArray, at: int) -> None:
    """flat[at + 2c] = Σ_t line[first + c + t], 0 ≤ t < terms, for n cells."""
    to, i, one, two = np.uintp(at), np.uintp(first), np.uintp(1), np.uintp(2)
    if terms == 3:
        for c in range(np.uintp(n)):
            flat[to + two * c] = line[i + c] + line[i + c + one] + line[i + c + two]
        return
    if terms == 2:
        for c in range(np.uintp(n)):
            flat[to + two * c] = line[i + c] + line[i + c + one]
        return
    for c in range(np.uintp(n)):
        total = 0.0
        for t in range(np.uintp(terms)):
            total += line[i + c + t]
        flat[to + two * c] = total


@njit(**KERNEL, nogil=True)
def _add_rows(
    flat: FloatArray, first: int, stride: int, count: int, n: int, share: float, target: FloatArray, at: int
) -> None:
    """target[at + c] += share · Σ_i flat[first + i·stride + c], 0 ≤ i < count, for n cells."""
    to, i0, step = np.uintp(at), np.uintp(first), np.uintp(stride)
    i1 = i0 + step
    i2, i3 = i1 + step, i1 + step + step
    i4 = i3 + step
    if count == 5:
        for c in range(np.uintp(n)):
            both = (flat[i0 + c] + flat[i1 + c]) + (flat[i2 + c] + flat[i3 + c])
            target[to + c] += share * (both + flat[i4 + c])
        return
    if count == 3:
        for c in range(np.uintp(n)):
            target[to + c] += share * (flat[i0 + c] + flat[i1 + c] + flat[i2 + c])
        return
    if count == 2:
        for c in range(np.uintp(n)):
            target[to + c] += share * (flat[i0 + c] + flat[i1 + c])
        return
    for u in range(count):
        i = i0 + np.uintp(u) * step
        for c in range(np.uintp(n)):
            target[to + c] += share * flat[i + c]


@njit(**KERNEL, nogil=True)
def spread_evenly(
    field: FloatArray,
    section: int,
    box: IntArray,
    centre: int,
    reach: int,
    dimension: int,
    share: float,
    masks: IntArray,
    middle: int,
    to_section: int,
    scratch: FloatArray,
    line: FloatArray,
) -> None:
    """field[to](x + u) += share · field[section](x) / n for every x of a box and all n actions u.

    Args:
        field: all mass.
        section: where it is read.
        box: (6,) where there is any.
        centre: index of the anchor.
        reach: largest action in cells.
        dimension: d.
        share: of the mass that moves this way.
        masks: (words, cells) admissible actions on the box of radius `middle`; size 0: all are.
        middle: see there.
        to_section: where it is added.
        scratch: (2, field.size / 4).
        line: (≥ C + 4·reach,) scratch.
    """
    rows, columns = row_count(centre, dimension), field.shape[1]
    c0, c1 = axis_radius(centre, dimension)
    m0, m1 = axis_radius(middle, dimension)
    r0, r1 = axis_radius(reach, dimension)
    count, n = 2 * reach + 1, box[5] - box[4] + 1
    actions, wide = (2 * r0 + 1) * (2 * r1 + 1) * count, n + 2 * reach
    flat, along, across = field.reshape(field.size), scratch[0], scratch[1]
    column = centre + box[4] - reach
    for i0 in range(box[0], box[1] + 1):
        for i1 in range(box[2], box[3] + 1):
            row = (c0 + i0) * rows + c1 + i1
            cell = ((m0 + i0) * (2 * m1 + 1) + m1 + i1) * (2 * middle + 1) + middle + box[4]
            _read_row(flat, (section + row) * columns + column + reach, n, reach, masks, cell, actions, line)
            _sum_along(line, wide, count, along, row * columns + column)
    part = share / actions
    for i0 in range(box[0], box[1] + 1):
        for i1 in range(box[2] - r1, box[3] + r1 + 1):
            low, high = max(i1 - r1, box[2]), min(i1 + r1, box[3])
            row, first = (c0 + i0) * rows + c1 + i1, ((c0 + i0) * rows + c1 + low) * columns + column
            if dimension < 3:
                at = (to_section + row) * columns + column
                _add_rows(along, first, columns, high - low + 1, wide, part, flat, at)
                continue
            at = row * columns + column
            for c in range(np.uintp(at), np.uintp(at + wide)):
                across[c] = 0.0
            _add_rows(along, first, columns, high - low + 1, wide, 1.0, across, at)
    for i0 in range(box[0] - r0, box[1] + r0 + 1 if dimension == 3 else box[0] - r0):
        low, high = max(i0 - r0, box[0]), min(i0 + r0, box[1])
        for i1 in range(box[2] - r1, box[3] + r1 + 1):
            first = ((c0 + low) * rows + c1 + i1) * columns + column
            at = (to_section + (c0 + i0) * rows + c1 + i1) * columns + column
            _add_rows(across, first, rows * columns, high - low + 1, wide, part, flat, at)


@njit(**KERNEL, nogil=True)
def spread_midway(
    flat: FloatArray,
    start: int,
    radius: int,
    reach: int,
    dimension: int,
    share: float,
    masks: IntArray,
    middle: int,
    to_start: int,
    scratch: FloatArray,
    line: FloatArray,
) -> None:
    """The same for mid-steps: flat[to](2x + u) += share · flat[start](x) / n.

    Args:
        flat: blocks of mass.
        start: where the block of a whole instant begins.
        radius: of its box; that of mid-steps is 2·radius + reach.
        reach: largest action in cells.
        dimension: d.
        share: of the mass that moves this way.
        masks: as for `spread_evenly`.
        middle: likewise.
        to_start: where the block of mid-steps begins.
        scratch: (2, ·) room for a block whose last one or two axes are those of mid-steps.
        line: (≥ 2·radius + 1 + 4·reach,) scratch.
    """
    m0, m1 = axis_radius(middle, dimension)
    b0, b1 = axis_radius(radius, dimension)
    r0, r1 = axis_radius(reach, dimension)
    n, wide = 2 * radius + 1, 4 * radius + 2 * reach + 1
    n0, n1, h0, h1 = 2 * b0 + 1, 2 * b1 + 1, 4 * b0 + 2 * r0 + 1, 4 * b1 + 2 * r1 + 1
    actions = (2 * r0 + 1) * (2 * r1 + 1) * (2 * reach + 1)
    part, along, across = share / actions, scratch[0], scratch[1]
    for i0 in range(n0):
        for i1 in range(n1):
            at, row = (i0 * n1 + i1) * wide, start + (i0 * n1 + i1) * n
            cell = ((m0 - b0 + i0) * (2 * m1 + 1) + m1 - b1 + i1) * (2 * middle + 1) + middle - radius
            _read_row(flat, row, n, reach, masks, cell, actions, line)
            for parity in range(2):  # 2x + u is even, counted from the block's edge, for every other u
                terms = reach + 1 if parity == 0 else reach
                _sum_every_other(line, 2 * reach - terms + 1, n + terms - 1, terms, along, at + parity)
    for i0 in range(n0):
        for o1 in range(h1):
            low, high = _sources(o1, n1, r1)
            first = (i0 * n1 + low) * wide
            if dimension < 3:
                _add_rows(along, first, wide, high - low + 1, wide, part, flat, to_start + o1 * wide)
                continue
            at = (i0 * h1 + o1) * wide
            for c in range(np.uintp(at), np.uintp(at + wide)):
                across[c] = 0.0
            _add_rows(along, first, wide, high - low + 1, wide, 1.0, across, at)
    for o0 in range(h0 if dimension == 3 else 0):
        low, high = _sources(o0, n0, r0)
        for o1 in range(h1):
            first, at = (low * h1 + o1) * wide, to_start + (o0 * h1 + o1) * wide
            _add_rows(across, first, h1 * wide, high - low + 1, wide, part, flat, at)


@njit(**KERNEL, nogil=True)
def _sources(o: int, n: int, reach: int) -> tuple[int, int]:
    """First and last x of n cells with 2x + u = o for some 0 ≤ u ≤ 2·reach."""
    return max((o - 2 * reach + 1) // 2, 0), min(o // 2, n - 1)


@njit(**KERNEL, nogil=True)
def add_midway(
    flat: FloatArray,
    offsets: IntArray,
    reach: int,
    dimension: int,
    share: float,
    masks: IntArray,
    middle: int,
    scratch: FloatArray,
    line: FloatArray,
) -> None:
    """Add what moves evenly to all mid-steps: of all hypotheses at once, as it does not depend on them.

    Args:
        flat: blocks of mass, those of whole instants complete.
        offsets: (2N+2,) where they begin.
        reach: largest action in cells.
        dimension: d.
        share: of the mass that moves this way.
        masks: as for `spread_evenly`.
        middle: likewise.
        scratch: as for `spread_midway`.
        line: likewise.
    """
    for k in range(offsets.size // 2 - 1):
        start, to = offsets[2 * k], offsets[2 * k + 1]
        spread_midway(flat, start, reach * k, reach, dimension, share, masks, middle, to, scratch, line)
        if masks.size > 0:
            spread_walled_midway(flat, start, reach * k, reach, dimension, share, masks, middle, to)
