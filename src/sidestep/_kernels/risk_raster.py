"""Risk over the robot's lattice: each person's mass, blurred and dilated by the clearance, combined over people.

Narrow blobs are drawn here, as a few discs by differences along the middle axis; wide ones by `risk_wide`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep._kernels.risk_profile import STEPS, mixture, staircase
from sidestep._kernels.risk_wide import LEVELS, add_wide, coarse_boxes, level_of, refine
from sidestep._kernels.search_costs import cells_of
from sidestep.types import FloatArray, IntArray

HEAVY = 0.25
"""Cells below this part of the limit are drawn as one disc; a staircase would make no difference."""
LOWEST_STEP = 0.02
"""Part of the limit below which no step of a staircase lies."""


@njit(**KERNEL)
def _add_ball(
    ends: FloatArray,
    c0: float,
    c1: float,
    c2: float,
    radius: float,
    mass: float,
    size: IntArray,
    box: IntArray,
    half: FloatArray,
) -> None:
    """Add `mass` to all cells within `radius` of c, as differences along the middle axis; grow `box` around them.

    `half` is room for a number per cell of the last axis.
    """
    reach = radius * (1.0 - 1e-9)
    first = max(0, math.ceil(c2 - reach))
    last = min(size[2] - 1, math.floor(c2 + reach))
    if first > last or c1 - reach > size[1] - 1 or c1 + reach < 0.0:
        return
    top = size[1] - 1
    for i in range(max(0, math.ceil(c0 - reach)), min(size[0] - 1, math.floor(c0 + reach)) + 1):
        rest = reach * reach - (i - c0) ** 2
        for n in range(np.uintp(last - first + 1)):  # apart from what follows, so that it runs on whole registers
            aside = first + n - c2
            square = rest - aside * aside
            half[n] = math.sqrt(square) if square >= 0.0 else -1.0
        corner = i * (top + 2) * size[2] + first
        for n in range(last - first + 1):
            h = half[n]
            low, high = max(0, math.ceil(c1 - h)), min(top, math.floor(c1 + h))
            if low <= high:  # not so where `half` is −1
                ends[corner + low * size[2] + n] += mass
                ends[corner + (high + 1) * size[2] + n] -= mass
    box[0] = min(box[0], max(0, math.ceil(c0 - reach)))
    box[1] = max(box[1], min(size[0] - 1, math.floor(c0 + reach)))
    box[2] = min(box[2], max(0, math.ceil(c1 - reach)))
    box[3] = max(box[3], min(top, math.floor(c1 + reach)))
    box[4] = min(box[4], first)
    box[5] = max(box[5], last)


@njit(**KERNEL)
def _merge(ends: FloatArray, out: NDArray[np.float32], size: IntArray, box: IntArray) -> bool:
    """Sum up one person's differences within `box` and combine them with those before, 1 − Π(1 − P).

    Zeros are left; True if anything is positive.
    """
    largest = 0.0
    for i in range(box[0], box[1] + 1):
        for j in range(box[2], box[3] + 1):
            at = (i * (size[1] + 1) + j) * size[2]
            row, following = ends[at : at + size[2]], ends[at + size[2] : at + 2 * size[2]]
            target = out[(i * size[1] + j) * size[2] : (i * size[1] + j + 1) * size[2]]
            more = 1.0 if j < box[3] else 0.0
            for k in range(np.uintp(box[4]), np.uintp(box[5] + 1)):
                following[k] = more * (following[k] + row[k])
                p = min(row[k], 1.0) if row[k] > 1e-12 else 0.0
                row[k] = 0.0
                largest = max(largest, p)
                target[k] = np.float32(target[k] + p - target[k] * p)
    return largest > 0.0


@njit(**KERNEL)
def _places(cells: FloatArray, origin: FloatArray, spacing: float, bounds: FloatArray) -> FloatArray:
    """Cells (M, 3) m in cells of the robot's lattice, and the lowest and highest of them in `bounds` (2, 3)."""
    out = np.empty(cells.shape)
    bounds[0, :], bounds[1, :] = np.inf, -np.inf
    scale = 1.0 / spacing
    for n in range(cells.shape[0]):
        for a in range(3):
            x = (cells[n, a] - origin[a]) * scale
            out[n, a] = x
            bounds[0, a] = min(bounds[0, a], x)
            bounds[1, a] = max(bounds[1, a], x)
    return out


@njit(**KERNEL)
def _gap(bounds: FloatArray, low: IntArray, size: IntArray) -> float:
    """Cells between a box of the lattice and the box around the places."""
    total = 0.0
    for a in range(3):
        apart = max(bounds[0, a] - (low[a] + size[a] - 1), low[a] - bounds[1, a])
        total += max(apart, 0.0) ** 2
    return math.sqrt(total)


