"""Boxes of the field of masses (see `push`): cleared, read out, and what of them touches the robot."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep.types import FloatArray, IntArray


@njit(**KERNEL, nogil=True)
def set_box(box: IntArray, radius: int, dimension: int) -> None:
    """Write the box of a radius around the anchor."""
    r0, r1 = axis_radius(radius, dimension)
    box[0], box[1], box[2], box[3], box[4], box[5] = -r0, r0, -r1, r1, -radius, radius


@njit(**KERNEL, nogil=True)
def cover(box: IntArray, reach: int, dimension: int, other: IntArray, out: IntArray) -> bool:
    """Write the box that holds `box`, grown by `reach`, and `other`, either of which may be empty; False: both are.

    `out` may be `box` itself.
    """
    r0, r1 = axis_radius(reach, dimension)
    some = box[0] <= box[1]
    more = other[0] <= other[1] and other[2] <= other[3] and other[4] <= other[5]
    for axis in range(3):
        wide = r0 if axis == 0 else r1 if axis == 1 else reach
        low, high = box[2 * axis] - wide, box[2 * axis + 1] + wide
        if more:
            low = min(low, other[2 * axis]) if some else other[2 * axis]
            high = max(high, other[2 * axis + 1]) if some else other[2 * axis + 1]
        out[2 * axis], out[2 * axis + 1] = low, high
    return some or more


@njit(**KERNEL, nogil=True)
def _sum_slab(field: FloatArray, section: int, box: IntArray, centre: int, dimension: int, axis: int, at: int) -> float:
    """Mass in the cells of a box that lie at `at` on an axis."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    a0, b0 = (at, at) if axis == 0 else (box[0], box[1])
    a1, b1 = (at, at) if axis == 1 else (box[2], box[3])
    a2, b2 = (at, at) if axis == 2 else (box[4], box[5])
    total = 0.0
    for i0 in range(c0 + a0, c0 + b0 + 1):
        for i1 in range(c1 + a1, c1 + b1 + 1):
            for c in range(centre + a2, centre + b2 + 1):
                total += field[section + i0 * rows + i1, c]
    return total


@njit(**KERNEL, nogil=True)
def trim_box(field: FloatArray, section: int, box: IntArray, centre: int, dimension: int, least: float) -> None:
    """Cut off a box, on every side, what holds less mass than `least`; something is left of it in any case."""
    for side in range(6):
        axis, inward = side // 2, 1 - 2 * (side % 2)
        dropped = 0.0
        while box[2 * axis] < box[2 * axis + 1]:
            dropped += _sum_slab(field, section, box, centre, dimension, axis, box[side])
            if dropped >= least:
                break
            box[side] += inward


@njit(**KERNEL, nogil=True)
def add_block(
    field: FloatArray,
    section: int,
    box: IntArray,
    centre: int,
    dimension: int,
    flat: FloatArray,
    start: int,
    radius: int,
) -> None:
    """Add a box of a section to the dense block of all cells within `radius` that begins at flat[start]."""
    rows, width = row_count(centre, dimension), 2 * radius + 1
    c0, c1 = axis_radius(centre, dimension)
    r0, r1 = axis_radius(radius, dimension)
    n, from_ = np.uintp(box[5] - box[4] + 1), np.uintp(centre + box[4])
    for i0 in range(box[0], box[1] + 1):
        for i1 in range(box[2], box[3] + 1):
            i = np.uintp(section + (c0 + i0) * rows + c1 + i1)
            to = np.uintp(start + ((i0 + r0) * (2 * r1 + 1) + i1 + r1) * width + box[4] + radius)
            for c in range(n):
                flat[to + c] += field[i, from_ + c]


