"""The robot's search by trying every sequence of actions."""

from __future__ import annotations

from itertools import pairwise, product

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


def best_sequence(horizon, given, change=np.inf):
    """Smallest cost over all sequences in which no tap differs from the one before by more than `change` cells."""
    taps = given["taps"]
    gentle = [
        s
        for s in product(range(len(taps)), repeat=horizon)
        if all(np.linalg.norm(taps[b] - taps[a]) <= change for a, b in pairwise(s))
    ]
    return min(sequence_cost(s, given) for s in gentle)


def free_moves(radius, taps, effort):
    """Displacement → what it costs at least: every one between taps, by the least of each axis if that adds up.

    An axis's part is the smallest effort of any tap that goes as far along it; where these sum to more than a tap
    costs, nothing is charged.
    """
    part = [
        {w: min(e for t, e in zip(taps, effort, strict=True) if abs(t[a]) == abs(w)) for w in set(taps[:, a])}
        for a in range(taps.shape[1])
    ]
    sums = [sum(part[a][w] for a, w in enumerate(t)) for t in taps]
    adds_up = all(s <= e * 1.000001 + 1e-9 for s, e in zip(sums, effort, strict=True))
    moves = {}
    for move in product(range(-radius, radius + 1), repeat=taps.shape[1]):
        beyond = [abs(t[-1]) for t in taps if all(abs(x) == abs(y) for x, y in zip(t[:-1], move[:-1], strict=True))]
        if beyond and abs(move[-1]) <= max(beyond):
            parts = [part[a].get(w, part[a].get(-w, np.inf)) for a, w in enumerate(move)]
            moves[move] = sum(parts) if adds_up else 0.0
    return moves


def free_costs(horizon, radius, given, blocked):
    """What is paid at least on the way to a cell, and after it: two lists of dictionaries, one per step 0..N."""
    moves = free_moves(radius, given["taps"], given["effort"])
    full = given["stage"].shape[0] // 2

    def stage(cell, wall):
        at = tuple(np.array(cell) + full)
        return np.inf if wall and blocked is not None and blocked[at] else float(given["stage"][at])

    d = given["taps"].shape[1]
    cells = [list(product(range(-radius * k, radius * k + 1), repeat=d)) for k in range(horizon + 1)]
    after = [{} for _ in range(horizon)] + [{c: float(given["terminal"][tuple(np.array(c) + full)]) for c in cells[-1]}]
    for k in range(horizon - 1, 0, -1):
        for cell in cells[k]:
            ends = [(tuple(np.add(cell, m)), cost) for m, cost in moves.items()]
            after[k][cell] = min(cost + stage(end, True) + after[k + 1][end] for end, cost in ends)
    before = [{}, dict.fromkeys(cells[1], np.inf)]
    for tap, effort, first in zip(given["taps"], given["effort"], given["first"], strict=True):
        before[1][tuple(tap)] = float(effort + first) + stage(tap, False)
    for k in range(2, horizon + 1):
        before.append(dict.fromkeys(cells[k], np.inf))
        for cell, cost in before[k - 1].items():
            for move, effort in moves.items():
                end = tuple(np.add(cell, move))
                before[k][end] = min(before[k][end], cost + effort + stage(end, True))
    return before, after
