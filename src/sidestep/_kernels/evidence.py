"""How well each hypothesis about a person explains what was measured of them, and Bayes' rule over them (Eq. 8).

Beliefs are (G, 2) weights > 0 that sum to 1: row g is candidate goal g, column 1 is "concerned" (β = 1).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray

FLOOR = 1e-12
"""Keeps every hypothesis alive when millions of likelihoods have been multiplied."""


@njit(**KERNEL)
def mixed(weights: FloatArray, probabilities: FloatArray) -> FloatArray:
    """(n,) Σ weights · P(u): action probabilities (G, 2, n) over what is believed (G, 2)."""
    out = np.zeros(probabilities.shape[2])
    for g in range(probabilities.shape[0]):
        for b in range(2):
            for n in range(out.size):
                out[n] += weights[g, b] * probabilities[g, b, n]
    return out


@njit(**KERNEL)
def action_weights(
    velocities: FloatArray, displacement: FloatArray, elapsed: float, covariance: FloatArray
) -> FloatArray:
    """(n,) N(displacement; u·elapsed, Σ) of every action u, scaled so that the largest is 1; size 0 if not finite.

    Args:
        velocities: (n, d) m/s.
        displacement: (d,) m.
        elapsed: s.
        covariance: (d, d) m², Σ; made regular here.
    """
    count, d = velocities.shape
    regular = covariance.copy()
    for a in range(d):
        regular[a, a] += 1e-9 + 1e-9 * np.trace(covariance)
    precision = np.linalg.inv(regular)
    out = np.empty(count)
    highest = -np.inf
    for n in range(count):
        exponent = 0.0
        for a in range(d):
            miss = displacement[a] - elapsed * velocities[n, a]
            for b in range(d):
                exponent -= 0.5 * miss * precision[a, b] * (displacement[b] - elapsed * velocities[n, b])
        if not math.isfinite(exponent):
            return np.empty(0)
        out[n] = exponent
        highest = max(highest, exponent)
    for n in range(count):
        out[n] = math.exp(out[n] - highest)
    return out


@njit(**KERNEL)
def normalised(weights: FloatArray) -> FloatArray:
    """Every weight at least `FLOOR`, all of them summing to 1."""
    out = np.empty_like(weights)
    total = 0.0
    for g in range(weights.shape[0]):
        for b in range(2):
            out[g, b] = max(weights[g, b], FLOOR)
            total += out[g, b]
    for g in range(weights.shape[0]):
        for b in range(2):
            out[g, b] /= total
    return out


@njit(**KERNEL)
def relaxed(weights: FloatArray, keep: float, concerned: float) -> FloatArray:
    """Awareness mixed with the prior P(β = 1) = `concerned`, apart for each goal; `keep` of it stays."""
    out = np.empty_like(weights)
    for g in range(weights.shape[0]):
        goal = weights[g, 0] + weights[g, 1]
        out[g, 0] = keep * weights[g, 0] + (1.0 - keep) * goal * (1.0 - concerned)
        out[g, 1] = keep * weights[g, 1] + (1.0 - keep) * goal * concerned
    return normalised(out)


@njit(**KERNEL)
def observed(weights: FloatArray, likelihood: FloatArray, share: float) -> FloatArray:
    """Bayes' rule with the likelihood (G, 2) to the power `share`; unchanged where it says nothing."""
    highest = 0.0
    for g in range(weights.shape[0]):
        for b in range(2):
            if not math.isfinite(likelihood[g, b]):
                return weights
            highest = max(highest, likelihood[g, b])
    if highest <= 0.0:
        return weights
    out = np.empty_like(weights)
    for g in range(weights.shape[0]):
        for b in range(2):
            out[g, b] = weights[g, b] * max(likelihood[g, b] / highest, FLOOR) ** share
    return normalised(out)


@njit(**KERNEL)
def goals_relaxed(weights: FloatArray, goals: FloatArray, keep: float) -> FloatArray:
    """Goals mixed with the probabilities `goals` (G,); `keep` of them stays, and so does P(β | goal)."""
    out = np.empty_like(weights)
    for g in range(weights.shape[0]):
        now = weights[g, 0] + weights[g, 1]
        share = (keep * now + (1.0 - keep) * goals[g]) / now
        out[g, 0], out[g, 1] = weights[g, 0] * share, weights[g, 1] * share
    return normalised(out)


@njit(**KERNEL)
def goal_likelihood(probabilities: FloatArray, weights: FloatArray) -> FloatArray:
    """(G, 2) Σ_u P(u; goal, β)·weights[u]; ones where that is zero everywhere or there are no weights."""
    out = np.ones((probabilities.shape[0], 2))
    highest = 0.0
    if weights.size > 0:
        for g in range(out.shape[0]):
            for b in range(2):
                out[g, b] = 0.0
                for n in range(weights.size):
                    out[g, b] += probabilities[g, b, n] * weights[n]
                highest = max(highest, out[g, b])
    return out if highest > 0.0 else np.ones((probabilities.shape[0], 2))


@njit(**KERNEL)
def weigh_action(
    weights: FloatArray,
    probabilities: FloatArray,
    velocities: FloatArray,
    moved: FloatArray,
    elapsed: float,
    doubt: FloatArray,
    share: float,
    goals_only: bool,
) -> FloatArray:
    """Weigh a displacement (Eq. 8); unchanged where no action explains it.

    Args:
        weights: (G, 2) before.
        probabilities: (G, 2, n) of the actions when the displacement began.
        velocities: (n, d) m/s, the actions.
        moved: (d,) m in `elapsed` s; doubt: (d, d) m², its covariance.
        share: of an action's evidence.
        goals_only: tells where to, not whether they mind: β is told otherwise.
    """
    fastest = gap = spread = 0.0
    for n in range(velocities.shape[0]):
        speed = 0.0
        for a in range(moved.size):
            speed += velocities[n, a] ** 2
        fastest = max(fastest, speed)
    for a in range(moved.size):
        gap += moved[a] ** 2
        spread += doubt[a, a]
    if math.sqrt(gap) > 2.0 * math.sqrt(fastest) * elapsed + 4.0 * math.sqrt(spread):
        return weights
    likelihood = goal_likelihood(probabilities, action_weights(velocities, moved, elapsed, doubt))
    if goals_only:
        for g in range(likelihood.shape[0]):
            likelihood[g, 1] = likelihood[g, 0]
    return observed(weights, likelihood, share)
