"""A person's mass, put block after block as `risk` reads it: steps and mid-steps in turn."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep.types import FloatArray, IntArray


@njit(cache=True)
def lay_out(
    steps: FloatArray, halves: FloatArray, dimension: int, reach: int, offsets: IntArray, radii: IntArray
) -> FloatArray:
    """Copy what each block holds; cells farther than reach·k from the anchor hold nothing at step k.

    Args:
        steps: (N+1, rows, C) the mass at k = 0..N, the axes before the last one in `rows`.
        halves: mid-steps one after another, or size 0.
        dimension: d.
        reach: cells per step.
        offsets: (2N + 2,), written: where the blocks start.
        radii: (2N + 1,), written: cells from the anchor to the faces; 0 where there is nothing.

    Returns:
        all blocks, flat.
    """
    width = steps.shape[2]
    centre = width // 2
    for b in range(radii.size):
        radii[b] = min(reach * (b // 2), centre) if b % 2 == 0 else reach * b if halves.size > 0 else 0
        cells = (2 * radii[b] + 1) ** dimension
        offsets[b + 1] = offsets[b] + (cells if b % 2 == 0 or halves.size > 0 else 0)
    flat = np.empty(offsets[radii.size])
    taken = 0
    for b in range(radii.size):
        at = np.uintp(offsets[b])
        if b % 2 == 1:
            size = offsets[b + 1] - offsets[b]
            flat[offsets[b] : offsets[b + 1]] = halves[taken : taken + size]
            taken += size
            continue
        r0 = radii[b] if dimension == 3 else 0
        r1 = radii[b] if dimension >= 2 else 0
        c0 = centre if dimension == 3 else 0
        c1 = centre if dimension >= 2 else 0
        for i0 in range(c0 - r0, c0 + r0 + 1):
            for i1 in range(c1 - r1, c1 + r1 + 1):
                row = np.uintp(i0 * (2 * c1 + 1) + i1)
                for c in range(np.uintp(centre - radii[b]), np.uintp(centre + radii[b] + 1)):
                    flat[at] = steps[b // 2, row, c]
                    at += np.uintp(1)
    return flat
