"""One deliberate step of probability mass (Eqs. 4, 6). Layout of cells as in `sweep`; mass is float64.

The mass of one hypothesis lies in one array, the field: (rows, C) sections, one after another, named by their first
row. Mass that moves from x to x + u is at 2x + u at mid-step, on the lattice with half the spacing; that mass is added
to a dense flat block, see `blocks`. A box is (6,) cells from the anchor, first and last on each axis.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sidestep._kernels.bits import lowest_bit
from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep._kernels.sweep_marks import WORD
from sidestep.types import FloatArray, IntArray


class Moves(NamedTuple):
    """Where actions lead: action a to the entries starts[a] ≤ e < starts[a + 1].

    The n actions come twice: standing for what they are a mixture of, and for themselves.

    Attributes:
        starts: (2n + 1,).
        weights: (E,) share of each entry.
        steps: (E, 3) components.
        shifts: (E, 2) how far on the cell lies in the flat field, and in the block of mid-steps.
    """

    starts: IntArray
    weights: FloatArray
    steps: IntArray
    shifts: IntArray


@njit(**KERNEL, nogil=True)
def list_moves(mixture: FloatArray, dimension: int) -> Moves:
    """List the entries of every action; `mixture` (3, T, T) is what a chosen component stands for."""
    count = mixture.shape[1]
    reach = count // 2
    r0, r1 = axis_radius(reach, dimension)
    n = (2 * r0 + 1) * (2 * r1 + 1) * count
    room = n
    for axis in range(3):
        most = 1
        for u in range(count):
            most = max(most, np.count_nonzero(mixture[axis, u]))
        room *= most
    starts, weights, steps = np.zeros(2 * n + 1, np.int64), np.empty(room + n), np.empty((room + n, 3), np.int64)
    end = 0
    for a in range(n):
        u0, u1, u2 = a // count // (2 * r1 + 1) - r0 + reach, a // count % (2 * r1 + 1) - r1 + reach, a % count
        for v0 in range(reach - r0, reach + r0 + 1):
            if mixture[0, u0, v0] == 0.0:
                continue
            for v1 in range(reach - r1, reach + r1 + 1):
                for v2 in range(count if mixture[1, u1, v1] != 0.0 else 0):
                    part = mixture[0, u0, v0] * mixture[1, u1, v1] * mixture[2, u2, v2]
                    if part != 0.0:
                        weights[end], steps[end, 0], steps[end, 1], steps[end, 2] = part, v0, v1, v2
                        end += 1
        starts[a + 1] = end
    for a in range(n):
        weights[end], steps[end, 0] = 1.0, a // count // (2 * r1 + 1) - r0 + reach
        steps[end, 1], steps[end, 2] = a // count % (2 * r1 + 1) - r1 + reach, a % count
        end += 1
        starts[n + a + 1] = end
    steps -= reach
    return Moves(starts, weights, steps, np.zeros((room + n, 2), np.int64))


@njit(**KERNEL, nogil=True)
def place_moves(moves: Moves, rows: int, columns: int, half_radius: int, dimension: int) -> None:
    """Write the shifts for a field of C = `columns` with R = `rows`, and for a block of mid-steps."""
    wide = 2 * half_radius + 1
    high = wide if dimension >= 2 else 1
    for e in range(moves.starts[-1]):
        v0, v1, v2 = moves.steps[e]
        moves.shifts[e, 0] = (v0 * rows + v1) * columns + v2
        moves.shifts[e, 1] = (v0 * high + v1) * wide + v2


@njit(**KERNEL, nogil=True)
def _move(
    flat: FloatArray,
    at: int,
    n: int,
    to: int,
    halves: FloatArray,
    to_half: int,
    share: float,
    moves: Moves,
    action: int,
) -> None:
    """Add `share` of n cells' mass to where an action leads; halves of size 0: not wanted."""
    two, width, i = np.uintp(2), np.uintp(n), np.uintp(at)
    for e in range(moves.starts[action], moves.starts[action + 1]):
        part, o = share * moves.weights[e], np.uintp(to + moves.shifts[e, 0])
        for c in range(width):
            flat[o + c] += part * flat[i + c]
        if halves.size > 0:
            h = np.uintp(to_half + moves.shifts[e, 1])
            for c in range(width):
                halves[h + two * c] += part * flat[i + c]


