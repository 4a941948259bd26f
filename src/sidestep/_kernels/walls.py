"""Signed distance to walls: polygons as segments, maps as square cells."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray

Occupied = NDArray[np.bool_]

PAD = 2.0
"""m around all walls in which samples of the signed distance are taken, see `distance_bounds`."""


@njit(**KERNEL)
def _polygon_distance(x: float, y: float, segments: FloatArray) -> float:
    """Distance to the nearest segment, negative inside a polygon (even–odd rule).

    Rows are x0, y0, x1, y1 of a segment, how many segments its polygon has, and the box around that: least x, least y,
    greatest x, greatest y. Polygons whose box is farther away than the nearest segment so far are passed over whole: of
    hundreds of them, all but a few.
    """
    best = np.inf
    inside = False
    first = 0
    while first < segments.shape[0]:
        end = first + int(segments[first, 4])
        across = max(segments[first, 5] - x, x - segments[first, 7], 0.0)
        along = max(segments[first, 6] - y, y - segments[first, 8], 0.0)
        if across * across + along * along < best:
            crossings = 0
            for s in range(first, end):
                x0, y0 = segments[s, 0], segments[s, 1]
                dx, dy = segments[s, 2] - x0, segments[s, 3] - y0
                length = dx * dx + dy * dy
                t = 0.0
                if length > 0.0:
                    t = min(max(((x - x0) * dx + (y - y0) * dy) / length, 0.0), 1.0)
                gap = (x0 + t * dx - x) ** 2 + (y0 + t * dy - y) ** 2
                best = min(best, gap)
                if (y0 > y) != (segments[s, 3] > y) and x < x0 + (y - y0) * dx / dy:
                    crossings += 1
            inside = inside or crossings % 2 == 1
        first = end
    return -math.sqrt(best) if inside else math.sqrt(best)


@njit(**KERNEL)
def _grid_distance(x: float, y: float, grid: Occupied, frame: FloatArray, sizes: FloatArray) -> float:
    """Distance to the nearest occupied square, negative inside; `sizes` bounds it from a distance transform.

    `frame` = (x, y of the corner of cell (0, 0), cosine and sine of its axes, resolution).
    """
    h = frame[4]
    u = ((x - frame[0]) * frame[2] + (y - frame[1]) * frame[3]) / h
    v = ((y - frame[1]) * frame[2] - (x - frame[0]) * frame[3]) / h
    w0, w1 = grid.shape
    cu, cv = min(max(u, 0.0), float(w0)), min(max(v, 0.0), float(w1))
    i, j = min(int(cu), w0 - 1), min(int(cv), w1 - 1)
    outside = math.hypot(u - cu, v - cv)
    held = outside == 0.0 and grid[i, j]
    # Squares of the other kind are `apart` away, between centres, at the nearest, and no farther from here than `most`:
    # only what lies between is looked at. Along a row none is nearer to a square than the nearest of all is.
    apart = abs(sizes[i, j]) if grid[i, j] == held else 0.0
    most = abs(sizes[i, j]) + outside + 1.0
    best = np.inf
    for a in range(max(0, math.floor(u - most)), min(w0, math.ceil(u + most))):
        du = max(a - u, u - a - 1.0, 0.0)
        room = min(best, most * most) - du * du
        if room <= 0.0:
            continue
        low, high = max(0, math.floor(v - math.sqrt(room)) - 1), min(w1 - 1, math.ceil(v + math.sqrt(room)))
        inner = math.ceil(math.sqrt(max(apart * apart - 0.5 - (a - i) * (a - i), 0.0)))  # squares are whole numbers
        for side in range(2 if inner > 0 else 1):
            b = max(low, j + inner) if side == 1 else low
            last = high if side == 1 or inner == 0 else min(high, j - inner)
            while b <= last:
                if grid[a, b] != held:
                    dv = max(b - v, v - b - 1.0, 0.0)
                    best = min(best, du * du + dv * dv)
                    b += 1
                else:
                    b += max(math.ceil(abs(sizes[a, b])), 1)
    if held:
        best = min(best, min(u, v, w0 - u, w1 - v) ** 2)
        return -math.sqrt(best) * h
    return math.sqrt(best) * h


@njit(**KERNEL)
def wall_distance(
    x: float, y: float, segments: FloatArray, grid: Occupied, frame: FloatArray, sizes: FloatArray
) -> float:
    """Signed distance (m) to the nearest wall of either kind; inf where there is none."""
    best = np.inf
    if segments.shape[0] > 0:
        best = _polygon_distance(x, y, segments)
    if grid.size > 0:
        best = min(best, _grid_distance(x, y, grid, frame, sizes))
    return best


@njit(**KERNEL)
def wall_distances(
    points: FloatArray, segments: FloatArray, grid: Occupied, frame: FloatArray, sizes: FloatArray
) -> FloatArray:
    """Signed distances (M,) m of points (M, 2) m."""
    out = np.empty(points.shape[0])
    for m in range(points.shape[0]):
        out[m] = wall_distance(points[m, 0], points[m, 1], segments, grid, frame, sizes)
    return out


@njit(**KERNEL)
def distance_bounds(x: float, y: float, samples: FloatArray, corner: FloatArray) -> tuple[float, float]:
    """The signed distance to walls is at least and at most this, by the nearest of its samples.

    It changes by at most the way gone. Samples are taken up to `PAD` around all walls: outside them it is farther, by
    as much as the place lies outside.
    """
    i = math.floor((x - corner[0]) / corner[2] + 0.5)
    j = math.floor((y - corner[1]) / corner[2] + 0.5)
    if i < 0 or j < 0 or i >= samples.shape[0] or j >= samples.shape[1]:
        across = max(corner[0] - x, x - corner[0] - (samples.shape[0] - 1) * corner[2])
        along = max(corner[1] - y, y - corner[1] - (samples.shape[1] - 1) * corner[2])
        return PAD + max(across, along), np.inf
    away = math.hypot(x - corner[0] - i * corner[2], y - corner[1] - j * corner[2])
    value = float(samples[i, j])
    return value - away, value + away


@njit(**KERNEL)
def free_points(
    points: FloatArray,
    margin: float,
    segments: FloatArray,
    grid: Occupied,
    frame: FloatArray,
    sizes: FloatArray,
    samples: FloatArray,
    corner: FloatArray,
) -> Occupied:
    """Whether each point (M, 2) is at least `margin` from all walls.

    The nearest of the `samples` decides for most of them.
    """
    out = np.empty(points.shape[0], np.bool_)
    for m in range(points.shape[0]):
        x, y = points[m, 0], points[m, 1]
        least, most = distance_bounds(x, y, samples, corner)
        if least >= margin:
            out[m] = True
        elif most < margin:
            out[m] = False
        else:
            out[m] = wall_distance(x, y, segments, grid, frame, sizes) >= margin
    return out


@njit(**KERNEL)
def _crosses(x0: float, y0: float, x1: float, y1: float, segments: FloatArray) -> bool:
    """Whether the way from 0 to 1 crosses any of the polygons' edges."""
    for s in range(segments.shape[0]):
        a0, b0, a1, b1 = segments[s, 0], segments[s, 1], segments[s, 2], segments[s, 3]
        before = (x1 - x0) * (b0 - y0) - (y1 - y0) * (a0 - x0)
        after = (x1 - x0) * (b1 - y0) - (y1 - y0) * (a1 - x0)
        here = (a1 - a0) * (y0 - b0) - (b1 - b0) * (x0 - a0)
        there = (a1 - a0) * (y1 - b0) - (b1 - b0) * (x1 - a0)
        if (before > 0.0) != (after > 0.0) and (here > 0.0) != (there > 0.0):
            return True
    return False


