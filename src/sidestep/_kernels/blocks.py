"""A person's mass, block after block as `risk` reads it: steps and mid-steps in turn, each on its own box."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray, IntArray


@njit(**KERNEL)
def take_steps(flat: FloatArray, offsets: IntArray, radii: IntArray, dimension: int, steps: FloatArray) -> None:
    """Lay out the even blocks; cells farther than radii[2k] from the anchor hold nothing at step k.

    Args:
        flat: all blocks, one after another.
        offsets: (2N+2,) where they start.
        radii: (2N+1,) cells from the anchor to the faces of each.
        dimension: d.
        steps: (N+1, rows, C) the mass at k = 0..N, the axes before the last one in `rows`; written, 0 before.
    """
    centre = steps.shape[2] // 2
    c0 = centre if dimension == 3 else 0
    c1 = centre if dimension >= 2 else 0
    for k in range(steps.shape[0]):
        radius, at = radii[2 * k], np.uintp(offsets[2 * k])
        r0 = radius if dimension == 3 else 0
        r1 = radius if dimension >= 2 else 0
        for i0 in range(c0 - r0, c0 + r0 + 1):
            for i1 in range(c1 - r1, c1 + r1 + 1):
                row = np.uintp(i0 * (2 * c1 + 1) + i1)
                for c in range(np.uintp(centre - radius), np.uintp(centre + radius + 1)):
                    steps[k, row, c] = flat[at]
                    at += np.uintp(1)
