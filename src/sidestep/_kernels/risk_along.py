"""Mass within a distance of a robot that moves along a path."""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep._kernels.path_costs import half_instants
from sidestep._kernels.risk import mass_near, mass_within
from sidestep.types import FloatArray, IntArray


@njit(**KERNEL)
def _looked_at(path: FloatArray, stride: int) -> tuple[FloatArray, IntArray]:
    """Places (M, 3) m and half instants (M,) of `path`: all from 1 on, or every other (`stride` 2: the steps)."""
    places = half_instants(path)
    return places[stride - 1 :: stride].copy(), np.arange(stride, places.shape[0] + 1, stride)


@njit(**KERNEL)
def _laid_out(near: FloatArray, path: FloatArray, stride: int) -> FloatArray:
    """(2N,) what was found where `_looked_at` says, 0 elsewhere."""
    out = np.zeros(2 * (path.shape[0] - 1))
    for n in range(near.size):
        out[stride * (n + 1) - 1] = near[n]
    return out


@njit(**KERNEL)
def mass_within_along(
    path: FloatArray,
    midway: bool,
    flat: FloatArray,
    offsets: IntArray,
    radii: IntArray,
    spacings: FloatArray,
    origin: FloatArray,
    rotation: FloatArray,
    active: IntArray,
    distance: float,
) -> FloatArray:
    """`mass_within` (2N,) at half instants 1..2N of `path` (N+1, d) m; 0 between the steps if not `midway`."""
    stride = 1 if midway else 2
    points, instants = _looked_at(path, stride)
    near = mass_within(points, instants, flat, offsets, radii, spacings, origin, rotation, active, distance)
    return _laid_out(near, path, stride)


@njit(**KERNEL)
def mass_near_along(
    path: FloatArray,
    midway: bool,
    flat: FloatArray,
    offsets: IntArray,
    radii: IntArray,
    spacings: FloatArray,
    origin: FloatArray,
    rotation: FloatArray,
    active: IntArray,
    spans: IntArray,
    span_starts: IntArray,
    outside: FloatArray,
    samples: FloatArray,
    grids: FloatArray,
) -> FloatArray:
    """`mass_near` (2N,) at half instants 1..2N of `path` (N+1, d) m; 0 between the steps if not `midway`."""
    stride = 1 if midway else 2
    points, instants = _looked_at(path, stride)
    near = mass_near(
        points, instants, flat, offsets, radii, spacings, origin, rotation, active, spans, span_starts, outside,
        samples, grids,
    )  # fmt: skip
    return _laid_out(near, path, stride)