@njit(**KERNEL)
def free_segments(
    starts: FloatArray,
    ends: FloatArray,
    margin: float,
    step: float,
    segments: FloatArray,
    grid: Occupied,
    frame: FloatArray,
    sizes: FloatArray,
    samples: FloatArray,
    corner: FloatArray,
) -> Occupied:
    """Whether the whole of each segment keeps `margin`, by steps as long as the distance allows, at least `step`.

    Walls thinner than a step could be stepped over where the margin is smaller, too; crossings are looked for there.
    """
    out = np.ones(starts.shape[0], np.bool_)
    for m in range(starts.shape[0]):
        if 0.0 <= margin < step and _crosses(starts[m, 0], starts[m, 1], ends[m, 0], ends[m, 1], segments):
            out[m] = False
            continue
        dx, dy = ends[m, 0] - starts[m, 0], ends[m, 1] - starts[m, 1]
        length = math.hypot(dx, dy)
        at = 0.0
        while True:
            t = at / length if length > 0.0 else 0.0
            x, y = starts[m, 0] + t * dx, starts[m, 1] + t * dy
            room = distance_bounds(x, y, samples, corner)[0] - margin
            if not room > step:
                room = wall_distance(x, y, segments, grid, frame, sizes) - margin
            if not room >= 0.0:
                out[m] = False
                break
            if at >= length:
                break
            at = min(at + max(room, step), length)
    return out


@njit(**KERNEL)
def interpolate(
    points: FloatArray, values: FloatArray, corner: FloatArray, spacing: float, goal: FloatArray
) -> FloatArray:
    """Bilinear values (M,) at points (M, 2) m, at least the straight way to `goal`; outside by way of the edge."""
    out = np.empty(points.shape[0])
    w, h = values.shape
    for m in range(points.shape[0]):
        u = (points[m, 0] - corner[0]) / spacing
        v = (points[m, 1] - corner[1]) / spacing
        if 0.0 <= u <= w - 1 and 0.0 <= v <= h - 1:
            i, j = min(int(u), w - 2), min(int(v), h - 2)
            a, b = u - i, v - j
            value = (1 - a) * ((1 - b) * values[i, j] + b * values[i, j + 1])
            value += a * ((1 - b) * values[i + 1, j] + b * values[i + 1, j + 1])
        else:
            value = _by_way_of_edge(u, v, values, spacing)
        out[m] = max(value, math.hypot(points[m, 0] - goal[0], points[m, 1] - goal[1]))
    return out


@njit(**KERNEL)
def _by_way_of_edge(u: float, v: float, values: FloatArray, spacing: float) -> float:
    """Shortest straight way to a cell at the edges that face the point, plus the value there.

    Every second cell is tried. The way to an edge behind them would lead through what the raster knows of walls.
    """
    w, h = values.shape
    best = np.inf
    if u < 0.0 or u > w - 1:
        i = 0 if u < 0.0 else w - 1
        for j in range(0, h, 2):
            best = min(best, math.sqrt((u - i) ** 2 + (v - j) ** 2) * spacing + values[i, j])
    if v < 0.0 or v > h - 1:
        j = 0 if v < 0.0 else h - 1
        for i in range(0, w, 2):
            best = min(best, math.sqrt((u - i) ** 2 + (v - j) ** 2) * spacing + values[i, j])
    return best
