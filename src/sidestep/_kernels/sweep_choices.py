"""From values to choices: which first actions are best in every cell, policy by policy (Eqs. 2 and 5).

Choices are bits: action a of a cell is bit a mod 62 of the word in row a // 62 of `masks` (words, cells). The cells of
policy k are a dense box of radius radii[k], beginning at column offsets[k], the last axis fastest. Values may be
float32; what is done with the choices afterwards is the same for both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sidestep._kernels.bits import lowest_bit
from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import CostTables, Values, axis_radius, row_count, sweep
from sidestep._kernels.sweep_marks import WORD, mark_box
from sidestep.types import BoolArray, FloatArray, IntArray


class Choices(NamedTuple):
    """Deliberate actions of every policy.

    Attributes:
        radii: (N,) cells; radius of the box of policy k.
        offsets: (N,) column where it begins.
        words: rows of `masks` that hold all actions once.
        masks: (words or 2·words, cells) bits of the minimisers. The first words are replaced by what they stand for
            (`mixture`); the others, where there are any, stand for themselves because their mixture would lead into a
            wall.
        odds: (n, cells) probabilities of a finite rationality, `masks` not being used; or size 0.
    """

    radii: IntArray
    offsets: IntArray
    words: int
    masks: IntArray
    odds: FloatArray


class ValueScratch(NamedTuple):
    """Arrays that sweeps write to: even and odd (rows, C), plane the same in 3-D, lines (3, C)."""

    even: Values
    odd: Values
    plane: Values
    lines: Values


@njit(**KERNEL, nogil=True)
def _weigh_row(
    cost: Values, first: int, stride: int, start: int, width: int, taps: Values, dimension: int, rationality: float,
    odds: FloatArray, column: int,
) -> None:  # fmt: skip
    """Boltzmann probabilities of all actions for a row of cells; all 0 where nothing is admissible."""
    count = taps.shape[2]
    r0, r1 = axis_radius(count // 2, dimension)
    for c in range(width):
        best, total = np.inf, 0.0
        for phase in range(3):
            for a in range(odds.shape[0]):
                u0, u1, u2 = a // count // (2 * r1 + 1), a // count % (2 * r1 + 1), a % count
                tap = taps[0, 0, u0 + count // 2 - r0] + taps[0, 1, u1 + count // 2 - r1] + taps[0, 2, u2]
                value = tap + cost[first + u0 * stride + u1, start + c + u2]
                if phase == 0:
                    best = min(best, value)
                elif phase == 1:
                    odds[a, column + c] = np.exp(-rationality * (value - best)) if value < np.inf else 0.0
                    total += odds[a, column + c]
                elif total > 0.0:
                    odds[a, column + c] /= total


@njit(**KERNEL, nogil=True)
def _blocked(
    free: BoolArray, row: int, stride: int, column: int, mixture: FloatArray, dimension: int, action: int
) -> bool:
    """Whether anything that an action stands for leads into a wall."""
    count = mixture.shape[1]
    reach = count // 2
    r0, r1 = axis_radius(reach, dimension)
    u0, u1, u2 = (
        action // count // (2 * r1 + 1) + reach - r0,
        action // count % (2 * r1 + 1) + reach - r1,
        action % count,
    )
    for v0 in range(-r0, r0 + 1):
        for v1 in range(-r1, r1 + 1 if mixture[0, u0, v0 + reach] > 0.0 else -r1):
            for v2 in range(count if mixture[1, u1, v1 + reach] > 0.0 else 0):
                if mixture[2, u2, v2] > 0.0 and not free[row + v0 * stride + v1, column + v2 - reach]:
                    return True
    return False


@njit(**KERNEL, nogil=True)
def heed_walls(
    free: BoolArray,
    row: int,
    stride: int,
    column: int,
    mixture: FloatArray,
    dimension: int,
    choices: Choices,
    cell: int,
) -> None:
    """Give a cell without any choice the action "stay"; let choices whose mixture is blocked stand for themselves."""
    masks, odds, words = choices.masks, choices.odds, choices.words
    reach = mixture.shape[1] // 2
    r0, r1 = axis_radius(reach, dimension)
    stay = ((2 * r0 + 1) * (2 * r1 + 1) * mixture.shape[1]) // 2
    some = False
    if odds.size > 0:
        for a in range(odds.shape[0]):
            some = some or odds[a, cell] > 0.0
        if not some:
            odds[stay, cell] = 1.0
        return
    for word in range(words):
        bits = masks[word, cell]
        some = some or bits != 0
        while masks.shape[0] > words and bits != 0:
            bit = bits & -bits
            bits ^= bit
            if _blocked(free, row, stride, column, mixture, dimension, word * WORD + lowest_bit(bit)):
                masks[word, cell] ^= bit
                masks[words + word, cell] |= bit
    if not some:
        masks[stay // WORD, cell] = np.int64(1) << np.int64(stay % WORD)


@njit(**KERNEL, nogil=True)
def choose(
    goal_axes: Values, goal_table: Values, danger_axes: Values, danger_table: Values, taps: Values, danger: bool,
    lead: int, first: int, last: int, differs: BoolArray, centre: int, dimension: int, tolerance: float,
    rationality: float, free: BoolArray, mixture: FloatArray, even: Values, odd: Values, plane: Values, lines: Values,
    radii: IntArray, offsets: IntArray, words: int, masks: IntArray, odds: FloatArray,
) -> None:  # fmt: skip
    """Sweep policies first ≤ k < last and write their choices.

    Args:
        goal_axes, goal_table, danger_axes, danger_table: see `CostTables`; like the other tuples they come one by one,
            as to hand compiled code a tuple takes longer.
        taps: (M, 3, T) cost of the components of the M actions ahead.
        danger: β.
        lead: 1 if the robot's motion is anticipated, 0 if it is taken to stay where it is.
        first: first policy.
        last: one past the last.
        differs: (N,) False: policy k is not wanted.
        centre: index of the anchor in arrays of values.
        dimension: d.
        tolerance: relative; costs this close are tied.
        rationality: 1/cost, or inf.
        free: cells a person may occupy, laid out as values, or size 0.
        mixture: (3, T, T) what a chosen component stands for.
        even, odd, plane, lines: see `ValueScratch`.
        radii, offsets, words, masks, odds: see `Choices`; written to.
    """
    costs = CostTables(goal_axes, goal_table, danger_axes, danger_table)
    scratch, choices = ValueScratch(even, odd, plane, lines), Choices(radii, offsets, words, masks, odds)
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    r0, r1 = axis_radius(taps.shape[2] // 2, dimension)
    groups = np.empty(scratch.lines.shape[1], np.int32)
    for k in range(first, last):
        if not differs[k]:
            continue
        radius = choices.radii[k]
        b0, b1 = axis_radius(radius, dimension)
        width = 2 * radius + 1
        cost = sweep(
            costs, k + lead, danger, taps, radius, centre, dimension, scratch.even, scratch.odd, scratch.plane,
            scratch.lines,
        )  # fmt: skip
        if choices.odds.size == 0:
            spare = scratch.even if taps.shape[0] % 2 == 1 else scratch.odd  # where the sweep did not end
            mark_box(
                cost, taps, radius, centre, dimension, tolerance, spare, scratch.plane, scratch.lines, groups,
                choices.masks, choices.offsets[k],
            )  # fmt: skip
        for line in range((2 * b0 + 1) * (2 * b1 + 1)):
            i0, i1 = line // (2 * b1 + 1), line % (2 * b1 + 1)
            row = (c0 - b0 + i0) * rows + c1 - b1 + i1
            at = choices.offsets[k] + line * width
            corner, start = row - r0 * rows - r1, centre - radius - taps.shape[2] // 2
            if choices.odds.size > 0:
                _weigh_row(cost, corner, rows, start, width, taps, dimension, rationality, choices.odds, at)
            if free.size > 0:
                for c in range(width):
                    heed_walls(free, row, rows, centre - radius + c, mixture, dimension, choices, at + c)


@njit(**KERNEL, nogil=True)
def mark_admissible(free: BoolArray, centre: int, dimension: int, reach: int, radius: int, masks: IntArray) -> None:
    """Bits of the actions that end in a free cell, for the box of `radius`; where there is none, of "stay"."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    r0, r1 = axis_radius(reach, dimension)
    cell = 0
    for i0 in range(c0 - b0, c0 + b0 + 1):
        for i1 in range(c1 - b1, c1 + b1 + 1):
            for i2 in range(centre - radius, centre + radius + 1):
                a, some = 0, False
                for u0 in range(-r0, r0 + 1):
                    for u1 in range(-r1, r1 + 1):
                        for u2 in range(-reach, reach + 1):
                            if free[(i0 + u0) * rows + i1 + u1, i2 + u2]:
                                masks[a // WORD, cell] |= np.int64(1) << np.int64(a % WORD)
                                some = True
                            a += 1
                if not some:
                    masks[a // 2 // WORD, cell] = np.int64(1) << np.int64(a // 2 % WORD)
                cell += 1
