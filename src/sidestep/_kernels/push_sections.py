"""Sections of the field of masses (see `push`): cleared, read out, and freed of what touches the robot."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.risk_profile import profile_value
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep.types import FloatArray


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
def remove_contact(
    field: FloatArray,
    section: int,
    radius: int,
    centre: int,
    dimension: int,
    robot: FloatArray,
    spacing: float,
    contact: float,
    samples: FloatArray,
    grids: FloatArray,
    instant: int,
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
        contact: m; nearer is contact, if there are no `samples`.
        samples: (K, S) share that touches at a distance, see `risk_profile.profile_value`; or size 0.
        grids: (K, 4) likewise.
        instant: k.
    """
    wide = contact / spacing
    if samples.size > 0:
        last = grids[instant, 2] + grids[instant, 3] * (samples.shape[1] - 1)
        wide = (grids[instant, 0] + grids[instant, 1] * last / (1.0 - last)) / spacing
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    b0, b1 = axis_radius(radius, dimension)
    x0, x1, x2 = robot[instant, 0] / spacing, robot[instant, 1] / spacing, robot[instant, 2] / spacing
    far = 1e9
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
                if samples.size > 0:
                    fraction = min(1.0, profile_value(distance, samples[instant], grids[instant]))
                else:
                    fraction = 1.0 if distance < contact else 0.0
                field[row, column] = here * (1.0 - fraction)
                removed += here * fraction
    return removed
