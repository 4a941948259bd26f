"""Risk over the robot's lattice: each person's mass, blurred and dilated by the clearance, combined over people.

Narrow blobs are drawn here, as a few discs by differences along the middle axis; wide ones by `risk_wide`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.risk_profile import STEPS, staircase
from sidestep._kernels.risk_wide import add_wide, level_of
from sidestep.types import FloatArray, IntArray

HEAVY = 0.25
"""Cells below this part of the limit are drawn as one disc; a staircase would make no difference."""


@njit(cache=True)
def _add_ball(
    ends: FloatArray, c0: float, c1: float, c2: float, radius: float, mass: float, size: IntArray, box: IntArray
) -> None:
    """Add `mass` to all cells within `radius` of c, as differences along the middle axis; grow `box` around them."""
    reach = radius * (1.0 - 1e-9)
    first = max(0, math.ceil(c2 - reach))
    last = min(size[2] - 1, math.floor(c2 + reach))
    if first > last or c1 - reach > size[1] - 1 or c1 + reach < 0:
        return
    for i in range(max(0, math.ceil(c0 - reach)), min(size[0] - 1, math.floor(c0 + reach)) + 1):
        box[0] = min(box[0], i)
        box[1] = max(box[1], i)
        for k in range(first, last + 1):
            rest = reach * reach - (i - c0) ** 2 - (k - c2) ** 2
            if rest < 0.0:
                continue
            h = math.sqrt(rest)
            low = max(0, math.ceil(c1 - h))
            high = min(size[1] - 1, math.floor(c1 + h))
            if low > high:
                continue
            ends[i, low, k] += mass
            ends[i, high + 1, k] -= mass
            box[2] = min(box[2], low)
            box[3] = max(box[3], high)
    box[4] = min(box[4], first)
    box[5] = max(box[5], last)


@njit(cache=True)
def _integrate(ends: FloatArray, box: IntArray) -> None:
    """Turn the differences within `box` into sums."""
    for i in range(box[0], box[1] + 1):
        for j in range(box[2], box[3] + 1):
            row = ends[i, j, box[4] : box[5] + 1]
            following = ends[i, j + 1, box[4] : box[5] + 1]
            for k in range(row.size):
                following[k] = following[k] + row[k] if j < box[3] else 0.0


@njit(cache=True)
def _merge(ends: FloatArray, out: NDArray[np.float32], box: IntArray) -> bool:
    """Combine one person's probabilities with those before, 1 − Π(1 − P), and leave zeros; True if any is positive."""
    largest = 0.0
    for i in range(box[0], box[1] + 1):
        for j in range(box[2], box[3] + 1):
            row = ends[i, j, box[4] : box[5] + 1]
            target = out[i, j, box[4] : box[5] + 1]
            for k in range(row.size):
                p = row[k]
                row[k] = 0.0
                p = min(p, 1.0) if p > 1e-12 else 0.0
                largest = max(largest, p)
                target[k] = np.float32(target[k] + p - target[k] * p)
    return largest > 0.0