@njit(**KERNEL, nogil=True)
def _run(masks: IntArray, start: int, stop: int) -> tuple[int, int]:
    """One past the last column that chooses as column `start` does, and how many actions they choose."""
    chosen, end = 0, np.uintp(stop)
    for word in range(np.uintp(masks.shape[0])):
        first, c = masks[word, np.uintp(start)], np.uintp(start) + np.uintp(1)
        while c < end and masks[word, c] == first:
            c += np.uintp(1)
        end = c
        while first != 0:
            first &= first - 1
            chosen += 1
    return int(end), chosen


@njit(**KERNEL, nogil=True, forceinline=True)
def _half_row(start: int, half_radius: int, dimension: int, i0: int, i1: int) -> int:
    """Where the doubled row (i0, i1), column 0, lies among flat blocks."""
    h0, h1 = axis_radius(half_radius, dimension)
    return start + ((h0 + 2 * i0) * (2 * h1 + 1) + h1 + 2 * i1) * (2 * half_radius + 1) + half_radius


@njit(**KERNEL, nogil=True)
def push_choices(
    field: FloatArray,
    section: int,
    box: IntArray,
    centre: int,
    masks: IntArray,
    words: int,
    offset: int,
    middle: int,
    moves: Moves,
    share: float,
    dimension: int,
    to_section: int,
    halves: FloatArray,
    half_start: int,
    half_radius: int,
) -> None:
    """Move `share` of the mass along chosen actions (see `sweep_choices`); a cell's choices share it evenly (Eq. 5).

    Cells of a row that choose alike lie together; such a run is moved at once, action by action.

    Args:
        field: all mass.
        section: where it is read.
        box: (6,) where there is any.
        centre: index of the anchor.
        masks: (words or 2·words, cells), see `sweep_choices.Choices`.
        words: rows of `masks` that hold all actions once.
        offset: column of `masks` where the box of these choices begins.
        middle: its radius.
        moves: what actions stand for, placed.
        share: of the mass that moves this way.
        dimension: d.
        to_section: where mass is added.
        halves: flat blocks; size 0: mid-steps are not wanted.
        half_start: where the block of these mid-steps begins.
        half_radius: of its box.
    """
    rows, columns = row_count(centre, dimension), field.shape[1]
    c0, c1 = axis_radius(centre, dimension)
    x0, x1 = axis_radius(middle, dimension)
    n = (moves.starts.size - 1) // 2
    flat, shift = field.reshape(field.size), (to_section - section) * columns
    for i0 in range(box[0], box[1] + 1):
        for i1 in range(box[2], box[3] + 1):
            at = (section + (c0 + i0) * rows + c1 + i1) * columns + centre
            cell = offset + ((x0 + i0) * (2 * x1 + 1) + x1 + i1) * (2 * middle + 1) + middle
            half = _half_row(half_start, half_radius, dimension, i0, i1)
            i2 = box[4]
            while i2 <= box[5]:
                stop, chosen = _run(masks, cell + i2, cell + box[5] + 1)
                length = stop - cell - i2
                for word in range(masks.shape[0]):
                    bits = masks[word, cell + i2]
                    while bits != 0:
                        action = (n if word >= words else 0) + word % words * WORD + lowest_bit(bits)
                        _move(
                            flat, at + i2, length, at + i2 + shift, halves, half + 2 * i2, share / chosen, moves, action
                        )
                        bits &= bits - 1
                i2 += length


