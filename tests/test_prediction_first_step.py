"""The sweep of the first step against dense sampling in time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as options
from hypothesis import strategies as st

from alternatives import risk as naive
from sidestep._kernels.risk_sweep import charge_first_step, first_step_costs, sweep_risk
from sidestep.prediction.first_step import FirstStep, first_step_risk

SPEED = st.floats(-2, 2)


def made(positions, actions, *, sigma=0.0, distance=0.6, interval=0.5, limit=0.01):
    count = len(positions)
    return FirstStep(
        positions=np.asarray(positions, float), sigmas=np.full(count, sigma),
        person=np.repeat(np.arange(count), len(actions)), velocities=np.tile(np.asarray(actions, float), (count, 1)),
        probabilities=np.full(count * len(actions), 1.0 / len(actions)), distances=np.full(count, distance),
        interval=interval, limit=limit,
    )  # fmt: skip


@given(d=st.integers(1, 3), seed=st.integers(0, 10**6), interval=st.sampled_from([0.1, 0.5, 2.0]))
@options(max_examples=60)
def test_sweep_equals_dense_sampling(d, seed, interval):
    rng = np.random.default_rng(seed)
    start, position = rng.uniform(-1, 1, (2, d))
    velocities, actions = rng.uniform(-1.5, 1.5, (2, 4, d))
    chances = rng.dirichlet(np.ones(4))
    distance = rng.uniform(0.1, 0.8)
    got = first_step_risk(
        start, velocities, position=position, actions=actions, probabilities=chances, sigma=0.0, distance=distance,
        interval=interval,
    )  # fmt: skip
    low, high = (
        [naive.sweep(start, v, position, actions, chances, distance + e, interval) for v in velocities]
        for e in (-1e-3, 1e-3)
    )
    assert (np.array(low) - 1e-9 <= got).all()
    assert (got <= np.array(high) + 1e-9).all()


def test_uncertain_position_is_bounded_from_above_and_closely():
    rng = np.random.default_rng(3)
    position, sigma, distance, interval = np.array([1.1, 0.2]), 0.1, 0.6, 0.5
    actions, chances = np.array([[-1.0, 0.0], [0.0, 0.0]]), np.array([0.7, 0.3])
    velocities = np.array([[0.0, 0.0], [0.4, 0.0], [1.0, 0.0], [0.0, 1.0]])
    got = first_step_risk(
        np.zeros(2), velocities, position=position, actions=actions, probabilities=chances, sigma=sigma,
        distance=distance, interval=interval,
    )  # fmt: skip
    t = np.linspace(0, interval, 101)[:, None, None]
    for v, bound in zip(velocities, got, strict=True):
        share = 0.0
        for action, p in zip(actions, chances, strict=True):
            places = position + sigma * rng.standard_normal((4000, 2))
            gaps = np.linalg.norm(places + t * (action - v), axis=2).min(axis=0)
            share += p * np.mean(gaps < distance)
        assert share <= bound + 0.02
        assert bound <= share + 0.08


@given(ux=SPEED, uy=SPEED, distance=st.floats(0.1, 0.9), more=st.floats(0, 0.5), sigma=st.floats(0, 0.3))
@options(max_examples=40)
def test_risk_rises_with_distance_and_with_people(ux, uy, distance, more, sigma):
    actions = [(-1.0, 0.0), (0.0, 0.5), (0.3, 0.3)]
    velocity = np.array([[ux, uy]])
    risks = [
        made([(1.5, 0.1)], actions, sigma=sigma, distance=r).risk(np.zeros(2), velocity)[0][0]
        for r in (distance, distance + more)
    ]
    assert risks[0] <= risks[1] + 1e-12
    together = made([(1.5, 0.1), (0.0, 1.8)], actions, sigma=sigma, distance=distance).risk(np.zeros(2), velocity)[0][0]
    assert together >= risks[0] - 1e-12


def test_those_already_close_are_not_approached_and_standing_is_always_allowed():
    step = made([(0.4, 0.0)], [(0.0, 0.0)])
    velocities = np.array([[0.0, 0.0], [0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.1, 0.5]])
    cost = step.costs(np.zeros(2), velocities, graded=False, steep=1e4)
    assert list(np.isfinite(cost)) == [True, False, True, True, False]
    graded = step.costs(np.zeros(2), velocities, graded=True, steep=1e4)
    assert np.isfinite(graded).all()
    assert graded[1] > graded[4] > graded[2] == 0.0


@pytest.mark.parametrize(("x", "risky"), [(0.9, True), (3.0, False)])
def test_where_staying_is_riskier_than_the_limit_what_is_no_riskier_is_admitted(x, risky):
    """Beside somebody who comes nearer, every way to leave would be forbidden."""
    start = np.zeros(2)
    step = made([(x, 0.0)], [(-1.0, 0.0)])
    eased = step.no_worse_than_staying(start)
    staying = step.risk(start, np.zeros((1, 2)))[0][0]
    assert (staying > step.limit) == risky
    assert eased.limit == pytest.approx(max(staying, step.limit))
    away = np.array([[-0.2, 0.0]])
    assert np.isfinite(eased.costs(start, away, graded=False, steep=1e4))
    assert np.isfinite(step.costs(start, away, graded=False, steep=1e4)) != risky


def test_standing_is_charged_a_third_when_graded():
    step = made([(0.9, 0.0)], [(-1.0, 0.0)])
    velocities = np.array([[0.0, 0.0], [0.01, 0.0]])
    cost = step.costs(np.zeros(2), velocities, graded=True, steep=300.0)
    assert cost == pytest.approx([99.0, 297.0])
    assert np.isfinite(step.costs(np.zeros(2), velocities, graded=False, steep=300.0)[0])


def test_person_on_top_of_the_robot_gives_numbers():
    step = made([(0.0, 0.0)], [(0.0, 0.0), (1.0, 0.0)], sigma=0.1)
    for graded in (True, False):
        assert not np.isnan(step.costs(np.zeros(2), np.eye(2), graded=graded, steep=1e4)).any()
    risk = first_step_risk(
        np.zeros(2), np.eye(2), position=np.zeros(2), actions=np.eye(2), probabilities=np.full(2, 0.5), sigma=0.0,
        distance=0.6, interval=0.5,
    )  # fmt: skip
    assert (risk == 1.0).all()


def test_kernel_without_compilation_agrees():
    step = made([(0.8, 0.0), (0.2, 0.1)], [(-1.0, 0.0), (0.2, 0.7)], sigma=0.2)
    arguments = (np.zeros(2), np.array([[0.3, 0.1], [-0.4, 1.0]]), step.positions, step.sigmas, step.person,
                 step.velocities, step.probabilities, step.distances, step.interval)  # fmt: skip
    for a, b in zip(sweep_risk(*arguments), sweep_risk.py_func(*arguments), strict=True):
        assert a == pytest.approx(b)
    for graded in (True, False):
        price = charge_first_step.py_func(arguments[1], *sweep_risk(*arguments), step.limit, 0.5, graded, 300.0)
        for kernel in (first_step_costs, first_step_costs.py_func):
            assert kernel(*arguments, step.limit, graded, 300.0) == pytest.approx(price)
