"""The convex program around a path, term by term from its definition."""

from __future__ import annotations

import numpy as np


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
