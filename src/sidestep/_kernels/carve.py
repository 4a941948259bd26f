"""Free space along beams, cell by cell."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import BoolArray, FloatArray


@njit(**KERNEL)
def _gone(cell: int, step: int, cells: int) -> bool:
    """Whether a line that is in this row of cells comes no more to those of the grid."""
    return cell < 0 if step < 0 else cell >= cells


@njit(**KERNEL)
def traversed(
    origin: FloatArray, ends: FloatArray, corner: FloatArray, spacing: float, shape: tuple[int, int]
) -> BoolArray:
    """Return which cells of a grid the straight lines from `origin` to `ends` pass through, their end cells included.

    Args:
        origin: (2,) m.
        ends: (B, 2) m.
        corner: (2,) m, lower corner of cell (0, 0).
        spacing: m.
        shape: cells per axis; what lies outside is left out.
    """
    grid = np.zeros(shape, dtype=np.bool_)
    for b in range(ends.shape[0]):
        x, y = (origin[0] - corner[0]) / spacing, (origin[1] - corner[1]) / spacing
        dx, dy = (ends[b, 0] - origin[0]) / spacing, (ends[b, 1] - origin[1]) / spacing
        i, j = int(np.floor(x)), int(np.floor(y))
        last_i, last_j = int(np.floor(x + dx)), int(np.floor(y + dy))
        step_i, step_j = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        # shares of the line at which the next side of a cell is crossed, along each axis
        next_i = ((i + (1 if dx > 0 else 0)) - x) / dx if dx != 0 else np.inf
        next_j = ((j + (1 if dy > 0 else 0)) - y) / dy if dy != 0 else np.inf
        for _ in range(abs(last_i - i) + abs(last_j - j) + 1):
            if 0 <= i < shape[0] and 0 <= j < shape[1]:
                grid[i, j] = True
            elif _gone(i, step_i, shape[0]) or _gone(j, step_j, shape[1]):
                break  # a beam may end a million cells farther
            if next_i < next_j:
                i += step_i
                next_i += step_i / dx
            else:
                j += step_j
                next_j += step_j / dy if dy != 0 else np.inf
    return grid
