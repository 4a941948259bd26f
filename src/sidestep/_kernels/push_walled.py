"""Mass near walls that moves at random: evenly over the actions that are admissible there, cell by cell (Eq. 4).

Layout as in `push_evenly`, which deals with the cells from which every action is admissible.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep._kernels.sweep_marks import WORD
from sidestep.types import FloatArray, IntArray


@njit(**KERNEL, nogil=True)
def all_admissible(masks: IntArray, cell: int, actions: int) -> bool:
    """Whether a cell's masks hold the bits of all actions."""
    left = actions
    for word in range(masks.shape[0]):
        if left > 0 and masks[word, cell] != (np.int64(1) << np.int64(min(left, WORD))) - 1:
            return False
        left -= WORD
    return True


@njit(**KERNEL, nogil=True)
def _scatter(
    mass: float, masks: IntArray, cell: int, reach: int, dimension: int, flat: FloatArray, to: int, row: int, layer: int
) -> None:
    """Share `mass` out from flat[to], rows of the middle axis `row` and of the first `layer` apart.

    What is not admissible gets a share of nothing: a branch per action takes longer.
    """
    chosen = 0
    for word in range(masks.shape[0]):
        bits = masks[word, cell]
        while bits != 0:
            bits &= bits - 1
            chosen += 1
    part = mass / max(chosen, 1)
    r0, r1 = axis_radius(reach, dimension)
    word, read, bits = 0, 0, masks[0, cell]
    for u0 in range(-r0, r0 + 1):
        for u1 in range(-r1, r1 + 1):
            at = np.uintp(to + u0 * layer + u1 * row - reach)
            for u2 in range(np.uintp(2 * reach + 1)):
                if read == WORD:
                    word, read = word + 1, 0
                    bits = masks[word, cell]
                flat[at + u2] += part * np.float64(bits & 1)
                bits >>= 1
                read += 1


@njit(**KERNEL, nogil=True)
def spread_walled(
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
) -> None:
    """Steps from the cells that `push_evenly.spread_evenly` leaves out; arguments as there."""
    rows, columns = row_count(centre, dimension), field.shape[1]
    c0, c1 = axis_radius(centre, dimension)
    m0, m1 = axis_radius(middle, dimension)
    r0, r1 = axis_radius(reach, dimension)
    actions = (2 * r0 + 1) * (2 * r1 + 1) * (2 * reach + 1)
    flat, shift = field.reshape(field.size), (to_section - section) * columns
    for i0 in range(box[0], box[1] + 1):
        for i1 in range(box[2], box[3] + 1):
            at = (section + (c0 + i0) * rows + c1 + i1) * columns + centre
            first = ((m0 + i0) * (2 * m1 + 1) + m1 + i1) * (2 * middle + 1) + middle
            for i2 in range(box[4], box[5] + 1):
                mass = float(flat[at + i2])
                if mass != 0.0 and not all_admissible(masks, first + i2, actions):
                    _scatter(
                        share * mass, masks, first + i2, reach, dimension, flat, at + shift + i2, columns,
                        rows * columns,
                    )  # fmt: skip


@njit(**KERNEL, nogil=True)
def spread_walled_midway(
    flat: FloatArray,
    start: int,
    radius: int,
    reach: int,
    dimension: int,
    share: float,
    masks: IntArray,
    middle: int,
    to_start: int,
) -> None:
    """Mid-steps from the cells that `push_evenly.spread_midway` leaves out; arguments as there."""
    m0, m1 = axis_radius(middle, dimension)
    b0, b1 = axis_radius(radius, dimension)
    r0, r1 = axis_radius(reach, dimension)
    actions = (2 * r0 + 1) * (2 * r1 + 1) * (2 * reach + 1)
    high, wide = 4 * b1 + 2 * r1 + 1, 4 * radius + 2 * reach + 1
    at = start
    for i0 in range(2 * b0 + 1):
        for i1 in range(2 * b1 + 1):
            first = ((m0 - b0 + i0) * (2 * m1 + 1) + m1 - b1 + i1) * (2 * middle + 1) + middle - radius
            to = to_start + ((2 * i0 + r0) * high + 2 * i1 + r1) * wide + reach
            for i2 in range(2 * radius + 1):
                mass = flat[at]
                at += 1
                if mass != 0.0 and not all_admissible(masks, first + i2, actions):
                    _scatter(
                        share * mass, masks, first + i2, reach, dimension, flat, to + 2 * i2, wide, high * wide
                    )  # fmt: skip
