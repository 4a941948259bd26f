"""Eq. 8 against a dictionary-and-loops twin, and its laws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sidestep.belief import Belief, action_likelihood, believed, observe, prior, relax, relax_goals
from sidestep.human.actions import ActionSet


def probabilities(rng: np.random.Generator, goals: int, n: int, randomness: float) -> np.ndarray:
    deliberate = np.zeros((goals, 2, n))
    for g in range(goals):
        for b in range(2):
            deliberate[g, b, rng.integers(n)] = 1.0
    return (1 - randomness) * deliberate + randomness / n


def bayes_by_hand(belief: Belief, likelihood: np.ndarray) -> np.ndarray:
    posterior = {(g, b): belief.weights[g, b] * likelihood[g, b] for g in range(len(likelihood)) for b in (0, 1)}
    total = sum(posterior.values())
    return np.array([[posterior[g, b] / total for b in (0, 1)] for g in range(len(likelihood))])


@given(seed=st.integers(0, 10_000), goals=st.integers(1, 4), concerned=st.floats(0.01, 0.99))
def test_bayes_equals_the_loop_and_stays_strictly_inside(seed: int, goals: int, concerned: float) -> None:
    rng = np.random.default_rng(seed)
    belief = prior(goals, concerned)
    likelihood = rng.uniform(0.01, 1.0, (goals, 2))
    after = observe(belief, likelihood)
    np.testing.assert_allclose(after.weights, bayes_by_hand(belief, likelihood), rtol=1e-9, atol=1e-10)
    assert 0 < after.concerned < 1
    assert after.weights.sum() == pytest.approx(1)


@given(seed=st.integers(0, 10_000))
def test_without_noise_the_measurement_is_the_nearest_action(seed: int) -> None:
    rng = np.random.default_rng(seed)
    actions = ActionSet(speed=0.5)
    p = probabilities(rng, 1, len(actions), 0.2)
    u = int(rng.integers(len(actions)))
    lik = action_likelihood(p, actions.velocities, 0.5 * actions.velocities[u], 0.5, np.zeros((2, 2)))
    np.testing.assert_allclose(lik, p[:, :, u], rtol=1e-9)


def test_many_steps_of_evidence_never_reach_zero_or_one() -> None:
    belief = prior(1, 0.5)
    for _ in range(10_000):
        belief = observe(belief, np.array([[0.01, 0.9]]))
    assert 0 < belief.concerned < 1
    assert belief.concerned > 0.999


@given(parts=st.integers(1, 20), ratio=st.floats(0.01, 100))
def test_evidence_counts_by_elapsed_time_not_by_calls(parts: int, ratio: float) -> None:
    likelihood = np.array([[1.0, ratio]])
    once = observe(prior(1, 0.5), likelihood)
    often = prior(1, 0.5)
    for _ in range(parts):
        often = observe(often, likelihood, share=1 / parts)
    assert often.concerned == pytest.approx(once.concerned, rel=1e-6)


@given(low=st.floats(0.1, 1), more=st.floats(0, 5))
def test_belief_is_monotone_in_evidence(low: float, more: float) -> None:
    weak = observe(prior(1, 0.5), np.array([[1.0, low]]))
    strong = observe(prior(1, 0.5), np.array([[1.0, low + more]]))
    assert strong.concerned >= weak.concerned


def test_switching_forgets_towards_the_prior_and_keeps_the_goals() -> None:
    belief = observe(prior(2, 0.5), np.array([[0.1, 0.9], [0.01, 0.3]]))
    later = relax(belief, switch_rate=0.1, prior_concerned=0.5, elapsed=2.0)
    expected = 0.5 + (belief.concerned - 0.5) * math.exp(-0.4)
    assert later.concerned == pytest.approx(expected)
    np.testing.assert_allclose(later.goals, belief.goals)
    assert relax(belief, switch_rate=0.0, prior_concerned=0.5, elapsed=2.0) is belief


@pytest.mark.parametrize("nothing", [np.full((1, 2), np.nan), np.zeros((1, 2)), np.array([[np.inf, 1.0]])])
def test_evidence_that_says_nothing_leaves_the_belief(nothing: np.ndarray) -> None:
    belief = prior(1, 0.3)
    assert observe(belief, nothing) is belief


def test_measurements_that_are_not_finite_say_nothing() -> None:
    p = np.full((1, 2, 9), 1 / 9)
    actions = ActionSet(speed=0.5, reach=1)
    lik = action_likelihood(p, actions.velocities, np.array([np.nan, 0.0]), 0.5, np.eye(2))
    np.testing.assert_array_equal(lik, 1.0)


def test_a_recovered_mind_needs_few_informative_steps() -> None:
    belief = prior(1, 0.99)
    steps = 0
    while belief.concerned > 0.5:
        belief = observe(belief, np.array([[0.808, 0.008]]))  # ω = 0.2, 25 actions: the unconcerned action was seen
        steps += 1
    assert steps <= 4


def test_goals_are_forgotten_with_the_time_that_passes_and_awareness_is_kept() -> None:
    """Whether it is asked for in one call or in many."""
    weights = np.array([[0.5, 0.2], [0.05, 0.25]])
    before, usual = believed(weights.copy()), np.array([0.4, 0.6])
    once = relax_goals(before, usual, 0.7, 2.0)
    np.testing.assert_allclose(once.weights.sum(axis=1), usual + np.exp(-1.4) * (weights.sum(axis=1) - usual))
    np.testing.assert_allclose(once.weights[:, 1] / once.weights.sum(axis=1), weights[:, 1] / weights.sum(axis=1))
    often = before
    for _ in range(5):
        often = relax_goals(often, usual, 0.7, 0.4)
    np.testing.assert_allclose(often.weights, once.weights)
    assert relax_goals(before, np.full(3, 1 / 3), 0.7, 2.0) is before  # of other goals
