"""Vectors between frames and mixtures of actions, against matrix products."""

from __future__ import annotations

from functools import reduce

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sidestep._kernels.danger_sum import add_products
from sidestep._kernels.evidence import mixed
from sidestep._kernels.frames import local, turned
from sidestep._kernels.sweep import row_count
from sidestep._kernels.sweep_tables import wall_off


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


@given(seed=st.integers(0, 10**6), d=st.sampled_from([1, 2, 3]), single=st.booleans())
def test_dangers_of_several_bodies_are_sums_of_outer_products(seed, d, single):
    rng = np.random.default_rng(seed)
    instants, width = 3, 5
    axes = rng.normal(size=(3 * instants, width)).astype(np.float32 if single else np.float64)
    before = rng.normal(size=(instants * width ** (d - 1), width)).astype(axes.dtype)
    expected = before.copy().reshape(instants, *(width,) * d)
    for t, factors in enumerate(axes.reshape(instants, 3, width)):
        expected[t] += np.prod(factors[: 3 - d, 0]) * reduce(np.multiply.outer, factors[3 - d :])
    for add in (add_products, add_products.py_func):
        table = before.copy()
        add(axes, d, table)
        assert table.reshape(expected.shape) == pytest.approx(expected, rel=1e-4, abs=1e-5)


@given(seed=st.integers(0, 10**6), d=st.sampled_from([1, 2, 3]), summed=st.booleans())
def test_only_free_cells_have_a_finite_cost(seed, d, summed):
    rng = np.random.default_rng(seed)
    width = 5
    axes, table = np.zeros((3, width)), rng.normal(size=(width ** (d - 1), width))
    axes[3 - d :] = rng.normal(size=(d, width))
    free = rng.random(table.shape) < 0.7
    costs = reduce(np.add.outer, axes[3 - d :]).reshape(table.shape) if summed else table
    for close in (wall_off, wall_off.py_func):
        out = table.copy()
        close(free, axes, summed, row_count(2, d), out)
        assert out == pytest.approx(np.where(free, costs, np.inf))
