"""The compiled convex program against its definition, and against derivatives of what it stands for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from alternatives.program import forbidden, interpolated, objective_value, rise_at, room_to, trust_region
from made_masses import person
from sidestep._kernels.path_costs import goal_costs, half_instants, motion_cost, top_speed
from sidestep._kernels.program import CHORD_ANGLE, goal_model, half_planes, objective
from sidestep._kernels.program_around import REACH, part_way, program_around, promised_gain
from sidestep._kernels.search_corridor import corridor
from sidestep.planning.polish import _program, polish
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import search
from sidestep.prediction.collision import RiskField

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
    rows = np.full((STEPS * d + 1, STEPS * d), np.nan)
    objective(path, curvature, slope, effort, first, wished, rows)
    hessian, linear = rows[:-1], rows[-1]
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
    *columns, bounds = half_planes(path, room, directions, 0.15, 0.5, box, 100.0)
    closer = forbidden(path, room, directions, 0.15)
    assert len(closer) > 0
    for _ in range(10):
        x = path[1:] + generator.normal(0, 0.1, (STEPS, d))
        places = half_instants(np.concatenate([path[:1], x]))[:, 3 - d :]
        margin = bounds - x.ravel() @ np.array(columns)
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
    *columns, bounds = half_planes(path, np.zeros((0, 2)), np.eye(d), 0.1, 0.5, False, 100.0)
    moves = np.diff(path, axis=0)
    for part, allowed in ((0.5 * np.cos(0.5 * CHORD_ANGLE) - 1e-6, True), (0.5 + 1e-6, False)):
        strides = part * moves / np.linalg.norm(moves, axis=1, keepdims=True)
        x = path[0] + np.cumsum(strides, axis=0)
        assert np.all(x.ravel() @ np.array(columns) <= bounds + 1e-9) == allowed


def test_steps_that_cannot_reach_the_limit_get_no_half_plane(generator):
    path = np.zeros((STEPS + 1, 2))
    *_, bounds = half_planes(path, np.zeros((0, 2)), np.eye(2), 0.1, 0.5, False, 0.2)
    assert bounds.size == 0


@pytest.mark.parametrize("d", [1, 2, 3])
def test_motion_cost_is_its_sums(generator, d):
    path = made_path(generator, d)
    path[3] = path[2]  # stands still during one step
    effort, at_goal = generator.uniform(0.1, 1.0, d), generator.uniform(0, 3, STEPS)
    risk = generator.uniform(0, 0.1, 2 * STEPS)
    steep = np.where(np.arange(STEPS) < 2, 1e3, 50.0)
    found = motion_cost(path, at_goal, 0.7, effort, 0.5, risk, 0.5, 30.0, 2 * steep, 0.05, 1 / 3)
    velocities = np.diff(path, axis=0) / 0.5
    price = (15.0 * risk + np.repeat(steep, 2) * np.maximum(risk - 0.05, 0)).reshape(-1, 2).sum(axis=1)
    price[2] /= 3
    assert found == pytest.approx(at_goal.sum() + 0.7 * at_goal[-1] + (effort * velocities**2).sum() + price.sum())
    assert top_speed(path, 0.5, False) == pytest.approx(np.linalg.norm(velocities, axis=1).max())
    assert top_speed(path, 0.5, True) == pytest.approx(np.abs(velocities).max())
    path[1, 0] = np.nan
    assert np.isnan(top_speed(path, 0.5, True))
    assert np.isnan(top_speed(path, 0.5, False))


def surroundings(generator, d, width=12):
    """Smooth rasters of risk around the robot, and which of them hold anything."""
    active = np.arange(3) >= 3 - d
    low, size = (
        np.tile(np.where(active, -width, 0), (2 * STEPS + 1, 1)),
        np.tile(np.where(active, 2 * width + 1, 1), (2 * STEPS + 1, 1)),
    )
    axes = np.meshgrid(*[np.arange(n) + m for n, m in zip(size[0], low[0], strict=True)], indexing="ij")
    rasters = []
    for _ in range(2 * STEPS + 1):
        middle, steepness = np.where(active, generator.normal(0, 4.0, 3), 0.0), generator.uniform(0.02, 0.2)
        away = sum((x - m) ** 2 for x, m in zip(axes, middle, strict=True))
        rasters.append(np.exp(-steepness * away).astype(np.float32))
    starts = np.arange(2 * STEPS + 2) * rasters[0].size
    some = generator.random(2 * STEPS + 1) < 0.7
    return rasters, (np.concatenate([r.ravel() for r in rasters]), starts, some, low, size)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("compiled", [False, True])
def test_the_program_around_a_path_is_made_of_its_parts(generator, d, given, compiled):
    path, spacing, limit = 0.6 * made_path(generator, d) + generator.normal(size=d), 0.125, 0.3
    path[3] = path[2]  # stands still during one step
    directions = np.concatenate([np.eye(d), -np.eye(d)])
    goal, weight, effort, wish, velocity = generator.uniform(0.1, 2.0, (5, d))
    model = generator.uniform(0.1, 2.0, (2, STEPS, d)) if given else np.zeros((0, 0, 0))
    steep = generator.uniform(0, 100, STEPS)
    walls = generator.uniform(0, 0.5, (2 * STEPS, 2 * d)) if given else np.zeros((0, 0))
    rasters, listed = surroundings(generator, d)
    kernel = program_around if compiled else program_around.py_func
    rows, planes = kernel(
        path, spacing, directions, goal, weight, False, 0.5, model, effort, 0.5, wish, 7.0, *listed, limit, 0.5, 15.0,
        steep, 0.4, walls, 1.0, True, velocity, 0.3,
    )  # fmt: skip
    curvature, slope = model if given else goal_model(path, goal, weight, False, 0.5)
    slope, room = slope.copy(), np.full((2 * STEPS, 2 * d), np.inf)
    for n in range(2 * STEPS):
        if not listed[2][n + 1]:
            continue
        k, midway = n // 2, n % 2 == 0
        cell = ((0.5 * (path[k] + path[k + 1]) if midway else path[k + 1]) - path[0]) / spacing
        here = interpolated(rasters[n + 1], cell)
        price = 0.5 * (15.0 + (steep[k] if here > limit else 0.0)) * rise_at(rasters[n + 1], cell) / spacing
        price *= 0.4 if k == 2 else 1.0
        slope[k] += price * (0.5 if midway else 1.0)
        slope[k - 1] += price * (0.5 if midway and k > 0 else 0.0)
        room[n] = [spacing * room_to(rasters[n + 1], cell, v, limit, REACH) for v in directions]
    expected = np.empty((STEPS * d + 1, STEPS * d))
    objective(path, curvature, slope, 8.0 * effort, path[0] + 0.5 * wish, 56.0, expected)
    room = np.minimum(room, walls) if given else room
    np.testing.assert_allclose(rows[:-2], expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(rows[-2:], trust_region(path, spacing, velocity, 0.3, 0.5), atol=1e-12)
    constraints = half_planes(path, room, directions, REACH * spacing, 0.5, True, 2 * spacing * np.sqrt(d))
    np.testing.assert_allclose(planes, constraints, atol=1e-9)


@pytest.mark.parametrize("compiled", [False, True])
def test_the_promised_gain_is_the_fall_of_the_objective(generator, compiled):
    path, rows = made_path(generator, 2), generator.normal(size=(2 * STEPS + 3, 2 * STEPS))
    rows[: 2 * STEPS] += rows[: 2 * STEPS].T
    moved = generator.normal(size=2 * STEPS)
    before, after = (0.5 * x @ rows[: 2 * STEPS] @ x + rows[2 * STEPS] @ x for x in (path[1:].ravel(), moved))
    gain = (promised_gain if compiled else promised_gain.py_func)(path, moved, rows)
    assert gain == pytest.approx(before - after)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("compiled", [False, True])
def test_what_lies_outside_a_raster_is_no_slope(generator, d, compiled):
    """A robot at full speed is at the edge of what it can reach, exactly or but for rounding."""
    rasters, (values, starts, some, low, size) = surroundings(generator, d, width=3)
    some[:] = True
    cells, active = np.zeros((2 * STEPS, 3)), (np.arange(3) >= 3 - d).astype(np.int64)
    cells[:, 3 - d :] = generator.integers(-3, 4, (2 * STEPS, d))
    cells[0, 3 - d], cells[1, 3 - d] = 3.0, -3.0
    cells[:, 3 - d :] += generator.choice([0.0, 1e-12, -1e-12], (2 * STEPS, d))
    rays = np.concatenate([np.eye(3)[3 - d :], -np.eye(3)[3 - d :]])
    look = corridor if compiled else corridor.py_func
    _, slope, level = look(cells, rays, 1.5, active, values, starts, some, low, size, 0.5)
    for n in range(2 * STEPS):
        inside = np.round(cells[n, 3 - d :])
        assert level[n] == pytest.approx(interpolated(rasters[n + 1], inside), abs=1e-6)
        np.testing.assert_allclose(slope[n, 3 - d :], rise_at(rasters[n + 1], inside), atol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_the_program_falls_as_the_objective_does(seed):
    """At full speed past somebody: the slope at every step and along every axis, by finite differences."""
    rng = np.random.default_rng(seed)
    there = person(horizon=4, position=(1.6, rng.uniform(0.9, 1.4)), heading=rng.uniform(-3, 3), spread=True)
    given = PlanningProblem(
        start=np.zeros(2), goal=np.array([6.0, 0.0]), time_step=0.5, horizon=4, max_speed=1.0, shape="disc",
        soft_risk_weight=20.0, risk_limit=1.0, people=RiskField(people=[there], distances=np.array([0.7])),
        preferred=np.array([0.5, 0.2]), preference_weight=0.3,
    )  # fmt: skip
    found = search(given)
    rows, _ = _program(given, found.path, found.maps)
    n = rows.shape[1]
    slope = rows[:n] @ found.path[1:].ravel() + rows[n]
    exact = np.zeros(n)
    for i in range(n):
        ways = [found.path.copy(), found.path.copy()]
        for way, shift in zip(ways, (1e-3, -1e-3), strict=True):
            way[1 + i // 2, i % 2] += shift
        exact[i] = (given.cost(ways[0]) - given.cost(ways[1])) / 2e-3
    assert np.abs(exact).max() > 0.5
    np.testing.assert_allclose(slope, exact, atol=0.35, rtol=0.35)


def test_a_lattice_path_past_somebody_is_polished():
    there = person(horizon=6, position=(1.5, 0.1), heading=2.8, spread=True)
    given = PlanningProblem(
        start=np.zeros(2), goal=np.array([6.0, 1.1]), time_step=0.5, horizon=6, max_speed=1.0, shape="disc",
        soft_risk_weight=6.0, risk_limit=0.05, people=RiskField(people=[there], distances=np.array([0.7])),
    )  # fmt: skip
    found = search(given)
    refined = polish(given, found)
    finer = search(replace(given, resolution=12))
    assert refined.rounds == 2
    times = iter([False, True])
    assert polish(given, found, late=lambda: next(times)).rounds == 1  # what was found by then
    assert polish(given, found, late=lambda: True).path is found.path
    assert refined.cost < found.cost - 0.5 * (found.cost - finer.cost)  # most of what a fine lattice gains


@pytest.mark.parametrize("compiled", [False, True])
def test_part_way_leaves_the_start_and_the_path_itself_alone(generator, compiled):
    path, moved = made_path(generator, 3), generator.normal(size=3 * STEPS)
    before = path.copy()
    found = (part_way if compiled else part_way.py_func)(path, moved, 0.2)
    np.testing.assert_allclose(found, 0.8 * path + 0.2 * np.concatenate([path[:1], moved.reshape(-1, 3)]), atol=1e-12)
    assert np.array_equal(path, before)
    path[2] = path[1]
    found = (part_way if compiled else part_way.py_func)(path, moved, 0.2)
    assert np.array_equal(found[2], found[1])  # goes on standing
    np.testing.assert_allclose(found[3:], (0.8 * path + 0.2 * np.concatenate([path[:1], moved.reshape(-1, 3)]))[3:])
