"""Sections of the field of masses (see `push`): cleared, read out, and freed of what touches the robot."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.risk_profile import profile_value
from sidestep._kernels.sweep import axis_radius, row_count
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
        for i0 in range(boxes[k, 0], boxes[k, 1] + 1):
            for i1 in range(boxes[k, 2], boxes[k, 3] + 1):
                g0, g1 = spacing * i0 - path[k, 0], spacing * i1 - path[k, 1]
                for i2 in range(boxes[k, 4], boxes[k, 5] + 1):
                    g2 = spacing * i2 - path[k, 2]
                    distance = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
                    if samples.size > 0:
                        shares[end] = min(1.0, profile_value(distance, samples[k], grids[k]))
                    else:
                        shares[end] = 1.0 if distance < contact else 0.0
                    end += 1


@njit(cache=True, nogil=True, error_model="numpy")
def remove_contact(
    field: FloatArray, section: int, centre: int, dimension: int, boxes: IntArray, shares: FloatArray, k: int
) -> float:
    """Take out of a section what touches the robot at instant k, by `contact_shares`; returns how much that is."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    at, width = boxes[k, 6], boxes[k, 5] - boxes[k, 4] + 1
    removed = 0.0
    for i0 in range(boxes[k, 0], boxes[k, 1] + 1):
        for i1 in range(boxes[k, 2], boxes[k, 3] + 1):
            row, column, first = section + (c0 + i0) * rows + c1 + i1, centre + boxes[k, 4], at
            lo, hi = row_span(field, row, column, column + max(width, 0))
            for c in range(lo, hi):
                touching = field[row, c] * shares[first + c - column]
                field[row, c] -= touching
                removed += touching
            at += max(width, 0)
    return removed
