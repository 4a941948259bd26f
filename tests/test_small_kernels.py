"""Vectors between frames and mixtures of actions, against matrix products."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sidestep._kernels.evidence import mixed
from sidestep._kernels.frames import local, turned


@given(seed=st.integers(0, 10**6), d=st.sampled_from([1, 2, 3]))
def test_frames_are_matrix_products(seed, d):
    rng = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(d, d)))
    vectors, origin = rng.normal(size=(7, d)), rng.normal(size=d)
    for one, other in ((turned, local), (turned.py_func, local.py_func)):
        assert one(vectors, rotation, 0.3) == pytest.approx(0.3 * vectors @ rotation.T)
        assert other(vectors[0], origin, rotation) == pytest.approx((vectors[0] - origin) @ rotation)


@given(seed=st.integers(0, 10**6), goals=st.integers(1, 4))
def test_mixtures_are_sums_over_what_is_believed(seed, goals):
    rng = np.random.default_rng(seed)
    weights, probabilities = rng.dirichlet(np.ones(2 * goals)).reshape(goals, 2), rng.dirichlet(np.ones(9), (goals, 2))
    for mix in (mixed, mixed.py_func):
        assert mix(weights, probabilities) == pytest.approx(np.einsum("gb,gbn->n", weights, probabilities))
