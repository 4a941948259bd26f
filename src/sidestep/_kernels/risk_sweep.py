"""Closest approach of two straight motions, and the probability that it is too close."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray, IntArray


@njit(**KERNEL)
def sweep_risk(
    start: FloatArray,
    velocities: FloatArray,
    positions: FloatArray,
    sigmas: FloatArray,
    person: IntArray,
    actions: FloatArray,
    probabilities: FloatArray,
    distances: FloatArray,
    interval: float,
) -> tuple[FloatArray, FloatArray]:
    """Evaluate `FirstStep.risk`; arguments as there.

    The points within r of a segment form a convex set, so a Gaussian offset falls into it with at most the probability
    of the half-space that touches it: Φ((r − D)/σ), D the closest approach of the mean.
    """
    count = velocities.shape[0]
    d = start.size
    people = positions.shape[0]
    clear = np.ones(count)
    approach = np.full(count, -np.inf)
    close = np.zeros(people)
    offset = np.empty((people, d))
    for h in range(people):
        gap = 0.0
        for a in range(d):
            offset[h, a] = positions[h, a] - start[a]
            gap += offset[h, a] ** 2
        close[h] = math.sqrt(gap)
    apart = _apart(close, velocities, person, actions, probabilities, distances, sigmas, interval)
    for m in range(count):
        h = -1
        total = 0.0
        for n in range(person.size):
            if person[n] != h:
                if h >= 0:
                    clear[m] *= 1.0 - min(total, 1.0)
                h = person[n]
                total = 0.0
                if close[h] < distances[h]:
                    toward = 0.0
                    for a in range(d):
                        toward += velocities[m, a] * offset[h, a]
                    approach[m] = max(approach[m], toward / max(close[h], 1e-9))
            if apart[h] or close[h] < distances[h] or probabilities[n] <= 0.0:
                continue
            speed = 0.0
            along = 0.0
            for a in range(d):
                v = actions[n, a] - velocities[m, a]
                speed += v * v
                along -= v * offset[h, a]
            t = min(max(along / speed, 0.0), interval) if speed > 1e-18 else 0.0
            gap = 0.0
            for a in range(d):
                gap += (offset[h, a] + t * (actions[n, a] - velocities[m, a])) ** 2
            r = distances[h]
            if gap > (r + 9.0 * sigmas[h]) ** 2:
                continue
            gap = math.sqrt(gap)
            if sigmas[h] > 0.0:
                total += probabilities[n] * 0.5 * math.erfc((gap - r) / sigmas[h] * 0.7071067811865476)
            elif gap < r * (1.0 - 1e-9):
                total += probabilities[n]
        if h >= 0:
            clear[m] *= 1.0 - min(total, 1.0)
    return 1.0 - clear, approach


@njit(**KERNEL)
def _apart(
    close: FloatArray,
    velocities: FloatArray,
    person: IntArray,
    actions: FloatArray,
    probabilities: FloatArray,
    distances: FloatArray,
    sigmas: FloatArray,
    interval: float,
) -> NDArray[np.bool_]:
    """(P,) whether a person and the robot cannot meet in the interval, whatever either does."""
    out = np.zeros(close.size, np.bool_)
    fastest, own = np.zeros(close.size), 0.0
    for m in range(velocities.shape[0]):
        own = max(own, _square(velocities[m]))
    for n in range(person.size):
        if probabilities[n] > 0.0:
            fastest[person[n]] = max(fastest[person[n]], _square(actions[n]))
    for h in range(close.size):
        closing = interval * (math.sqrt(own) + math.sqrt(fastest[h]))
        out[h] = close[h] - closing > distances[h] + 9.0 * sigmas[h]
    return out


@njit(**KERNEL)
def _square(vector: FloatArray) -> float:
    total = 0.0
    for a in range(vector.size):
        total += vector[a] * vector[a]
    return total


@njit(**KERNEL)
def charge_first_step(
    velocities: FloatArray,
    risk: FloatArray,
    approach: FloatArray,
    limit: float,
    interval: float,
    graded: bool,
    steep: float,
) -> FloatArray:
    """Cost (M,) of robot velocities (M, d) m/s by what `sweep_risk` says of them, see `FirstStep.costs`."""
    out = np.zeros(velocities.shape[0])
    for m in range(out.size):
        standing = True
        for a in range(velocities.shape[1]):
            standing = standing and velocities[m, a] == 0.0
        if graded:
            excess = max(risk[m] - limit, 0.0) + max(approach[m], 0.0) * interval
            out[m] = steep * excess * (1.0 / 3.0 if standing else 1.0)
        elif not standing and (risk[m] > limit * (1.0 + 1e-9) or approach[m] > 1e-9):
            out[m] = np.inf
    return out


@njit(**KERNEL)
def first_step_costs(
    start: FloatArray,
    velocities: FloatArray,
    positions: FloatArray,
    sigmas: FloatArray,
    person: IntArray,
    actions: FloatArray,
    probabilities: FloatArray,
    distances: FloatArray,
    interval: float,
    limit: float,
    graded: bool,
    steep: float,
) -> FloatArray:
    """Cost (M,) of robot velocities (M, d) m/s by what `sweep_risk` says of them, see `FirstStep.costs`."""
    risk, approach = sweep_risk(
        start, velocities, positions, sigmas, person, actions, probabilities, distances, interval
    )
    return charge_first_step(velocities, risk, approach, limit, interval, graded, steep)


@njit(**KERNEL)
def forbid_changes(velocities: FloatArray, now: FloatArray, largest: float, costs: FloatArray) -> None:
    """Make velocities (M, d) m/s that differ from `now` by more than `largest` cost inf, in place."""
    for m in range(costs.size):
        square = 0.0
        for a in range(now.size):
            square += (velocities[m, a] - now[a]) ** 2
        if math.sqrt(square) > largest * (1.0 + 1e-6) + 1e-9:
            costs[m] = np.inf