@njit(cache=True)
def rasterise(
    cells: FloatArray,
    masses: FloatArray,
    starts: IntArray,
    distances: FloatArray,
    weights: FloatArray,
    sigmas: FloatArray,
    origin: FloatArray,
    spacing: float,
    block: int,
    low: IntArray,
    active: IntArray,
    table: FloatArray,
    limit: float,
    ends: FloatArray,
    out: NDArray[np.float32],
) -> bool:
    """Fill `out` with P(anybody within their distance) over a box of the robot's lattice, at one half instant.

    Args:
        cells: (·, 3) m, of all people.
        masses: beside them.
        starts: (P, B + 1) where each person's blocks lie in them.
        distances: (P,) m.
        weights: (P, C) of the spread classes.
        sigmas: (P, B, C) m.
        origin: (3,) m, the cell 0.
        spacing: m.
        block: half instant.
        low: (3,) lowest cell of the box.
        active: (3,) 1 where the axis exists.
        table: of `blob_table`.
        limit: risk limit that the raster shall serve.
        ends: (w0, w1 + 1, w2) zeros; left as zeros.
        out: (w0, w1, w2) zeros.

    Returns:
        True if any cell is above zero.
    """
    touched = add_wide(
        cells, masses, starts, distances, weights, sigmas, origin, spacing, block, low, active, table, limit, out
    )
    box = np.empty(6, np.int64)
    size = np.array(out.shape)
    narrow = np.empty(weights.shape[1])
    radii, shares = np.empty(STEPS), np.empty(STEPS)
    for person in range(starts.shape[0]):
        whole = 0.0
        for c in range(narrow.size):
            wide = level_of(sigmas[person, block, c], spacing) > 0
            narrow[c] = 0.0 if wide else weights[person, c]
            whole += narrow[c]
        first, last = starts[person, block], starts[person, block + 1]
        if whole == 0.0 or first == last:
            continue
        used = staircase(distances[person], narrow, sigmas[person, block], table, limit, STEPS, radii, shares)
        box[0], box[2], box[4] = out.shape[0], out.shape[1], out.shape[2]
        box[1] = box[3] = box[5] = -1
        for n in range(first, last):
            c0 = (cells[n, 0] - origin[0]) / spacing - low[0]
            c1 = (cells[n, 1] - origin[1]) / spacing - low[1]
            c2 = (cells[n, 2] - origin[2]) / spacing - low[2]
            if masses[n] < HEAVY * limit:
                _add_ball(ends, c0, c1, c2, distances[person] / spacing, masses[n] * whole, size, box)
                continue
            for s in range(used):
                _add_ball(ends, c0, c1, c2, radii[s] / spacing, masses[n] * shares[s], size, box)
        if box[1] >= 0:
            _integrate(ends, box)
            touched = _merge(ends, out, box) or touched
    return touched


@njit(cache=True)
def rasterise_all(
    cells: FloatArray,
    masses: FloatArray,
    starts: IntArray,
    distances: FloatArray,
    weights: FloatArray,
    sigmas: FloatArray,
    origin: FloatArray,
    spacing: float,
    active: IntArray,
    table: FloatArray,
    limit: float,
    midway: bool,
    low: IntArray,
    size: IntArray,
) -> tuple[NDArray[np.float32], IntArray, NDArray[np.bool_]]:
    """Rasters for every half instant 1..2N, each over its box.

    Args:
        cells: as for `rasterise`, and so are the other arguments that it has.
        masses: beside them.
        starts: (P, B + 1).
        distances: (P,) m.
        weights: (P, C).
        sigmas: (P, B, C) m.
        origin: (3,) m, the robot.
        spacing: m.
        active: (3,).
        table: of `blob_table`.
        limit: risk limit.
        midway: False leaves the odd half instants out.
        low: (B, 3) lowest cell of each box, counted from the origin.
        size: (B, 3) cells.

    Returns:
        values (flat), starts (B + 1,), and (B,) whether anything but zero is there.
    """
    blocks = starts.shape[1] - 1
    begin = np.zeros(blocks + 1, np.int64)
    most = 0
    for b in range(1, blocks):
        wanted = midway or b % 2 == 0
        begin[b + 1] = begin[b] + (size[b, 0] * size[b, 1] * size[b, 2] if wanted else 0)
        most = max(most, size[b, 0] * (size[b, 1] + 1) * size[b, 2])
    values = np.zeros(begin[blocks], np.float32)
    some = np.zeros(blocks, np.bool_)
    ends = np.zeros(most)
    for b in range(1, blocks):
        if begin[b + 1] == begin[b]:
            continue
        w0, w1, w2 = size[b]
        some[b] = rasterise(
            cells, masses, starts, distances, weights, sigmas, origin, spacing, b, low[b], active, table, limit,
            ends[: w0 * (w1 + 1) * w2].reshape((w0, w1 + 1, w2)),
            values[begin[b] : begin[b + 1]].reshape((w0, w1, w2)),
        )  # fmt: skip
    return values, begin, some
