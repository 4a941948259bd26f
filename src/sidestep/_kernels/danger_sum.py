"""Danger of several bodies, which no longer splits by axis, as one table."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import Values


@njit(**KERNEL, nogil=True)
def add_products(axes: Values, dimension: int, table: Values) -> None:
    """Add one body's danger, a product of factors per axis, at every instant and cell.

    Args:
        axes: (3·T, C) factors along three axes at T instants; of an axis that only pads the first one counts.
        dimension: 1, 2 or 3.
        table: (T·rows, C), added to.
    """
    width = axes.shape[1]
    planes, lines = width if dimension == 3 else 1, width if dimension > 1 else 1
    for t in range(axes.shape[0] // 3):
        last = axes[3 * t + 2]
        for i in range(planes):
            for j in range(lines):
                factor = axes[3 * t, i] * axes[3 * t + 1, j]
                row = table[(t * planes + i) * lines + j]
                for k in range(np.uintp(width)):
                    row[k] += factor * last[k]
