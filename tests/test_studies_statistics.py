"""Intervals against published values and their own definition; paired tests against enumeration."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from sidestep.errors import InvalidInput
from sidestep.studies import statistics as s


def test_clopper_pearson_is_the_inversion_of_the_binomial_test():
    low, high = s.clopper_pearson(7, 50, 0.95)
    assert stats.binom.sf(6, 50, low) == pytest.approx(0.025)
    assert stats.binom.cdf(7, 50, high) == pytest.approx(0.025)


def test_rule_of_three():
    assert s.upper_bound(0, 300, 0.95) == pytest.approx(3 / 300, rel=0.01)
    assert s.upper_bound(0, 90, 0.99) == pytest.approx(1 - 0.01 ** (1 / 90))
    assert s.upper_bound(5, 5) == 1.0
    assert s.clopper_pearson(0, 0) == (0.0, 1.0)


@settings(max_examples=50, deadline=None)
@given(st.integers(1, 400), st.data())
def test_bounds_hold_the_estimate_and_tighten_with_trials(n, data):
    k = data.draw(st.integers(0, n))
    low, high = s.clopper_pearson(k, n)
    assert low <= k / n <= high
    assert s.upper_bound(k, n) <= high
    wide = s.clopper_pearson(k, n, 0.999)
    assert wide[0] <= low
    assert high <= wide[1]
    double = s.clopper_pearson(2 * k, 2 * n)
    assert double[1] - double[0] <= high - low + 1e-12


def test_mcnemar_by_enumeration():
    for b, c in ((0, 0), (3, 0), (1, 5), (4, 4)):
        n = b + c
        outcomes = [sum(bits) for bits in itertools.product((0, 1), repeat=n)]
        extreme = sum(abs(k - n / 2) >= abs(b - n / 2) for k in outcomes)
        assert s.mcnemar(b, c) == pytest.approx(extreme / len(outcomes))
        assert s.mcnemar(b, c) == s.mcnemar(c, b)


def test_bootstrap_covers_the_mean_of_a_normal_sample():
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(60):
        low, high = s.bootstrap_mean(rng.normal(3.0, 1.0, 40), rng, resamples=400)
        hits += low <= 3.0 <= high
    assert hits >= 50
    assert all(map(math.isnan, s.bootstrap_mean(np.array([math.nan]), rng)))


def test_area_under_curve_by_pairs():
    rng = np.random.default_rng(1)
    scores, labels = rng.integers(0, 5, 40) / 4.0, rng.random(40) < 0.4
    pairs = [(p > n) + 0.5 * (p == n) for p in scores[labels] for n in scores[~labels]]
    assert s.area_under_curve(scores, labels) == pytest.approx(np.mean(pairs))
    assert math.isnan(s.area_under_curve(scores, np.ones(40)))


def test_log_loss_of_the_truth_is_its_entropy():
    rng = np.random.default_rng(2)
    p = rng.random(20000)
    happened = rng.random(20000) < p
    assert s.log_loss(p, happened) == pytest.approx(0.5, abs=0.02)  # ∫ entropy over uniform p
    assert math.isnan(s.log_loss(np.zeros(0), np.zeros(0)))
    assert s.log_loss(np.array([1.0]), np.array([False])) < 20


def test_calibration_of_calibrated_and_of_overconfident_predictions():
    rng = np.random.default_rng(3)
    p = rng.random(20000)
    happened = rng.random(20000) < p
    bins = s.calibration_bins(p, happened, np.linspace(0, 1, 11))
    assert len(bins) == 10
    assert s.expected_calibration_error(bins) < 0.02
    assert all(b["low"] <= b["predicted"] <= b["high"] for b in bins)
    halved = s.calibration_bins(p / 2, happened, np.linspace(0, 1, 11))
    assert s.expected_calibration_error(halved) == pytest.approx(0.25, abs=0.02)
    assert math.isnan(s.expected_calibration_error([]))


def test_impossible_counts_are_refused():
    with pytest.raises(InvalidInput, match="successes"):
        s.clopper_pearson(3, 2)


def test_the_interval_of_the_area_narrows_with_the_number_and_holds_the_truth():
    rng = np.random.default_rng(3)

    def interval(n):
        labels = np.repeat([1.0, 0.0], n)
        scores = np.concatenate([rng.normal(1.0, 1.0, n), rng.normal(0.0, 1.0, n)])
        return s.area_interval(scores, labels, np.random.default_rng(0))

    truth = 0.7602  # Φ(1/√2)
    few, many = interval(12), interval(300)
    assert many[0] < truth < many[1]
    assert many[1] - many[0] < 0.4 * (few[1] - few[0])
    assert all(math.isnan(v) for v in s.area_interval(np.ones(3), np.ones(3), rng))
