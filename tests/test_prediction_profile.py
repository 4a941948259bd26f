"""The share of a Gaussian blob that lies in a ball: table, closed forms, and plain sampling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import ncx2

from sidestep._kernels.risk_profile import ball_probability, master_value, mixed_profiles, profile_value
from sidestep.prediction.collision import _master

NODES = np.stack(np.polynomial.legendre.leggauss(40))


@given(
    distance=st.floats(0.0, 6.0), radius=st.floats(0.1, 1.5), sigma=st.floats(0.02, 3.0), dimension=st.integers(1, 3)
)
def test_the_ball_probability_is_the_noncentral_chi_square(
    distance: float, radius: float, sigma: float, dimension: int
) -> None:
    expected = ncx2.cdf((radius / sigma) ** 2, dimension, (distance / sigma) ** 2 + 1e-12)
    assert ball_probability(distance, radius, sigma, dimension, NODES) == pytest.approx(expected, abs=2e-6)


@given(
    distance=st.floats(0.0, 6.0), radius=st.floats(0.1, 1.5), sigma=st.floats(0.01, 3.0), dimension=st.integers(1, 3)
)
def test_the_table_reads_the_same(distance: float, radius: float, sigma: float, dimension: int) -> None:
    table, axes = _master(dimension)
    exact = ball_probability(distance, radius, sigma, dimension, NODES)
    assert master_value(distance, radius, sigma, table, axes) == pytest.approx(exact, abs=4e-4)


@given(seed=st.integers(0, 1000))
def test_a_mixture_is_the_weighted_sum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    radius, weights, sigmas = rng.uniform(0.3, 1.0), rng.dirichlet(np.ones(4)), rng.uniform(0.03, 1.5, (3, 4))
    tables, grids = mixed_profiles(radius, weights, sigmas, *_master(2), 192)
    for b in range(3):
        for distance in rng.uniform(0, 2.5, 5):
            exact = sum(
                w * ball_probability(distance, radius, s, 2, NODES) for w, s in zip(weights, sigmas[b], strict=True)
            )
            assert profile_value(distance, tables[b], grids[b]) == pytest.approx(exact, abs=2e-3)
