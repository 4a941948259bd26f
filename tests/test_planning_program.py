"""The compiled convex program against its definition, and against derivatives of what it stands for."""

from __future__ import annotations

import numpy as np
import pytest

from alternatives.program import forbidden, objective_value
from sidestep._kernels.path_costs import goal_costs, half_instants, motion_cost, top_speed
from sidestep._kernels.program import CHORD_ANGLE, goal_model, half_planes, objective

STEPS = 4


@pytest.fixture
def generator() -> np.random.Generator:
    return np.random.default_rng(3)


def made_path(generator, d):
    return np.concatenate([np.zeros((1, d)), np.cumsum(generator.normal(0, 0.3, (STEPS, d)), axis=0)])


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("wished", [0.0, 7.0])
def test_hessian_and_linear_term_are_those_of_the_sums(generator, d, wished):
    path = made_path(generator, d)
    curvature, slope = generator.uniform(0.1, 2.0, (STEPS, d)), generator.normal(size=(STEPS, d))
    effort, first = generator.uniform(0.1, 1.0, d), generator.normal(size=d)
    hessian, linear = objective(path, curvature, slope, effort, first, wished)
    np.testing.assert_allclose(hessian, hessian.T)

    def slow(x):
        return objective_value(x.reshape(-1, d), path[0], curvature, slope, path[1:], effort, first, wished)

    def fast(x):
        return 0.5 * x @ hessian @ x + linear @ x

    origin = path[1:].ravel()
    for _ in range(5):
        x = origin + generator.normal(0, 0.5, origin.size)
        assert fast(x) - fast(origin) == pytest.approx(slow(x) - slow(origin), abs=1e-6)


@pytest.mark.parametrize("squared", [True, False])
def test_goal_model_has_the_slope_of_the_goal_cost_and_lies_above_it(generator, squared):
    path, goal, weight = made_path(generator, 2), np.array([2.0, 1.0]), np.array([1.0, 3.0])
    curvature, slope = goal_model(path, goal, weight, squared, 0.5)
    scale = np.array([1.0, 1.0, 1.0, 1.5])
    here = goal_costs(path[1:], goal, weight, squared)
    for a in range(2):
        step = 1e-6 * np.eye(2)[a]
        rise = goal_costs(path[1:] + step, goal, weight, squared) - goal_costs(path[1:] - step, goal, weight, squared)
        np.testing.assert_allclose(slope[:, a], scale * rise / 2e-6, rtol=1e-5, atol=1e-6)
    for _ in range(20):
        move = generator.normal(0, 0.3, (STEPS, 2))
        model = scale * here + (slope * move).sum(axis=1) + 0.5 * (curvature * move**2).sum(axis=1)
        assert np.all(model >= scale * goal_costs(path[1:] + move, goal, weight, squared) - 1e-9)


@pytest.mark.parametrize(("d", "box"), [(1, False), (2, True), (2, False), (3, False), (3, True)])
def test_half_planes_hold_exactly_where_their_definitions_do(generator, d, box):
    path = made_path(generator, d)
    directions = np.concatenate([np.eye(d), -np.eye(d)])
    room = generator.uniform(0.0, 0.4, (2 * STEPS, 2 * d))
    columns, bounds = half_planes(path, room, directions, 0.15, 0.5, box, 100.0)
    closer = forbidden(path, room, directions, 0.15)
    assert len(closer) > 0
    for _ in range(10):
        x = path[1:] + generator.normal(0, 0.1, (STEPS, d))
        places = half_instants(np.concatenate([path[:1], x]))[:, 3 - d :]
        margin = bounds - x.ravel() @ columns
        expected = [limit - places[n] @ direction for n, direction, limit in closer]
        np.testing.assert_allclose(margin[: len(closer)], expected, atol=1e-12)
        moves = np.diff(np.concatenate([path[:1], x]), axis=0)
        per_step = margin[len(closer) :].reshape(STEPS, -1)
        if box or d == 1:
            np.testing.assert_allclose(per_step, 0.5 - np.concatenate([moves, -moves], axis=1), atol=1e-12)
        else:  # chords of the ball: never outside it where the direction is the present one
            along = moves[per_step.min(axis=1) < 0]
            assert np.all(np.linalg.norm(along, axis=1) > 0.5 * np.cos(0.5 * CHORD_ANGLE) - 1e-9)


@pytest.mark.parametrize("d", [2, 3])
def test_chords_keep_the_present_direction_within_the_speed_limit(generator, d):
    path = made_path(generator, d)
    columns, bounds = half_planes(path, np.zeros((0, 2)), np.eye(d), 0.1, 0.5, False, 100.0)
    moves = np.diff(path, axis=0)
    for part, allowed in ((0.5 * np.cos(0.5 * CHORD_ANGLE) - 1e-6, True), (0.5 + 1e-6, False)):
        strides = part * moves / np.linalg.norm(moves, axis=1, keepdims=True)
        x = path[0] + np.cumsum(strides, axis=0)
        assert np.all(x.ravel() @ columns <= bounds + 1e-9) == allowed


def test_steps_that_cannot_reach_the_limit_get_no_half_plane(generator):
    path = np.zeros((STEPS + 1, 2))
    _, bounds = half_planes(path, np.zeros((0, 2)), np.eye(2), 0.1, 0.5, False, 0.2)
    assert bounds.size == 0


@pytest.mark.parametrize("d", [1, 2, 3])
def test_motion_cost_is_its_sums(generator, d):
    path = made_path(generator, d)
    path[3] = path[2]  # stands still during one step
    effort, at_goal = generator.uniform(0.1, 1.0, d), generator.uniform(0, 3, STEPS)
    risk = generator.uniform(0, 0.1, 2 * STEPS)
    steep = np.where(np.arange(STEPS) < 2, 1e3, 50.0)
    found = motion_cost(path, at_goal, 0.7, effort, 0.5, risk, 15.0, steep, 0.05, 1 / 3)
    velocities = np.diff(path, axis=0) / 0.5
    price = (15.0 * risk + np.repeat(steep, 2) * np.maximum(risk - 0.05, 0)).reshape(-1, 2).sum(axis=1)
    price[2] /= 3
    assert found == pytest.approx(at_goal.sum() + 0.7 * at_goal[-1] + (effort * velocities**2).sum() + price.sum())
    assert top_speed(path, 0.5, False) == pytest.approx(np.linalg.norm(velocities, axis=1).max())
    assert top_speed(path, 0.5, True) == pytest.approx(np.abs(velocities).max())
    path[1, 0] = np.nan
    assert np.isnan(top_speed(path, 0.5, True))
    assert np.isnan(top_speed(path, 0.5, False))
