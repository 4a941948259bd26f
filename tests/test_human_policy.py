"""Eq. 2 against brute force over all sequences of actions, from every cell of a small box; and its symmetries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alternatives import policy as twin
from made_people import TIME_STEP, draw_encounter
from sidestep._kernels import sweep as sweeping
from sidestep._kernels.sweep import CostTables, sweep
from sidestep.errors import InvalidInput
from sidestep.human.cost import CostGrid, action_terms, danger_terms, goal_terms
from sidestep.human.goals import DirectionGoal, PointGoal, StandGoal
from sidestep.human.model import HumanModel
from sidestep.human.policy import action_values, best_actions, value_scratch
from sidestep.lattice import Lattice
from sidestep.prediction.occupancy import frame_of

SHAPES = [(1, 2, 3), (1, 3, 2), (2, 1, 3), (2, 2, 2), (3, 1, 1)]  # d, reach, largest N_H


@given(seed=st.integers(0, 2**32 - 1), shape=st.sampled_from(SHAPES), prediction=st.integers(0, 3))
def test_least_costs_and_best_actions_equal_brute_force_in_every_cell(
    seed: int, shape: tuple[int, int, int], prediction: int
) -> None:
    d, reach, longest = shape
    case = draw_encounter(seed, d=d, reach=reach, steps=min(prediction, longest), horizon=1, walls=True)
    lattice = case.lattice.with_radius(1)
    for goal in case.goals:
        for beta in (0, 1):
            given_ = (case.model, lattice, goal, case.path, beta, TIME_STEP)
            values, best = action_values(*given_, case.free), best_actions(*given_, case.free)
            for index in np.ndindex(lattice.shape):
                expected = twin.action_values(*given_, np.array(index) - 1, case.free)
                np.testing.assert_allclose(values[index], expected, rtol=1e-5, atol=1e-12)
                least = expected.min()
                support = expected <= least + 1e-6 * abs(least) + 1e-12 if np.isfinite(least) else np.zeros(len(best))
                np.testing.assert_array_equal(best[index], support)


@pytest.mark.slow
@settings(max_examples=6)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_papers_action_set_over_three_steps(seed: int) -> None:
    """All 25³ sequences."""
    case = draw_encounter(seed, d=2, reach=2, steps=3, horizon=1, walls=True)
    lattice = case.lattice.with_radius(1)
    for beta in (0, 1):
        given_ = (case.model, lattice, case.goals[0], case.path, beta, TIME_STEP)
        values = action_values(*given_, case.free)
        for index in np.ndindex(lattice.shape):
            expected = twin.action_values(*given_, np.array(index) - 1, case.free)
            np.testing.assert_allclose(values[index], expected, rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("reach", [1, 2, 3])
@pytest.mark.parametrize("decay", ["distance", "squared_distance"])
def test_compiled_and_plain_sweeps_agree(d: int, reach: int, decay: str) -> None:
    """The kernel's Python source, run as Python, lays the same values over the same cells."""
    rng = np.random.default_rng(10 * d + reach)
    steps = 2 if d < 3 else 1
    model = HumanModel(danger_decay=decay, goal_cost="distance", reach=reach, horizon=steps)  # type: ignore[arg-type]
    grid = CostGrid(
        lattice=Lattice(origin=np.zeros(d), spacing=0.3, radius=0),
        time_step=0.5,
        reach=reach,
        steps=steps,
        centre=1 + reach * steps,
    )
    danger = danger_terms(model, rng.normal(size=(steps + 1, d)), grid, 1, 1, 1)
    costs = CostTables(*goal_terms(model, PointGoal(rng.normal(size=d)), grid), danger.axes, danger.table)
    taps = action_terms(model, PointGoal(np.zeros(d)), grid, 1).taps
    for concerned in (False, True):
        results = [
            kernel(costs, 1, concerned, taps, 1, grid.centre, d, *value_scratch(grid)).copy()
            for kernel in (sweep, _plain_sweep)
        ]
        inner = (slice(grid.centre - 1 - reach, grid.centre + 2 + reach),) * d
        compiled, plain = (r.reshape((2 * grid.centre + 1,) * d)[inner] for r in results)
        np.testing.assert_allclose(compiled, plain, rtol=1e-13)


def _plain_sweep(*arguments: object) -> np.ndarray:
    """`sweep` and all it calls, as Python."""
    compiled = sweeping.lower_layer, sweeping._lower_rows
    sweeping.lower_layer, sweeping._lower_rows = (f.py_func for f in compiled)
    try:
        return sweeping.sweep.py_func(*arguments)
    finally:
        sweeping.lower_layer, sweeping._lower_rows = compiled


