"""What is believed about a person: a joint probability over goal and awareness, learned by Bayes' rule (Eq. 8)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._kernels.evidence import action_weights
from sidestep.types import FloatArray, frozen_array

_FLOOR = 1e-12  # keeps every hypothesis alive when millions of likelihoods have been multiplied


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Belief:
    """P(goal, β) of one person.

    Attributes:
        weights: (G, 2) > 0, sum 1; column 1 is "concerned" (β = 1), row g is candidate goal g.
    """

    weights: FloatArray

    @property
    def concerned(self) -> float:
        """P(β = 1), strictly between 0 and 1."""
        return float(self.weights[:, 1].sum())

    @property
    def goals(self) -> FloatArray:
        """(G,) probability of each candidate goal."""
        return self.weights.sum(axis=1)


def prior(n_goals: int, concerned: float, goals: FloatArray | None = None) -> Belief:
    """Return the belief before any evidence: goal and awareness independent.

    Args:
        n_goals: number of candidate goals G (≥ 1).
        concerned: P_0(β = 1), strictly between 0 and 1.
        goals: (G,) prior over the goals; None is uniform.
    """
    over_goals = np.full(n_goals, 1.0 / n_goals) if goals is None else goals / goals.sum()
    return _normalised(np.outer(over_goals, [1.0 - concerned, concerned]))


def action_likelihood(
    probabilities: FloatArray,
    velocities: FloatArray,
    displacement: FloatArray,
    elapsed: float,
    covariance: FloatArray,
) -> FloatArray:
    """Likelihood of a measured displacement, Σ_u P(u|x; goal, β)·N(displacement; u·elapsed, Σ), up to a common factor.

    As Σ → 0 it tends to P(u*|x; goal, β) for the action u* nearest to the measurement, which is Eq. 8.

    Args:
        probabilities: (G, 2, n) action probabilities P(u|x; goal, β) when the displacement began.
        velocities: (n, d) m/s, the actions in the world frame.
        displacement: (d,) m, measured.
        elapsed: s, over which it happened.
        covariance: (d, d) m², of the displacement.

    Returns:
        (G, 2), scaled so that the largest entry of the Gaussian factors is 1; all ones where nothing can be said.
    """
    weights = action_weights(velocities, displacement, elapsed, covariance)
    if weights.size == 0:
        return np.ones(probabilities.shape[:2])
    likelihood = probabilities @ weights
    return likelihood if float(likelihood.max()) > 0 else np.ones(probabilities.shape[:2])


def observe(belief: Belief, likelihood: FloatArray, share: float = 1.0) -> Belief:
    """Bayes' rule (Eq. 8) over goal and awareness.

    Args:
        belief: before.
        likelihood: (G, 2) ≥ 0, from `action_likelihood`.
        share: elapsed time over the time step, at most 1: a fraction of a step is a fraction of the evidence, so that
            the belief depends on the time that passed and not on how often it was asked.

    Returns:
        The belief after; unchanged where the likelihood says nothing (not finite, or zero everywhere).
    """
    if not np.isfinite(likelihood).all() or float(likelihood.max()) <= 0:
        return belief
    tempered = np.power(np.maximum(likelihood / likelihood.max(), _FLOOR), min(max(share, 0.0), 1.0))
    return _normalised(belief.weights * tempered)


def with_concern(belief: Belief, concerned: float) -> Belief:
    """Return the belief with P(β = 1) = `concerned` whatever the goal; the goals keep their probabilities."""
    return _normalised(np.outer(belief.goals, [1.0 - concerned, concerned]))


def relax(belief: Belief, *, switch_rate: float, prior_concerned: float, elapsed: float) -> Belief:
    """Let awareness change its mind: a two-state Markov chain, apart for each goal.

    With `switch_rate` r (1/s) the distance to `prior_concerned` decays as exp(−2·r·elapsed); r = 0 is the paper.
    """
    if switch_rate <= 0 or elapsed <= 0:
        return belief
    keep = math.exp(-2.0 * switch_rate * elapsed)
    settled = np.outer(belief.goals, [1.0 - prior_concerned, prior_concerned])
    return _normalised(keep * belief.weights + (1.0 - keep) * settled)


def relax_goals(belief: Belief, goals: FloatArray, rate: float, elapsed: float) -> Belief:
    """Let the goal be forgotten towards `goals` ((G,) probabilities) at `rate` (1/s); P(β | goal) is kept."""
    now = belief.goals
    if goals.shape != now.shape or elapsed <= 0:
        return belief
    keep = math.exp(-rate * elapsed)
    later = keep * now + (1.0 - keep) * goals
    return _normalised(belief.weights * (later / now)[:, None])


def _normalised(weights: FloatArray) -> Belief:
    kept = np.maximum(weights, _FLOOR)
    return Belief(weights=frozen_array(kept / kept.sum()))
