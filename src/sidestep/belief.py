"""What is believed about a person: a joint probability over goal and awareness, learned by Bayes' rule (Eq. 8)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._kernels import evidence as kernel
from sidestep.types import FloatArray


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
        return float(sum(self.weights[:, 1].tolist()))

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
    return believed(kernel.normalised(np.outer(over_goals, [1.0 - concerned, concerned])))


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
    weights = kernel.action_weights(velocities, displacement, elapsed, covariance)
    return kernel.goal_likelihood(np.ascontiguousarray(probabilities, dtype=np.float64), weights)


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
    told = np.ascontiguousarray(likelihood, dtype=np.float64)
    return believed(kernel.observed(belief.weights, told, min(max(share, 0.0), 1.0)))


def with_concern(belief: Belief, concerned: float) -> Belief:
    """Return the belief with P(β = 1) = `concerned` whatever the goal; the goals keep their probabilities."""
    return believed(kernel.relaxed(belief.weights, 0.0, concerned))


def relax(belief: Belief, *, switch_rate: float, prior_concerned: float, elapsed: float) -> Belief:
    """Let awareness change its mind: a two-state Markov chain, apart for each goal.

    With `switch_rate` r (1/s) the distance to `prior_concerned` decays as exp(−2·r·elapsed); r = 0 is the paper.
    """
    if switch_rate <= 0 or elapsed <= 0:
        return belief
    keep = math.exp(-2.0 * switch_rate * elapsed)
    return believed(kernel.relaxed(belief.weights, keep, prior_concerned))


def relax_goals(belief: Belief, goals: FloatArray, rate: float, elapsed: float) -> Belief:
    """Let the goal be forgotten towards `goals` ((G,) probabilities) at `rate` (1/s); P(β | goal) is kept."""
    if len(goals) != len(belief.weights) or elapsed <= 0:
        return belief
    return believed(kernel.goals_relaxed(belief.weights, goals, math.exp(-rate * elapsed)))


def believed(weights: FloatArray) -> Belief:
    """Return the belief of these weights (G, 2), which are its own from now on."""
    weights.setflags(write=False)
    return Belief(weights=weights)