@njit(**KERNEL, nogil=True)
def push_odds(
    field: FloatArray,
    section: int,
    box: IntArray,
    centre: int,
    odds: FloatArray,
    offset: int,
    middle: int,
    moves: Moves,
    share: float,
    dimension: int,
    to_section: int,
    halves: FloatArray,
    half_start: int,
    half_radius: int,
) -> None:
    """Move `share` of the mass as the probabilities `odds` (n, cells) say; other arguments as for `push_choices`."""
    rows, columns = row_count(centre, dimension), field.shape[1]
    c0, c1 = axis_radius(centre, dimension)
    x0, x1 = axis_radius(middle, dimension)
    flat, shift = field.reshape(field.size), (to_section - section) * columns
    for i0 in range(box[0], box[1] + 1):
        for i1 in range(box[2], box[3] + 1):
            at = (section + (c0 + i0) * rows + c1 + i1) * columns + centre
            cell = offset + ((x0 + i0) * (2 * x1 + 1) + x1 + i1) * (2 * middle + 1) + middle
            half = _half_row(half_start, half_radius, dimension, i0, i1)
            for i2 in range(box[4], box[5] + 1):
                for a in range(odds.shape[0] if flat[at + i2] != 0.0 else 0):
                    if odds[a, cell + i2] != 0.0:
                        part = share * odds[a, cell + i2]
                        _move(flat, at + i2, 1, at + i2 + shift, halves, half + 2 * i2, part, moves, a)


@njit(**KERNEL, nogil=True)
def push_separable(
    field: FloatArray,
    section: int,
    box: IntArray,
    centre: int,
    tables: FloatArray,
    used: FloatArray,
    middle: int,
    share: float,
    dimension: int,
    to_section: int,
    halves: FloatArray,
    half_start: int,
    half_radius: int,
) -> None:
    """Move `share` of the mass by Π_a tables[a, u_a, x_a]; other arguments as for `push_choices`.

    Args:
        field: all mass.
        section: where it is read.
        box: (6,) where there is any.
        centre: index of the anchor.
        tables: (3·T, C') rows axis·T + u + reach: probability of a component of the action.
        used: (3·T,) 0 where a row of `tables` is all zero.
        middle: index of the anchor in `tables`.
        share: of the mass that moves this way.
        dimension: d.
        to_section: where mass is added.
        halves: flat blocks, or size 0.
        half_start: see `push_choices`.
        half_radius: likewise.
    """
    count = tables.shape[0] // 3
    reach = count // 2
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    m0, m1 = axis_radius(middle, dimension)
    r0, r1 = axis_radius(reach, dimension)
    high = 2 * half_radius + 1 if dimension >= 2 else 1
    two, n, from_ = np.uintp(2), np.uintp(box[5] - box[4] + 1), np.uintp(centre + box[4])
    table = np.uintp(middle + box[4])
    for i0 in range(box[0], box[1] + 1):
        for i1 in range(box[2], box[3] + 1):
            i = np.uintp(section + (c0 + i0) * rows + c1 + i1)
            half = _half_row(half_start, half_radius, dimension, i0, i1) + 2 * box[4]
            for u in range((2 * r0 + 1) * (2 * r1 + 1) * count):
                u0, u1, u2 = u // count // (2 * r1 + 1) - r0, u // count % (2 * r1 + 1) - r1, u % count - reach
                part, t = share, np.uintp(2 * count + u2 + reach)
                if r0 > 0:
                    part *= tables[u0 + reach, m0 + i0]
                if r1 > 0:
                    part *= tables[count + u1 + reach, m1 + i1]
                if part == 0.0 or used[t] == 0.0:
                    continue
                o = np.uintp(to_section + (c0 + i0 + u0) * rows + c1 + i1 + u1)
                to = np.uintp(centre + box[4] + u2)
                for c in range(n):
                    field[o, to + c] += part * tables[t, table + c] * field[i, from_ + c]
                if halves.size > 0:
                    h = np.uintp(half + (u0 * high + u1) * (2 * half_radius + 1) + u2)
                    for c in range(n):
                        halves[h + two * c] += part * tables[t, table + c] * field[i, from_ + c]