def encounter_values(goal: np.ndarray, path: np.ndarray, beta: int, decay: str = "squared_distance") -> np.ndarray:
    model = HumanModel(frame="world", goal_cost="squared", horizon=3, danger_decay=decay)  # type: ignore[arg-type]
    lattice = Lattice(origin=np.zeros(2), spacing=0.25, radius=2)
    return action_values(model, lattice, PointGoal(goal), path, beta, 0.5).reshape(5, 5, 5, 5)


@given(seed=st.integers(0, 2**32 - 1), beta=st.integers(0, 1))
def test_mirrored_and_turned_worlds_give_mirrored_and_turned_values(seed: int, beta: int) -> None:
    rng = np.random.default_rng(seed)
    goal, path = rng.normal(size=2) * 3, rng.normal(size=(4, 2)) * 2
    values = encounter_values(goal, path, beta)
    mirror = np.array([-1.0, 1.0])
    np.testing.assert_allclose(
        encounter_values(goal * mirror, path * mirror, beta), values[::-1, :, ::-1, :], rtol=1e-12
    )
    turned = encounter_values(np.array([-goal[1], goal[0]]), np.stack([-path[:, 1], path[:, 0]], axis=1), beta)
    np.testing.assert_allclose(turned, values.transpose(1, 0, 3, 2)[::-1, :, ::-1, :], rtol=1e-12)


def test_a_symmetric_encounter_is_a_tie_that_array_order_does_not_break() -> None:
    """Head-on, with room on both sides: left and right are best alike."""
    model = HumanModel(frame="world", goal_cost="squared", horizon=3, danger_weight=50.0, danger_rate=0.5)
    path = np.array([[2.0, 0.0], [1.5, 0.0], [1.0, 0.0], [0.5, 0.0]])
    best = best_actions(model, Lattice(origin=np.zeros(2), spacing=0.25, radius=0), PointGoal((2.0, 0.0)), path, 1, 0.5)
    chosen = best.reshape(5, 5)
    assert chosen.sum() >= 2
    np.testing.assert_array_equal(chosen, chosen[:, ::-1])


def test_without_prediction_only_where_the_robot_is_now_counts() -> None:
    model = replace(HumanModel(frame="world"), horizon=0)
    lattice = Lattice(origin=np.zeros(2), spacing=0.25, radius=1)
    goal = PointGoal((3.0, 0.0))
    still = np.array([[1.0, 0.0]])
    moving = np.array([[1.0, 0.0], [0.0, 5.0], [9.0, 9.0]])
    np.testing.assert_array_equal(
        action_values(model, lattice, goal, still, 1, 0.5), action_values(model, lattice, goal, moving, 1, 0.5)
    )


def test_people_who_stand_stay() -> None:
    lattice = Lattice(origin=np.zeros(2), spacing=0.25, radius=1)
    best = best_actions(HumanModel(), lattice, StandGoal(), np.zeros((5, 2)), 1, 0.5)
    assert best[..., 12].all()
    assert best.sum() == 9


def test_concerned_people_go_around_a_robot_in_their_way_and_unconcerned_ones_do_not() -> None:
    model = HumanModel(horizon=6)
    velocity = np.array([1.2, 0.0])
    lattice = frame_of(model, np.zeros(2), velocity, 0.5)
    path = np.tile([2.0, 0.1], (7, 1))
    goal = DirectionGoal(velocity)
    straight = best_actions(model, lattice, goal, path, 0, 0.5).reshape(5, 5)
    around = best_actions(model, lattice, goal, path, 1, 0.5).reshape(5, 5)
    assert straight[4, 2]
    assert straight.sum() == 1
    assert around[:, :2].any()  # to the side that is farther from the robot
    assert not around[:, 2:].any()


def test_a_path_that_is_too_short_or_walls_of_another_shape_are_refused() -> None:
    lattice = Lattice(origin=np.zeros(2), spacing=0.25, radius=0)
    with pytest.raises(InvalidInput, match="robot_path"):
        action_values(HumanModel(horizon=3), lattice, PointGoal((1.0, 0.0)), np.zeros((3, 2)), 1, 0.5)
    with pytest.raises(InvalidInput, match="free"):
        action_values(
            HumanModel(horizon=1), lattice, PointGoal((1.0, 0.0)), np.zeros((3, 2)), 1, 0.5, np.ones((4, 4), bool)
        )
