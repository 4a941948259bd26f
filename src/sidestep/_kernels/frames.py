"""Small vectors between the world's frame and a lattice's: less than what calling a matrix library for them costs."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray


@njit(**KERNEL, nogil=True)
def turned(vectors: FloatArray, rotation: FloatArray, scale: float) -> FloatArray:
    """(n, d) scale · rotation · v of every vector (n, d): from the lattice's axes to the world's."""
    out = np.empty(vectors.shape)
    for n in range(vectors.shape[0]):
        for a in range(vectors.shape[1]):
            total = 0.0
            for b in range(vectors.shape[1]):
                total += rotation[a, b] * vectors[n, b]
            out[n, a] = scale * total
    return out


@njit(**KERNEL, nogil=True)
def local(point: FloatArray, origin: FloatArray, rotation: FloatArray) -> FloatArray:
    """(d,) m, a point (d,) m of the world in the lattice's frame, the origin at 0."""
    out = np.zeros(point.size)
    for a in range(point.size):
        for b in range(point.size):
            out[a] += (point[b] - origin[b]) * rotation[b, a]
    return out