@njit(**KERNEL, nogil=True)
def clear_box(field: FloatArray, section: int, box: IntArray, centre: int, dimension: int) -> None:
    """Set a box of a section to 0."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    n, from_ = np.uintp(box[5] - box[4] + 1), np.uintp(centre + box[4])
    for i0 in range(c0 + box[0], c0 + box[1] + 1):
        for i1 in range(c1 + box[2], c1 + box[3] + 1):
            i = np.uintp(section + i0 * rows + i1)
            for c in range(n):
                field[i, from_ + c] = 0.0


@njit(**KERNEL, nogil=True)
def contact_shares(
    path: FloatArray,
    spacing: float,
    reach: int,
    dimension: int,
    contact: float,
    samples: FloatArray,
    grids: FloatArray,
    boxes: IntArray,
    shares: FloatArray,
) -> None:
    """What share of the mass in each cell touches the robot at k = 1..N; the same for all hypotheses.

    Args:
        path: (≥ N+1, 3) m, the robot in the lattice's frame, 0 on the axes that only pad.
        spacing: m.
        reach: largest action in cells.
        dimension: d.
        contact: m; nearer is contact, if there are no `samples`.
        samples: (N+1, S) share that touches at a distance, see `risk_profile.profile_value`; or size 0.
        grids: (N+1, 4) likewise.
        boxes: (N+1, 7) written: cells from the anchor, first and last on each axis, where any share is above 0
            (row 0: nowhere); and where these begin in `shares`.
        shares: written; room for all cells at all instants.
    """
    end = 0
    for k in range(boxes.shape[0]):
        wide = contact
        if samples.size > 0:
            last = grids[k, 2] + grids[k, 3] * (samples.shape[1] - 1)
            wide = grids[k, 0] + grids[k, 1] * last / (1.0 - last)
        for axis in range(3):
            limit = reach * k if axis >= 3 - dimension else 0
            boxes[k, 2 * axis] = int(np.ceil(max((path[k, axis] - wide) / spacing, -limit)))
            boxes[k, 2 * axis + 1] = int(np.floor(min((path[k, axis] + wide) / spacing, limit)))
        boxes[k, 1] = boxes[k, 1] if k > 0 else boxes[k, 0] - 1
        boxes[k, 6] = end
        n = boxes[k, 5] - boxes[k, 4] + 1
        start = spacing * boxes[k, 4] - path[k, 2]
        for i0 in range(boxes[k, 0], boxes[k, 1] + 1):
            for i1 in range(boxes[k, 2], boxes[k, 3] + 1 if n > 0 else boxes[k, 2]):
                g0, g1 = spacing * i0 - path[k, 0], spacing * i1 - path[k, 1]
                aside = g0 * g0 + g1 * g1
                if samples.size > 0:
                    _read_profile(aside, start, spacing, n, samples[k], grids[k], shares, end)
                else:
                    for c in range(n):
                        gap = start + spacing * c
                        shares[end + c] = 1.0 if np.sqrt(aside + gap * gap) < contact else 0.0
                end += n


@njit(**KERNEL, nogil=True)
def _read_profile(
    aside: float,
    start: float,
    spacing: float,
    n: int,
    samples: FloatArray,
    grid: FloatArray,
    shares: FloatArray,
    at: int,
) -> None:
    """Write `risk_profile.profile_value`, at most 1, for a row of n cells whose squared distance across is `aside`."""
    radius, scale, first, step = grid
    to, last = np.uintp(at), samples.size - 1
    for c in range(np.uintp(n)):  # apart from the look-up below, so that it runs on whole registers
        gap = start + spacing * np.int32(c)
        x = np.sqrt(aside + gap * gap) - radius
        shares[to + c] = (x / (abs(x) + scale) - first) / step
    for c in range(np.uintp(n)):
        place = shares[to + c]
        q = np.uint32(min(place, last - 1.0))
        value = samples[q] + (place - q) * (samples[q + np.uint32(1)] - samples[q])
        shares[to + c] = min(1.0, value) if place < last else 0.0


@njit(**KERNEL, nogil=True)
def remove_contact(
    field: FloatArray,
    section: int,
    lost: int,
    centre: int,
    dimension: int,
    boxes: IntArray,
    shares: FloatArray,
    k: int,
) -> float:
    """Add to the lost mass what touches the robot at instant k of what is not lost; returns how much that is.

    Args:
        field: all mass.
        section: mass whether lost or not.
        lost: section of what is lost.
        centre: index of the anchor.
        dimension: d.
        boxes: (N+1, 7) and
        shares: of `contact_shares`.
        k: instant.
    """
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    at, n, from_ = np.uintp(boxes[k, 6]), boxes[k, 5] - boxes[k, 4] + 1, np.uintp(centre + boxes[k, 4])
    removed = 0.0
    for i0 in range(boxes[k, 0], boxes[k, 1] + 1):
        for i1 in range(boxes[k, 2], boxes[k, 3] + 1 if n > 0 else boxes[k, 2]):
            row = (c0 + i0) * rows + c1 + i1
            i, o = np.uintp(section + row), np.uintp(lost + row)
            for c in range(np.uintp(n)):
                touching = max(field[i, from_ + c] - field[o, from_ + c], 0.0) * shares[at + c]
                field[o, from_ + c] += touching
                removed += touching
            at += np.uintp(n)
    return removed