@njit(**KERNEL)
def _add_narrow(
    places: FloatArray,
    masses: FloatArray,
    radius: float,
    weights: FloatArray,
    sigmas: FloatArray,
    gap: float,
    spacing: float,
    low: IntArray,
    size: IntArray,
    table: FloatArray,
    limit: float,
    ends: FloatArray,
    out: NDArray[np.float32],
) -> bool:
    """Unite `out` with the narrow blobs of one person; arguments as for `add_wide` and `rasterise_all`."""
    narrow = np.zeros(weights.size)
    whole = 0.0
    for c in range(weights.size):
        if level_of(sigmas[c], spacing) == 0:
            narrow[c] = weights[c]
            whole += weights[c]
    if whole == 0.0 or mixture(gap, radius, narrow, sigmas, table) < LOWEST_STEP * limit:
        return False
    radii, shares = np.empty(STEPS), np.empty(STEPS)
    used = staircase(radius, narrow, sigmas, table, limit, STEPS, radii, shares)
    box = np.full(6, -1)
    box[0], box[2], box[4] = size[0], size[1], size[2]
    half = np.empty(size[2])
    farthest = radii[used - 1] / spacing
    for n in range(masses.size):
        c0, c1, c2 = places[n, 0] - low[0], places[n, 1] - low[1], places[n, 2] - low[2]
        off = max(-c0, c0 - size[0] + 1.0, -c1, c1 - size[1] + 1.0, -c2, c2 - size[2] + 1.0)
        if off > farthest:
            continue
        if masses[n] < HEAVY * limit:
            _add_ball(ends, c0, c1, c2, radius / spacing, masses[n] * whole, size, box, half)
            continue
        for s in range(used):
            _add_ball(ends, c0, c1, c2, radii[s] / spacing, masses[n] * shares[s], size, box, half)
    if box[1] < 0 or box[3] < 0:
        return False
    return _merge(ends, out, size, box)


@njit(**KERNEL)
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
    """P(anybody within their distance) at every half instant 1..2N, each over its box of the robot's lattice.

    Args:
        cells: (·, 3) m, of all people.
        masses: beside them.
        starts: (P, B + 1) where each person's blocks lie in them.
        distances: (P,) m.
        weights: (P, C) of the spread classes.
        sigmas: (P, B, C) m.
        origin: (3,) m, the robot: cell 0.
        spacing: m.
        active: (3,) 1 where the axis exists.
        table: of `blob_table`.
        limit: risk limit that the rasters shall serve.
        midway: False leaves the odd half instants out.
        low: (B, 3) lowest cell of each box, counted from the origin.
        size: (B, 3) cells.

    Returns:
        values (flat), starts (B + 1,), and (B,) whether anything but zero is there.
    """
    blocks = starts.shape[1] - 1
    begin = np.zeros(blocks + 1, np.int64)
    most, most_coarse = 0, 0
    for b in range(1, blocks):
        begin[b + 1] = begin[b] + (cells_of(size[b]) if midway or b % 2 == 0 else 0)
        most = max(most, size[b, 0] * (size[b, 1] + 1) * size[b, 2])
        most_coarse = max(most_coarse, coarse_boxes(low[b], size[b], active)[2][LEVELS])
    values = np.zeros(begin[blocks], np.float32)
    some = np.zeros(blocks, np.bool_)
    ends, totals = np.zeros(most), np.zeros(most_coarse)
    bounds = np.empty((2, 3))
    for b in range(1, blocks):
        if begin[b + 1] == begin[b]:
            continue
        lows, sizes, at = coarse_boxes(low[b], size[b], active)
        out = values[begin[b] : begin[b + 1]]
        smooth = False
        for person in range(starts.shape[0]):
            first, last = starts[person, b], starts[person, b + 1]
            if first == last:
                continue
            places, mass = _places(cells[first:last], origin, spacing, bounds), masses[first:last]
            gap = spacing * _gap(bounds, low[b], size[b])
            added = add_wide(
                places, mass, bounds, distances[person], weights[person], sigmas[person, b], gap, spacing, active,
                table, limit, lows, sizes, at, totals,
            )  # fmt: skip
            smooth = smooth or added
            drawn = _add_narrow(
                places, mass, distances[person], weights[person], sigmas[person, b], gap, spacing, low[b], size[b],
                table, limit, ends, out,
            )  # fmt: skip
            some[b] = some[b] or drawn
        if smooth:
            some[b] = True
            refine(totals[at[3] : at[4]], lows[3], sizes[3], totals[at[2] : at[3]], lows[2], sizes[2])
            refine(totals[at[2] : at[3]], lows[2], sizes[2], totals[at[1] : at[2]], lows[1], sizes[1])
            refine(totals[at[1] : at[2]], lows[1], sizes[1], out, low[b], size[b])
            for n in range(at[LEVELS]):
                totals[n] = 0.0
    return values, begin, some
