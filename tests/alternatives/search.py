"""The robot's search by trying every sequence of actions."""

from __future__ import annotations

from itertools import product

import numpy as np


def charge(risk, weight, limit, steep):
    if risk > limit:
        return np.inf if np.isinf(steep) else weight * risk + steep * (risk - limit)
    return weight * risk


def halfway_mean(raster, centre, a, b):
    """Mean of the raster cells around the point halfway between cells a and b."""
    z = np.asarray(a) + np.asarray(b)
    corners = [[(v + up) // 2 for up in (0, 1)] for v in z]
    return float(np.mean([raster[tuple(np.array(c) + centre)] for c in product(*corners)]))


def sequence_cost(sequence, given):
    """Cost of one sequence of indices into the taps; `given` holds plain arrays over d axes."""
    d = given["taps"].shape[1]
    here = np.zeros(d, dtype=int)
    total = 0.0
    for k, t in enumerate(sequence):
        tap = given["taps"][t]
        there = here + tap
        share = given["share"] if t == 0 else 1.0
        total += given["effort"][t] + (given["first"][t] if k == 0 else 0.0)
        full = given["stage"].shape[0] // 2
        total += given["stage"][tuple(there + full)]
        if k == len(sequence) - 1:
            total += given["terminal"][tuple(there + full)]
        end, mid = given["risk"][2 * k + 2], given["risk"][2 * k + 1]
        if end is not None:
            risk = end[tuple(there + end.shape[0] // 2)]
            total += share * charge(risk, given["weights"][0], given["limit"], given["steep"][k])
        if mid is not None:
            risk = halfway_mean(mid, mid.shape[0] // 2, here, there)
            total += share * charge(risk, given["weights"][1], given["limit"], given["steep"][k])
        wall = given["wall"] if k > 0 else None
        if wall is not None and (wall(2 * there) or wall(here + there)):
            return np.inf
        here = there
    return total


def best_sequence(horizon, given):
    """Smallest cost over all sequences."""
    return min(sequence_cost(s, given) for s in product(range(len(given["taps"])), repeat=horizon))
