"""The kernels of scanner and tracker against naive twins."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alternatives.scans import DenseKalman, cells_on_line, first_hit, tree_values
from sidestep._kernels.carve import traversed
from sidestep._kernels.forest import sum_of_leaves
from sidestep._kernels.ray import cast
from sidestep.perception.classifier import CLASSES, load_classifier
from sidestep.perception.clusters import FEATURES
from sidestep.perception.table import TrackTable

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS)
def test_beams_end_where_the_definition_says(seed):
    rng = np.random.default_rng(seed)
    segments, count = rng.uniform(-4, 4, (rng.integers(0, 6), 4)), 12
    discs = np.hstack([rng.uniform(-4, 4, (3, 2)), rng.uniform(0.05, 0.4, (3, 1)), rng.uniform(-2, 2, (3, 2))])[
        : rng.integers(0, 4)
    ]
    origins, bearings = rng.uniform(-1, 1, (count, 2)), rng.uniform(-np.pi, np.pi, count)
    times = rng.uniform(0, 0.1, count)
    expected = [first_hit(o, b, t, segments, discs, 5.0) for o, b, t in zip(origins, bearings, times, strict=True)]
    for function in (cast, cast.py_func):
        found = zip(*function(origins, bearings, times, segments, discs, 5.0), strict=True)
        for ours, (distance, index, squareness) in zip(found, expected, strict=True):
            assert ours[1] == index
            assert ours[0] == pytest.approx(distance, abs=1e-9)
            assert ours[2] == pytest.approx(squareness, abs=1e-6)


@given(seed=SEEDS)
def test_lines_pass_through_the_cells_that_dense_points_meet(seed):
    rng = np.random.default_rng(seed)
    origin, end, corner = rng.uniform(0, 4, 2), rng.uniform(-1, 5, 2), np.array([0.0, 0.0])
    expected = cells_on_line(origin, end, corner, 0.5, (8, 8))
    for function in (traversed, traversed.py_func):
        found = function(origin, end[None], corner, 0.5, (8, 8))
        assert np.all(found[expected])  # points may miss a corner that the line just cuts
        assert (found & ~expected).sum() <= 2


@given(seed=SEEDS)
def test_a_line_to_a_place_beyond_reckoning_ends_with_the_grid(seed):
    rng = np.random.default_rng(seed)
    origin, bearing = rng.uniform(0, 4, 2), rng.uniform(-np.pi, np.pi)
    way = np.array([np.cos(bearing), np.sin(bearing)])
    near = traversed(origin, (origin + 9.0 * way)[None], np.zeros(2), 0.5, (8, 8))
    far = traversed(origin, (origin + 1e12 * way)[None], np.zeros(2), 0.5, (8, 8))
    assert np.all(near == far) or (near ^ far).sum() <= 2  # a corner may be cut on one side or the other


def test_a_line_along_an_axis_meets_each_cell_once():
    grid = traversed(np.array([0.25, 0.25]), np.array([[3.25, 0.25], [0.25, 1.75]]), np.zeros(2), 0.5, (8, 8))
    assert np.argwhere(grid).tolist() == [[0, 0], [0, 1], [0, 2], [0, 3]] + [[i, 0] for i in range(1, 7)]


def test_trees_are_walked_as_written():
    trees = load_classifier()
    rng = np.random.default_rng(0)
    samples = rng.uniform(0, 1, (20, len(FEATURES))) * rng.choice([0.1, 1.0, 10.0], (20, 1))
    arrays = (trees.roots, trees.features, trees.thresholds, trees.children, trees.values)
    expected = tree_values(samples, *arrays, len(CLASSES))
    for function in (sum_of_leaves, sum_of_leaves.py_func):
        np.testing.assert_allclose(function(samples, *arrays, len(CLASSES)), expected, rtol=1e-9)


@given(seed=SEEDS)
def test_the_filter_with_one_covariance_for_both_axes_is_the_whole_filter(seed):
    rng = np.random.default_rng(seed)
    place, variance = rng.uniform(-5, 5, 2), rng.uniform(0.001, 0.1)
    table, dense = TrackTable(), DenseKalman(place, variance, 1.0)
    table.add(np.array([7]), place[None], np.array([variance]), 1.0)
    for _ in range(6):
        duration, agility, delay = rng.uniform(0, 0.3), rng.uniform(0.1, 3), rng.uniform(0, 0.1)
        measured, noise = table.position[0] + rng.normal(size=2), rng.uniform(0.001, 0.1)
        table.predict(duration, agility)
        dense.predict(duration, agility)
        table.correct(np.array([0]), measured[None], np.array([noise]), np.array([delay]))
        dense.correct(measured, noise, delay)
    np.testing.assert_allclose([*table.position[0], *table.velocity[0]], dense.mean, atol=1e-9)
    pp, pv, vv = table.covariance[0]
    expected = np.kron([[pp, pv], [pv, vv]], np.eye(2))
    np.testing.assert_allclose(expected, dense.covariance, atol=1e-9)
