"""The convex program around a path, term by term from its definition."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates


def objective_value(x, start, curvature, slope, at, effort, first, first_weight):
    """Objective of the unknown positions x (N, d), up to a constant, from its sums."""
    whole = np.concatenate([start[None], x])
    total = 0.5 * (effort * np.diff(whole, axis=0) ** 2).sum()
    total += (slope * (x - at)).sum() + 0.5 * (curvature * (x - at) ** 2).sum()
    return total + 0.5 * first_weight * ((x[0] - first) ** 2).sum()


def forbidden(path, room, directions, reach):
    """All (half instant, direction, limit along it) that are closer than `reach`."""
    found = []
    for n in range(len(room)):
        k, midway = n // 2, n % 2 == 0
        place = 0.5 * (path[k] + path[k + 1]) if midway else path[k + 1]
        for m, direction in enumerate(directions):
            if room[n, m] < reach:
                found.append((n, direction, room[n, m] + direction @ place))
    return found


def interpolated(raster, cell):
    """Risk at `cell` (d,), counted from the middle of a raster among three axes; 1 outside."""
    place = np.zeros(3)
    place[3 - len(cell) :] = cell
    return float(map_coordinates(raster, (place + np.array(raster.shape) // 2)[:, None], order=1, cval=1.0)[0])


def rise_at(raster, cell):
    """Slope of the risk (d,) per cell at `cell` (d,), over a cell to either side that the raster knows."""
    rise = np.zeros(len(cell))
    widest = (np.array(raster.shape)[3 - len(cell) :]) // 2
    for a in range(len(cell)):
        step = np.eye(len(cell))[a]
        known = [cell + s * step for s in (1, 0, -1) if np.all(np.abs(cell + s * step) <= widest + 1e-9)]
        if len(known) > 1:
            inside = [np.clip(k, -widest, widest) for k in (known[0], known[-1])]
            rise[a] = (interpolated(raster, inside[0]) - interpolated(raster, inside[1])) / (len(known) - 1)
    return rise


def room_to(raster, cell, direction, limit, reach):
    """Cells to the last of the samples, a quarter of a cell apart, before the risk passes `limit`."""
    if interpolated(raster, cell) > limit:
        return np.inf
    for t in np.arange(0.25, reach + 0.26, 0.25):
        if interpolated(raster, cell + t * direction) > limit:
            return t - 0.25
    return np.inf


def trust_region(path, spacing, velocity, change, time_step):
    """Bounds (2, N·d) m: everything within `spacing`, and the first velocity near the present one, axis by axis."""
    low, high = path[1:] - spacing, path[1:] + spacing
    middle, across = path[0] + velocity * time_step, change * time_step / np.sqrt(path.shape[1])
    low[0] = np.minimum(np.maximum(low[0], middle - across), path[1])
    high[0] = np.maximum(np.minimum(high[0], middle + across), path[1])
    return np.stack([low.ravel(), high.ravel()])
